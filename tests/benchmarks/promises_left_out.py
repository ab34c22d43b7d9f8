"""How well errors are promised, and how soon they are met, on runs left out of the cost curve.

Run as ``python tests/benchmarks/promises_left_out.py [--curve FILE]``: some seconds, and nothing is measured
anew. One seed at a time is left out of the curve (contact localization, six contacts, yaw known; the one
that is shipped unless another is given). Each of its runs is then asked for every error as
``touchstone run --error`` asks, by what the other seeds promise. Printed for each error: in how many of the
runs it was promised to it was met, and the seconds of all runs beside those of the cheapest *one* setting
whose error is met in 19 of 20 of them, found afterwards by trying all.
"""

import argparse
import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from experiments.contact_localization.experiment import EXPERIMENT
from harness.cost.choice import for_error
from harness.cost.curve import Point, Sample
from harness.cost.file import load
from harness.cost.promise import promise
from harness.experiment.front import front_of

SHIPPED = Path(__file__).parents[2] / "experiments" / "contact_localization" / "data" / "cost.json"
ERRORS = (2e-3, 3e-3, 5e-3, 8e-3, 12e-3, 20e-3)
SHARE = 0.95


@dataclass(frozen=True)
class Answer:
    """Of a run left out: whether its error was promised, whether it was met, and the CPU s of all tries."""

    promised: bool
    met: bool
    seconds: float


def main() -> None:
    """One line for each spacing and error."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--curve", type=Path, default=SHIPPED)
    curve = load(parser.parse_args().curve)
    promised = met = 0
    for spacing in ("close", "spread"):
        condition = {"spacing": spacing, "gap": "default", "yaw": "known", "contacts": 6}
        points = front_of(EXPERIMENT, curve, condition, (), shipped=False).points
        for error in ERRORS:
            answers = list(left_out(points, error))
            promised += sum(answer.promised for answer in answers)
            met += sum(answer.promised and answer.met for answer in answers)
            sys.stdout.write(f"{spacing}, error {1e3 * error:g} mm: {judged(answers, points, error)}\n")
    sys.stdout.write(f"met in {met} of the {promised} runs an error was promised to\n")


def left_out(points: Sequence[Point], error: float) -> Iterator[Answer]:
    """Every run, asked for an error by the curve without its seed."""
    for seed in sorted({seed_of(sample) for sample in points[0].samples}):
        known = [replace(p, samples=tuple(s for s in p.samples if seed_of(s) != seed)) for p in points]
        runs = [sample for sample in points[0].samples if seed_of(sample) == seed]
        for run in runs:
            own = {p.name: next(s for s in p.samples if s.run == run.run) for p in points}
            yield tried(for_error(known, error, run.object), own, error)


def tried(candidates: Sequence[Point], own: dict[str, Sample], error: float) -> Answer:
    """One run at one setting after another until the error is promised."""
    seconds, shared = 0.0, 0.0
    for point in candidates:
        sample = own[point.name]
        seconds, shared = seconds + sample.cpu, max(shared, sample.shared)
        is_promised = sample.radius is not None and promise(point, sample.radius, sample.object) <= error
        if is_promised:
            break
    return Answer(is_promised, sample.error <= error, seconds + shared)


def judged(answers: Sequence[Answer], points: Sequence[Point], error: float) -> str:
    """For people: promises met, and the seconds beside the best setting's."""
    promised = [answer for answer in answers if answer.promised]
    seconds = float(np.exp(np.mean([np.log(answer.seconds) for answer in answers])))
    fixed = [p.seconds.value for p in points if np.mean(p.errors <= error) >= SHARE]
    beside = f"{seconds / min(fixed):.2f} times the best" if fixed else "no one setting meets it in 19 of 20"
    met = sum(answer.met for answer in promised)
    return f"met in {met} of {len(promised)} promised of {len(answers)}; {seconds:.3f} s, {beside}"


def seed_of(sample: Sample) -> int:
    """The seed in a run's name, as in ``mug-close-default-known-3000-sound``."""
    return int(next(part for part in sample.run.split("-") if part.isdigit()))


if __name__ == "__main__":
    main()
