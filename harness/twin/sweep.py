"""Whether a motion hits anything on its way, in steps that the gaps allow."""

from dataclasses import dataclass
from typing import Final

import numpy as np

from harness.basics.arrays import FloatArray, IntArray
from harness.basics.geometry import rotation_from_vector, transform, vector_from_rotation
from harness.bench import kinematics
from harness.twin.bench import Hit, TwinBench

STEP: Final = 2e-3  # m of surface motion: the shortest step of a joint motion, the step of a line
TURN_STEP: Final = 0.02  # rad: the step of a line that turns
SIGHT: Final = 0.1  # m within which gaps are measured
GREATEST_JUMP: Final = 0.3  # rad of a joint from one step of a line to the next


@dataclass(frozen=True)
class Blocked:
    """Where a motion first hits something."""

    share: float  #: of the motion done by then, 0 to 1.
    hits: tuple[Hit, ...]  #: what is hit.


def sweep(bench: TwinBench, start: FloatArray, end: FloatArray) -> Blocked | None:
    """Follow the straight line in joint space from ``(6,)`` to ``(6,)`` rad; None where it is free.

    Each step is as long as the narrowest gap allows whatever the direction of motion
    (conservative advancement), so that nothing thinner is jumped over.
    """
    travelled = np.concatenate(
        [np.zeros((1, len(bench.parts))), np.cumsum(bench.reach * np.abs(end - start)[:, None], axis=0)]
    )
    links: IntArray = bench.links
    relative: FloatArray = travelled[links[None, :], np.arange(len(links))[None, :]] - travelled[links, :]
    relative = np.maximum(relative, 0.0)
    greatest = float(relative.max())
    floor = STEP / greatest if greatest > STEP else 1.0
    share = 0.0
    while True:
        near = bench.near(start + share * (end - start), SIGHT)
        hits = bench.judge(near, press=False)
        if hits:
            return Blocked(share, hits)
        if share >= 1.0:
            return None
        moves = relative[near.pairs[:, 0], near.pairs[:, 1]]
        step = min(
            float(np.min(near.gaps / np.maximum(moves, 1e-12), initial=np.inf)), SIGHT / max(greatest, SIGHT)
        )
        share = min(share + max(step, floor), 1.0)


def sweep_postures(bench: TwinBench, postures: FloatArray, press: bool) -> Blocked | None:
    """Check each of ``(n, 6)`` rad, close to one another, in turn."""
    for index, joints in enumerate(postures):
        hits = bench.hits(joints, press)
        if hits:
            return Blocked(index / max(len(postures) - 1, 1), hits)
    return None


def line_poses(base_from_start: FloatArray, base_from_end: FloatArray) -> FloatArray:
    """``(n, 4, 4)`` along a straight line, 2 mm apart, turning evenly about one axis."""
    turn = vector_from_rotation(base_from_start[:3, :3].T @ base_from_end[:3, :3])
    way = base_from_end[:3, 3] - base_from_start[:3, 3]
    steps = max(float(np.linalg.norm(way)) / STEP, float(np.linalg.norm(turn)) / TURN_STEP, 1.0)
    shares = np.linspace(0.0, 1.0, int(np.ceil(steps)) + 1)
    poses = [
        transform(base_from_start[:3, :3] @ rotation_from_vector(s * turn), base_from_start[:3, 3] + s * way)
        for s in shares
    ]
    return np.stack(poses)


def line_postures(bench: TwinBench, start: FloatArray, poses: FloatArray) -> FloatArray:
    """``(k, 6)`` rad that follow the flange poses without leaving the branch of ``start``.

    Fewer than the poses, where the next one is out of reach, out of range, or needs a jump of
    some joint.
    """
    postures = [np.asarray(start)]
    for pose in poses[1:]:
        joints = kinematics.nearest_branch(bench.model, pose, postures[-1], bench.joint_range)
        if joints is None or np.abs(joints - postures[-1]).max() > GREATEST_JUMP:
            break
        postures.append(joints)
    return np.stack(postures)
