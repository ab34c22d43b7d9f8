"""How long the twin takes, and what it misses: ``python tests/benchmarks/bench_twin.py [OBJECT]``.

Prints or writes medians with the middle half of the spread; asserts nothing.
"""

import time
from collections.abc import Callable, Iterator
from functools import partial
from typing import TypeVar

import numpy as np

from harness.basics.arrays import FloatArray
from harness.basics.geometry import frame_facing, rotation_about, transform, translation
from harness.basics.mesh import Mesh
from harness.bench import kinematics
from harness.bench.sensor import GELSIGHT_R15
from harness.objects.household import build
from harness.twin.bench import TwinBench
from harness.twin.motion import PlannedContact, plan_contact, reachable
from harness.twin.rehearsal import rehearse
from harness.twin.ways import sweep
from tests.benchmarks.results import benchmark_parser, finish_figure
from tests.docs.results import Cell

HOME = np.radians([0.0, -90.0, 90.0, -90.0, -90.0, 0.0])
T = TypeVar("T")
Row = tuple[Cell, ...]
CONTACTS = 7
MOST_TILT = np.radians(15.0)


def main(name: str) -> None:
    """Measure one built-in object."""
    mesh = build(name)
    bench = TwinBench(
        "ur5e",
        translation(np.array([0.0, 0.0, 0.12])),
        GELSIGHT_R15,
        mesh,
        translation(np.array([-0.42, 0.0, 0.25])),
    )
    _ask(bench, 0)  # compiles
    reached, sites = _reach(bench, mesh)
    rows = [*reached, *_plans(bench, sites), *_alarms(bench)]
    finish_figure("bench", "twin", f"quantity, {name}, {len(mesh.faces)} faces, ur5e; value", rows)


def _reach(bench: TwinBench, mesh: Mesh) -> tuple[list[Row], list[FloatArray]]:
    poses = list(_presses(bench, mesh, 600, np.random.default_rng(0)))
    fits, answers, times = [], [], []
    for pose in poses:
        back = pose @ translation(np.array([0.0, 0.0, -0.03]))
        fits.append(
            0 < bench.pad_depth(pose) <= bench.sensor.gel_thickness
            and not bench.tool_hits(pose, press=True)
            and not bench.tool_hits(back, press=False)
        )
        seconds, answer = timed(partial(reachable, bench, pose))
        answers.append(answer)
        times.append(seconds)
    found = np.array(answers)
    rows: list[Row] = [
        (
            "places where the tool fits; of these reached",
            f"{np.mean(fits):.0%}; {found.sum() / sum(fits):.0%}",
        ),
        ("check whether a place is reachable", f"{spread(times, 1e3)} ms"),
    ]
    return rows, [pose for pose, answer in zip(poses, answers, strict=True) if answer]


def _plans(bench: TwinBench, sites: list[FloatArray]) -> list[Row]:
    planning, rehearsing, failed, refused, segments = [], [], 0, 0, []
    for first in range(0, min(len(sites), 10 * CONTACTS), CONTACTS):
        seconds, contacts = timed(partial(_plan, bench, sites[first : first + CONTACTS]))
        planning.append(seconds)
        failed += sum(contact is None for contact in contacts)
        plan = [
            s for step, contact in enumerate(contacts) if contact is not None for s in contact.segments(step)
        ]
        seconds, report = timed(partial(rehearse, bench, plan))
        rehearsing.append(seconds)
        segments.append(len(plan))
        refused += bool(report.refusals)
    return [
        (f"planning {CONTACTS} contacts with their paths", f"{spread(planning, 1)} s"),
        ("contacts without a path", f"{failed} of {len(planning) * CONTACTS}"),
        (f"rehearsing them, {np.median(segments):.0f} motions", f"{spread(rehearsing, 1e3)} ms"),
        ("refused by the rehearsal", f"{refused} of {len(planning)}"),
    ]


def _plan(bench: TwinBench, sites: list[FloatArray]) -> list[PlannedContact | None]:
    joints, contacts = HOME, []
    for site in sites:
        contact = plan_contact(bench, site, joints)
        contacts.append(contact)
        joints = joints if contact is None else contact.stand_off_joints
    return contacts


def _alarms(bench: TwinBench, count: int = 150) -> list[Row]:
    """Against the same question asked every 0.5 mrad."""
    rng = np.random.default_rng(2)
    missed, false, blocked, times = 0, 0, 0, []
    for _ in range(count):
        end = HOME + rng.uniform(-1, 1, 6) * [1.5, 0.9, 0.9, 1.5, 1.5, 1.5]
        seconds, found = timed(partial(sweep, bench, HOME, end))
        times.append(seconds)
        shares = np.linspace(0, 1, int(np.abs(end - HOME).max() / 5e-4))
        truth = any(bench.hits(HOME + share * (end - HOME)) for share in shares)
        blocked += truth
        missed += truth and found is None
        false += found is not None and not truth
    counts = f"{count}, {blocked} blocked; {missed} missed, {false} false"
    return [
        ("motions checked against samples every 0.5 mrad", counts),
        ("check of a motion", f"{spread(times, 1e3)} ms"),
    ]


def _ask(bench: TwinBench, index: int) -> None:
    pose = bench.base_from_gel(HOME + 0.01 * index)
    reachable(bench, pose)
    plan_contact(bench, pose, HOME)
    bench.solid.first_hit(pose[:3, 3], pose[:3, 2])
    bench.solid.nearest(pose[:3, 3])
    kinematics.inverse(bench.model, pose)


def _presses(bench: TwinBench, mesh: Mesh, count: int, rng: np.random.Generator) -> Iterator[FloatArray]:
    """Gel poses 0.5 mm into random places, tilted by up to 15 degrees, any yaw."""
    faces = rng.choice(len(mesh.faces), count, p=mesh.face_areas / mesh.face_areas.sum())
    for face in faces:
        point = rng.dirichlet([1, 1, 1]) @ mesh.corners[face]
        axis = -mesh.face_normals[face]
        aside = frame_facing(axis, rng.uniform(0, 2 * np.pi))[:, 0]
        axis = rotation_about(aside, float(np.arccos(rng.uniform(np.cos(MOST_TILT), 1)))) @ axis
        rotation = frame_facing(axis / np.linalg.norm(axis), rng.uniform(0, 2 * np.pi))
        yield bench.base_from_object @ transform(rotation, point + 5e-4 * axis)


def timed(work: Callable[[], T]) -> tuple[float, T]:
    """CPU seconds, and the answer."""
    start = time.process_time()
    answer = work()
    return time.process_time() - start, answer


def spread(values: list[float], scale: float) -> str:
    """Median and the middle half."""
    low, middle, high = np.percentile(np.array(values) * scale, [25, 50, 75])
    return f"{middle:.3g} ({low:.3g} to {high:.3g})"


if __name__ == "__main__":
    parser = benchmark_parser(__doc__)
    parser.add_argument("object", nargs="?", default="mug")
    main(parser.parse_args().object)
