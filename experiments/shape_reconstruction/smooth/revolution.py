"""Find a vertical axis of revolution that contacts agree on, and rotate contacts and free space about it.

A normal's line meets the axis, and places of different touches that face alike at one height lie on one
profile, wherever they are around it. An axis is that which the normals agree on and then the profile; it is
taken where most of the normals' horizontal parts and of the places that have such a partner agree.
"""

from dataclasses import dataclass, replace

import numpy as np
from scipy import ndimage
from scipy.spatial import cKDTree

from experiments.shape_reconstruction import thresholds as limits
from experiments.shape_reconstruction.evidence import ShapeEvidence
from experiments.shape_reconstruction.smooth.free_space import ContactSamples, sensor_depth
from harness.basics.arrays import BoolArray, FloatArray
from harness.basics.geometry import rotation_about

COPIES = 16
"""Copies of each point around the axis."""

APART = 12.0e-3
"""Distance from a contact within which no copy is made, m."""

_HORIZONTAL = 0.25
_HEIGHT, _NEAR, _AROUND, _ALIKE = 8.0e-3, 12.0e-3, 25.0e-3, 0.9
_MARGIN, _STEPS, _FIRST = 10.0e-3, (6.0e-3, 2.0e-3, 0.7e-3), 3
_OFF_LOSS = 3.0e-3
_MOST = 50
_UNKNOWN = 0.5


@dataclass(frozen=True, eq=False)
class Revolution:
    """An axis that contacts agree on."""

    centre: FloatArray  #: ``(2,)`` m, x and y of the axis in ``stand``.
    of_body: BoolArray  #: ``(n,)`` which samples do: the others are a handle's, or whatever else stands out.

    def copies(self, samples: ContactSamples) -> tuple[FloatArray, FloatArray]:
        """``(m, 3)`` m and normals: the body's places turned about the axis, where nothing was touched."""
        centre = np.append(self.centre, 0.0)
        places, normals = samples.points[self.of_body] - centre, samples.normals[self.of_body]
        turns = [
            rotation_about(np.array([0.0, 0.0, 1.0]), 2.0 * np.pi * k / COPIES) for k in range(1, COPIES)
        ]
        turned = np.concatenate([places @ turn.T for turn in turns]) + centre
        facing = np.concatenate([normals @ turn.T for turn in turns])
        free = cKDTree(samples.points).query(turned)[0] > APART
        return turned[free], facing[free]


def find_revolution(samples: ContactSamples, seed: int = 0) -> Revolution | None:
    """The vertical axis that normals and places agree on; None where they do not, or where they are too few.

    Args:
        samples: of all contacts.
        seed: which places are looked at where there are more than a search in a tenth of a second takes.
    """
    side = np.flatnonzero(np.linalg.norm(samples.normals[:, :2], axis=1) > _HORIZONTAL)
    some = np.random.default_rng(seed).permutation(side)[:_MOST]
    if len(some) < limits.MIN_PAIRED:
        return None
    centre = _best_centre(samples.of(np.sort(some)))
    upright = samples.of(side)
    radial = _aside(upright, centre) < limits.MAX_AXIS_SINE
    pairs = zip(*_profile_errors(upright, centre), strict=True)
    # The median of how far each place is off its partners' profile, m; infinite without a partner.
    off = np.array([float(np.median(far[each])) if each.any() else np.inf for each, far in pairs])
    paired = np.isfinite(off)
    if (
        paired.sum() < limits.MIN_PAIRED
        or len(np.unique(upright.touches[paired])) < limits.MIN_PAIRED_TOUCHES
    ):
        return None
    weight = np.linalg.norm(upright.normals[:, :2], axis=1)
    share = float(weight[radial].sum() / weight.sum())
    agreeing = float((radial & (off < limits.MAX_PROFILE_ERROR))[paired].mean())
    of_body = np.ones(len(samples.points), dtype=bool)
    of_body[side] = radial & ~(off >= limits.MAX_PROFILE_ERROR)
    out = upright.points[radial, :2] - centre
    angles = np.sort(np.arctan2(out[:, 1], out[:, 0]))
    gap = float(np.diff(angles, append=angles[:1] + 2.0 * np.pi).max(initial=0.0))
    believed = share >= limits.MIN_RADIAL and agreeing >= limits.MIN_AGREEING and gap <= limits.MAX_OPEN_ANGLE
    return Revolution(centre, of_body) if believed else None


def _best_centre(side: ContactSamples) -> FloatArray:
    """``(2,)`` m: the least cost, from the first few places that the normals alone point at."""
    low, high = side.points[:, :2].min(axis=0) - _MARGIN, side.points[:, :2].max(axis=0) + _MARGIN
    axes = (np.arange(low[k], high[k], _STEPS[0]) for k in (0, 1))
    grid = np.stack(np.meshgrid(*axes), axis=-1).reshape(-1, 2)
    costs = np.array([_normals_cost(side, centre) for centre in grid])
    chosen: list[int] = []  # the lowest, none next to another
    for k in np.argsort(costs):
        if len(chosen) == _FIRST:
            break
        if all(np.abs(grid[k] - grid[other]).max() > 1.5 * _STEPS[0] for other in chosen):
            chosen.append(int(k))
    found = []
    for centre in grid[chosen]:
        for step in _STEPS[1:]:
            steps = step * np.arange(-3, 4)
            tried = centre + np.stack(np.meshgrid(steps, steps), axis=-1).reshape(-1, 2)
            centre = tried[int(np.argmin([_cost(side, each) for each in tried]))]
        found.append(centre)
    return min(found, key=lambda centre: _cost(side, centre))


def _cost(side: ContactSamples, centre: FloatArray) -> float:
    partners, off = _profile_errors(side, centre)
    count = partners.sum(axis=1)
    lost = np.where(partners, np.minimum(off / _OFF_LOSS, 1.0) ** 2, 0.0).sum(axis=1)
    each = np.where(count > 0, lost / np.maximum(count, 1), _UNKNOWN)
    return _normals_cost(side, centre) + float(each.sum())


def _normals_cost(side: ContactSamples, centre: FloatArray) -> float:
    horizontal = np.linalg.norm(side.normals[:, :2], axis=1)
    return float((horizontal * np.minimum(_aside(side, centre) / limits.MAX_AXIS_SINE, 1.0) ** 2).sum())


def _aside(side: ContactSamples, centre: FloatArray) -> FloatArray:
    """``(n,)`` sines of the angles between normals, seen from above, and the way out of the axis."""
    out, normals = side.points[:, :2] - centre, side.normals[:, :2]
    cross = np.abs(normals[:, 1] * out[:, 0] - normals[:, 0] * out[:, 1])
    lengths = np.linalg.norm(out, axis=1) * np.linalg.norm(normals, axis=1)
    return np.asarray(cross / np.maximum(lengths, 1e-9))


def _profile_errors(side: ContactSamples, centre: FloatArray) -> tuple[BoolArray, FloatArray]:
    """``(n, n)`` which places are partners, and ``(n, n)`` m how far each is off the other's profile.

    A chord of a profile is at right angles to the mean of its ends' normals where its curvature is even.
    """
    out = side.points[:, :2] - centre
    radius = np.linalg.norm(out, axis=1)
    outward = (side.normals[:, :2] * out).sum(axis=1) / np.maximum(radius, 1e-9)
    places = np.column_stack([radius, side.points[:, 2]])
    facing = np.column_stack([outward, side.normals[:, 2]])
    facing /= np.maximum(np.linalg.norm(facing, axis=1), 1e-9)[:, None]
    chords, mean = places[None] - places[:, None], facing[None] + facing[:, None]
    partners = (np.abs(chords[..., 1]) < _HEIGHT) | (np.hypot(chords[..., 0], chords[..., 1]) < _NEAR)
    partners &= (side.touches[:, None] != side.touches[None]) & (facing @ facing.T > _ALIKE)
    partners &= np.linalg.norm(side.points[:, None, :2] - side.points[None, :, :2], axis=2) > _AROUND
    off = np.abs((chords * mean).sum(axis=2)) / np.maximum(np.linalg.norm(mean, axis=2), 1e-9)
    return partners, off


SLACK = 4.0e-3
"""Depth in rotated free space that the body may seem to have, m: errors of the axis and of its roundness."""

BELOW = 15.0e-3
"""Depth below the highest contact from which on a touch entered the body or passed its upper part, m."""

PITCH, ANGLES = 4.0e-3, 24
_DOWNWARD = 0.8
_ROOM_MARGIN = 20.0e-3


@dataclass(frozen=True, eq=False)
class RotatedSpace:
    """Free space about an axis, by distance from it and height."""

    centre: FloatArray  #: ``(2,)`` m, of the axis in ``stand``.
    depth: FloatArray
    """``(radii, heights)`` m, ``PITCH`` apart from zero, that a place is deep in it; below 0 beside."""

    def at(self, points: FloatArray) -> FloatArray:
        """``(n,)`` m that ``(n, 3)`` m are deep in it; below 0 beside it."""
        radius = np.linalg.norm(points[:, :2] - self.centre, axis=1)
        at = np.stack([radius, points[:, 2]]) / PITCH
        return np.asarray(ndimage.map_coordinates(self.depth, at, order=1, mode="nearest"))


def rotated_space(axis: Revolution, samples: ContactSamples, evidence: ShapeEvidence) -> RotatedSpace | None:
    """The union of what all downward touches cleared, those that met nothing too; None where none went down.

    A touch whose room, turned, would hold a place that was met says that the body is not round there, and
    is left out: it came down beside a handle, or on one.
    """
    top = float(samples.points[:, 2].max())
    out = np.linalg.norm(samples.points[:, :2] - axis.centre, axis=1).max()
    radii = np.arange(0.0, out + _ROOM_MARGIN, PITCH)
    heights = np.arange(0.0, samples.points[:, 2].max() + _ROOM_MARGIN, PITCH)
    angles = 2.0 * np.pi * np.arange(ANGLES) / ANGLES
    r, z, turn = np.meshgrid(radii, heights, angles, indexing="ij")
    places = np.stack([axis.centre[0] + r * np.cos(turn), axis.centre[1] + r * np.sin(turn), z], axis=-1)
    found = None
    for touch in evidence.touches:
        if touch.stand_from_gel[2, 2] < -_DOWNWARD and touch.stand_from_gel[2, 3] < top - BELOW:
            deep = sensor_depth(replace(evidence, touches=(touch,)), places.reshape(-1, 3))
            room = RotatedSpace(axis.centre, np.asarray(deep.reshape(r.shape).max(axis=2)))
            if room.at(samples.points).max() <= SLACK:
                found = room if found is None else replace(found, depth=np.maximum(found.depth, room.depth))
    return found
