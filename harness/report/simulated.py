"""What was simulated for a report, and what the mocked world did differently."""

from collections.abc import Iterator, Mapping
from typing import Any

from harness.effects.explain_networks import NetworkInUse, networks_at
from harness.experiment.compare import Comparison
from harness.experiment.experiment import Scored
from harness.report.data import EffectRun, Observed
from harness.report.values import Missing

NO_TRUTH = Missing("the truth is not known: this is not a mocked run, or its truth was taken away")


def effect_rows(comparison: Comparison) -> tuple[EffectRun, ...]:
    """Every effect of the plan: those that ran with what they took, those left out with the reason."""
    plan, evaluation = comparison.plan, comparison.evaluation
    ran = [
        EffectRun(
            step.effect.provides,
            True,
            step.reason,
            evaluation.calls.get(step.effect.provides, 0),
            evaluation.seconds.get(step.effect.provides),
            step.effect.provides in evaluation.from_store,
        )
        for step in plan.ran
    ]
    return (*ran, *(EffectRun(step.effect.provides, False, step.reason) for step in plan.skipped))


def network_rows(scored: Scored) -> tuple[NetworkInUse, ...]:
    """The networks that stood for a simulation in an answer; none where the run carries no ObjectFile."""
    if scored.run.scene.object.objectfile is None:
        return ()
    return networks_at(scored.run.objectfile.description, scored.accuracy.levels)


def observed_rows(comparison: Comparison) -> tuple[Observed, ...]:
    """A row for every quantity that the scene observes, and for every part of one."""
    return tuple(row for name, said in comparison.observed().items() for row in _observed(name, said))


def _observed(name: str, said: Mapping[str, Any]) -> Iterator[Observed]:
    if "parts" in said:
        for part, inner in said["parts"].items():
            yield from _observed(f"{name}: {part}", inner)
    elif "shape" in said:
        shape = " x ".join(str(length) for length in said["shape"]) or "one number"
        yield Observed(name, shape, said.get("least"), said.get("mean"), said.get("most"))
    else:
        yield Observed(name, said["kind"])


def world_rows(scored: Scored, ours: Mapping[str, str]) -> dict[str, str] | Missing:
    """What the mocked world did differently, by name, and the estimator's side of it beside."""
    if scored.truth is None:
        return NO_TRUTH
    return {name: _said(value) for name, value in (*flat(scored.truth.differences), *ours.items())}


def flat(tree: Mapping[str, object], above: str = "") -> Iterator[tuple[str, object]]:
    """Names and values of a tree, those of a branch with its name before theirs."""
    for name, value in tree.items():
        if isinstance(value, Mapping):
            yield from flat(value, f"{above}{name}.")
        else:
            yield f"{above}{name}", value


def _said(value: object) -> str:
    if isinstance(value, float):
        return f"{value:.4g}" if value else "0"  # nor -0
    if isinstance(value, list):
        return ", ".join(_said(item) for item in value)
    return str(value)
