"""Ways from one posture to another that hit nothing: straight, over the object, or found by search."""

import heapq
import itertools
import math
from dataclasses import dataclass
from typing import Final

import numpy as np

from harness.basics.arrays import FloatArray, IntArray
from harness.basics.geometry import rotation_from_vector, transform, translation, vector_from_rotation
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


LONGEST_MOVE: Final = 2.5  # rad a joint turns in one motion
HEADROOM: Final = (0.08, 0.2)  # m above the object at which the gel passes over it
PULL_BACK: Final = (0.06, 0.15)  # m along the gel's axis, away from the object
TREE_STEP: Final = 0.3  # rad
TREE_NODES: Final = 300
SHORTCUTS: Final = 40


def connect(
    bench: TwinBench, start: FloatArray, end: FloatArray, seed: int = 0, thorough: bool = True
) -> FloatArray | None:
    """Joint motions from ``(6,)`` to ``(6,)`` rad that hit nothing.

    First the shortest chain of a few natural stations (pulled back from the object, lifted
    over it, above it), then, if ``thorough``, a search from both ends. The same question always
    gets the same answer.

    Returns:
        ``(n, 6)`` rad, the stations after ``start``, the last of them ``end``; None where no way
        was found.
    """
    stations = _stations(bench, start, end)
    way = _shortest(bench, stations)
    if way is None and thorough and not bench.hits(start) and not bench.hits(end):
        way = search(bench, start, end, np.random.default_rng(seed))
    if way is None:
        return None
    # Divide motions in which a joint turns more than ``LONGEST_MOVE``.
    pieces = [way[:1]]
    for a, b in itertools.pairwise(way):
        count = max(1, math.ceil(float(np.abs(b - a).max()) / LONGEST_MOVE))
        pieces.append(a + np.linspace(0.0, 1.0, count + 1)[1:, None] * (b - a))
    return np.concatenate(pieces)[1:]


def lifted(bench: TwinBench, joints: FloatArray, back: float, headroom: float | None) -> FloatArray | None:
    """The posture pulled back along the gel's axis, then raised so that all of the gel clears the object."""
    base_from_gel = bench.base_from_gel(joints) @ translation(np.array([0.0, 0.0, -back]))
    if headroom is not None:
        base_from_gel[2, 3] = max(base_from_gel[2, 3], bench.object_top + headroom)
    return kinematics.nearest_branch(
        bench.model, base_from_gel @ bench.gel_from_flange, joints, bench.joint_range
    )


def _stations(bench: TwinBench, start: FloatArray, end: FloatArray) -> FloatArray:
    """``(n, 6)`` rad; the first is the start, the second the end."""
    stations: list[FloatArray] = [start, end]
    for joints in (start, end):
        for back in (0.0, *PULL_BACK):
            for headroom in (None, *HEADROOM):
                lift = None if back == 0.0 and headroom is None else lifted(bench, joints, back, headroom)
                if lift is not None:
                    stations.append(lift)
    middle = bench.base_from_object[:3, 3]
    down = np.diag([1.0, -1.0, -1.0])
    above = transform(down, np.array([middle[0], middle[1], bench.object_top + HEADROOM[-1]]))
    for joints in (start, end):
        postures = kinematics.inverse(bench.model, above @ bench.gel_from_flange)
        stations.extend(kinematics.within_range(postures, joints, bench.joint_range))
    return np.stack(stations)


def _shortest(bench: TwinBench, stations: FloatArray) -> FloatArray | None:
    """Shortest free chain from station 0 to 1; edges are swept only when the best chain uses them."""
    cost = np.abs(stations[:, None] - stations[None, :]).max(axis=-1) + 0.2  # a stop costs time too
    free = np.zeros(cost.shape, dtype=bool)
    while True:
        chain = _chain(cost)
        if chain is None:
            return None
        for a, b in itertools.pairwise(chain):
            if free[a, b]:
                continue
            if sweep(bench, stations[a], stations[b]) is None:
                free[a, b] = free[b, a] = True
            else:
                cost[a, b] = cost[b, a] = np.inf
                break
        else:
            return stations[chain]


def _chain(cost: FloatArray) -> list[int] | None:
    """Dijkstra's shortest chain from 0 to 1; None where every one costs infinitely much."""
    total = np.full(len(cost), np.inf)
    total[0] = 0.0
    before = np.zeros(len(cost), dtype=int)
    queue = [(0.0, 0)]
    while queue:
        so_far, here = heapq.heappop(queue)
        if here == 1:
            break
        for there in np.flatnonzero(so_far + cost[here] < total).tolist():
            total[there] = so_far + cost[here, there]
            before[there] = here
            heapq.heappush(queue, (float(total[there]), there))
    if not math.isfinite(total[1]):
        return None
    chain = [1]
    while chain[-1] != 0:
        chain.append(int(before[chain[-1]]))
    return chain[::-1]


@dataclass
class _Tree:
    """Postures reached, and from which."""

    postures: list[FloatArray]
    parents: list[int]

    def grow(self, bench: TwinBench, goal: FloatArray) -> bool:
        """Go from the nearest posture towards the goal until blocked; whether it was reached."""
        here = int(np.argmin(np.abs(np.stack(self.postures) - goal).max(axis=1)))
        while True:
            way = goal - self.postures[here]
            length = float(np.abs(way).max())
            there = goal if length <= TREE_STEP else self.postures[here] + way * (TREE_STEP / length)
            if sweep(bench, self.postures[here], there) is not None:
                return False
            self.postures.append(there)
            self.parents.append(here)
            here = len(self.postures) - 1
            if length <= TREE_STEP:
                return True

    def branch(self) -> list[FloatArray]:
        """From the root to the newest posture."""
        here, branch = len(self.postures) - 1, []
        while here >= 0:
            branch.append(self.postures[here])
            here = self.parents[here]
        return branch[::-1]


def search(
    bench: TwinBench, start: FloatArray, end: FloatArray, rng: np.random.Generator
) -> FloatArray | None:
    """Random trees grown from both ends until they meet (RRT-Connect, Kuffner and LaValle, ICRA 2000).

    Returns:
        ``(n, 6)`` rad from start to end, shortened where that stays free; None where the trees have
        not met after 300 attempts.
    """
    low = np.maximum(np.minimum(start, end) - 1.5, bench.joint_range[0])
    high = np.minimum(np.maximum(start, end) + 1.5, bench.joint_range[1])
    near, far = _Tree([start], [-1]), _Tree([end], [-1])
    swapped = False
    for _ in range(TREE_NODES):
        near.grow(bench, rng.uniform(low, high))
        if far.grow(bench, near.postures[-1]):
            way = near.branch() + far.branch()[::-1][1:]
            return _shortened(bench, np.stack(way[::-1] if swapped else way), rng)
        near, far, swapped = far, near, not swapped
    return None


def _shortened(bench: TwinBench, way: FloatArray, rng: np.random.Generator) -> FloatArray:
    """Leave out stations between which the straight motion is free."""
    for _ in range(SHORTCUTS):
        if len(way) < 3:
            break
        a, b = np.sort(rng.choice(len(way), 2, replace=False))
        if b - a > 1 and sweep(bench, way[a], way[b]) is None:
            way = np.concatenate([way[: a + 1], way[b:]])
    return way


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
