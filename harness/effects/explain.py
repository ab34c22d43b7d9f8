"""A plan in words: which effects run and which not, and why."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import NotRequired, TypedDict

from rich.table import Table

from harness.bench.scene import SceneFile
from harness.bench.sensor import TactileSensor
from harness.effects.accuracy import Accuracy, Level
from harness.effects.catalogue import DIALS, EFFECTS, NETWORK, SOUND_EFFECTS
from harness.effects.effect import Facts
from harness.effects.plan import Plan, default_accuracy, plan
from harness.effects.scene_object import named_file
from harness.objectfile.description import Description
from harness.objectfile.entries import Modality

MODES = "object.modes"

_INSTEAD_OF: Mapping[Modality, str] = {
    "audio": "finite elements: the modes and their gains",
    "touch": "rasteriser and skirt: candidates' tactile images, and the readings' at the answer",
    "vision": "rays on the mesh: the scene camera's picture",
}


@dataclass(frozen=True)
class NetworkInUse:
    """A network that stands for a simulation."""

    dial: str  #: whose level it is.
    file: str  #: of the ObjectFile.
    instead_of: str  #: what is not simulated.
    errors: Mapping[str, float]  #: of its model card, by names with units, where it was never trained.
    seconds: Mapping[str, float]
    """of one query as its model card has it, by the name of the query; empty where it says none."""


class ExplainedEffect(TypedDict):
    """One effect of a plan."""

    effect: str  #: its quantity.
    reason: str  #: why it runs or not.
    levels: NotRequired[dict[str, Level]]  #: of its knobs where it runs.
    seconds: NotRequired[float | None]  #: that it took in an evaluation; None where it took none.
    calls: NotRequired[int]  #: how often it was computed in an evaluation.


class ExplainedPlan(TypedDict):
    """A plan as JSON values."""

    ran: list[ExplainedEffect]
    skipped: list[ExplainedEffect]


def scene_plan(scene: SceneFile, sensor: TactileSensor, accuracy: Accuracy | None = None) -> Plan:
    """What would be simulated to compare a bench with this scene.

    Args:
        scene: says what is observed.
        sensor: on the flange.
        accuracy: levels; None for the default ones.

    Raises:
        WrongUse: ``observe`` names something that nothing computes or that the scene rules out.
    """
    heard = scene.sensors.sound and MODES not in scene.observe
    return plan(
        EFFECTS,
        Facts(scene, sensor),
        (*scene.observe, MODES) if heard else scene.observe,
        accuracy or default_accuracy(EFFECTS),
    )


def without_sound(scene: SceneFile) -> SceneFile:
    """The scene where nothing is to be heard, nor any quantity of sound observed."""
    audible = {effect.provides for effect in SOUND_EFFECTS}
    silent = scene.sensors.model_copy(update={"sound": False})
    observed = tuple(name for name in scene.observe if name not in audible)
    return scene.model_copy(update={"sensors": silent, "observe": observed})


def as_json(chosen: Plan) -> ExplainedPlan:
    """Return a plan as JSON values."""
    ran: list[ExplainedEffect] = [
        {"effect": step.effect.provides, "reason": step.reason, "levels": dict(step.levels)}
        for step in chosen.ran
    ]
    skipped: list[ExplainedEffect] = [
        {"effect": step.effect.provides, "reason": step.reason} for step in chosen.skipped
    ]
    return {"ran": ran, "skipped": skipped}


def as_table(chosen: Plan, left_out: bool = True) -> Table:
    """The same for a terminal.

    Args:
        chosen: the plan.
        left_out: whether an effect that does not run has a row too.
    """
    table = Table(title=f"to compute {', '.join(chosen.wanted)}")
    for heading in ("effect", "runs", "why", "levels"):
        table.add_column(heading)
    for step in chosen.ran:
        levels = ", ".join(f"{name} = {level}" for name, level in step.levels.items())
        table.add_row(step.effect.provides, "[green]yes[/]", step.reason, levels)
    for skipped in chosen.skipped if left_out else ():
        reason = skipped.reason.replace("[", r"\[")
        table.add_row(skipped.effect.provides, "no", reason, "", style="dim")
    return table


def left_out(chosen: Plan) -> list[str]:
    """A sentence for each reason why effects do not run: ``"the gel has no markers: touch.markers, ..."``."""
    named: dict[str, list[str]] = {}
    for skipped in chosen.skipped:
        name = skipped.effect.provides
        # What passes through in its place, and its own name, would make every reason another one.
        reason = skipped.reason.split("; ")[0].replace(f" {name}", " it")
        named.setdefault(reason, []).append(name)
    return [f"{reason}: {', '.join(names)}" for reason, names in named.items()]


def networks_in_use(scene: SceneFile, chosen: Plan) -> tuple[NetworkInUse, ...]:
    """The networks that stand for a simulation of a plan; none where the scene names no ObjectFile.

    Raises:
        DataRefused: the ObjectFile is damaged.
    """
    turned = {name for step in chosen.ran for name, level in step.levels.items() if level == NETWORK}
    if scene.object.objectfile is None or not turned:
        return ()
    return networks_at(named_file(scene).description, dict.fromkeys(turned, NETWORK))


def networks_at(of: Description, levels: Mapping[str, Level]) -> tuple[NetworkInUse, ...]:
    """The networks of an ObjectFile that stand for a simulation at some levels.

    Args:
        of: what its ``object.json`` says.
        levels: by the names of dials.
    """
    found = []
    for sense, dial in DIALS.items():
        if levels.get(dial.name) == NETWORK and sense in of.networks:
            entry = of.networks[sense]
            other = ("seconds_", "bytes")
            errors = {name: value for name, value in entry.measured.items() if not name.startswith(other)}
            seconds = {
                name.removeprefix("seconds_").replace("_", " "): value
                for name, value in entry.measured.items()
                if name.startswith("seconds_")
            }
            found.append(NetworkInUse(dial.name, entry.file, _INSTEAD_OF[sense], errors, seconds))
    return tuple(found)


def networks_as_json(networks: tuple[NetworkInUse, ...]) -> list[dict[str, object]]:
    """``[{dial, level, file, instead_of, errors, seconds}]``."""
    return [{"dial": each.dial, "level": NETWORK, **asdict(each)} for each in networks]


def networks_as_table(networks: tuple[NetworkInUse, ...]) -> Table:
    """The same for a terminal."""
    table = Table(title="networks of the ObjectFile that stand for a simulation")
    for heading in ("level", "network", "instead of", "error on its model card", "seconds on it"):
        table.add_column(heading)
    for each in networks:
        errors, seconds = _listed(each.errors), _listed(each.seconds)
        table.add_row(f"{each.dial} = {NETWORK}", each.file, each.instead_of, errors, seconds)
    return table


def _listed(numbers: Mapping[str, float]) -> str:
    return "\n".join(f"{name} {value:.3g}" for name, value in numbers.items()) or "not measured"
