"""How long the twin takes, and what it misses: ``python tests/benchmarks/bench_twin.py [OBJECT]``.

Prints medians with the middle half of the spread; asserts nothing.
"""

import sys
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
from harness.twin.sweep import sweep

HOME = np.radians([0.0, -90.0, 90.0, -90.0, -90.0, 0.0])
T = TypeVar("T")
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
    say(f"{name}, {len(mesh.faces)} faces, ur5e")
    _ask(bench, 0)  # compiles
    sites = _reach(bench, mesh)
    _plans(bench, sites)
    _alarms(bench)


def _reach(bench: TwinBench, mesh: Mesh) -> list[FloatArray]:
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
    say(f"  tool fits {np.mean(fits):.0%} of places, arm reaches {found.sum() / sum(fits):.0%} of those")
    say(f"  reachable: {spread(times, 1e3)} ms, 95 % {np.percentile(times, 95) * 1e3:.1f} ms")
    return [pose for pose, answer in zip(poses, answers, strict=True) if answer]


def _plans(bench: TwinBench, sites: list[FloatArray]) -> None:
    planning, rehearsing, failed, segments = [], [], 0, []
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
        if report.refusals:
            say(f"  refused: {report.refusals[0]}")
    say(
        f"  planning {CONTACTS} contacts: {spread(planning, 1)} s; "
        f"{failed} of {len(planning) * CONTACTS} found no way"
    )
    say(f"  rehearsing them ({np.median(segments):.0f} motions): {spread(rehearsing, 1e3)} ms")


def _plan(bench: TwinBench, sites: list[FloatArray]) -> list[PlannedContact | None]:
    joints, contacts = HOME, []
    for site in sites:
        contact = plan_contact(bench, site, joints)
        contacts.append(contact)
        joints = joints if contact is None else contact.stand_off_joints
    return contacts


def _alarms(bench: TwinBench, count: int = 150) -> None:
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
    say(
        f"  {count} random motions, {blocked} blocked: missed {missed}, false alarms {false}; "
        f"{spread(times, 1e3)} ms"
    )


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


def say(line: str) -> None:
    """Print a line."""
    sys.stdout.write(line + "\n")


if __name__ == "__main__":
    main(sys.argv[1] if len(sys.argv) > 1 else "mug")
