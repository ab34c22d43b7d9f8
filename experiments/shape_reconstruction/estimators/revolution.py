"""Whether contacts are those of a body turned about the vertical, and where else it then has its surface."""

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from experiments.shape_reconstruction.estimators.contact_samples import ContactSamples
from harness.basics.arrays import BoolArray, FloatArray
from harness.basics.geometry import rotation_about

ON_AXIS = 5.0e-3
"""M between a normal's line and the axis, within which a place counts as of the turned body."""

SHARE = 0.65
"""Of the horizontal parts of all normals, that must meet the axis."""

AGREEING = 15
"""Places that must have another touch's at their height, facing alike, ..."""

OFF = 2.5e-3
"""M, ... and the median by which their distances from the axis differ then, at most."""

COPIES = 16
"""Of each place, around the axis."""

APART = 12.0e-3
"""M from any contact, within which the contact knows better."""

_HORIZONTAL = 0.25
_PAIRS = 200
_ROUNDS = 10
_LOSS = 3.0e-3
_HEIGHT, _ALIKE = 6.0e-3, 0.35


@dataclass(frozen=True, eq=False)
class Revolution:
    """An axis that contacts agree on.

    Attributes:
        centre: ``(2,)`` m, x and y of the axis in ``stand``.
        share: of the horizontal parts of the normals that meet it.
        of_body: ``(n,)`` which samples do: the others are a handle's, or whatever else stands out.
    """

    centre: FloatArray
    share: float
    of_body: BoolArray

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
    """The vertical axis that the normals point at, if their places agree on it; None where they do not."""
    horizontal = np.linalg.norm(samples.normals[:, :2], axis=1)
    weight = np.where(horizontal > _HORIZONTAL, horizontal, 0.0)
    across = np.column_stack([-samples.normals[:, 1], samples.normals[:, 0]])
    across /= np.maximum(horizontal, 1e-9)[:, None]
    reach = np.einsum("ij,ij->i", across, samples.points[:, :2])
    centre = _first_centre(across, reach, weight, np.random.default_rng(seed))
    if centre is None:
        return None
    for _ in range(_ROUNDS):
        each = weight / (1.0 + ((across @ centre - reach) / _LOSS) ** 2)
        weighted = across * each[:, None]
        centre = np.linalg.solve(weighted.T @ across + 1e-9 * np.eye(2), weighted.T @ reach)
    near = np.abs(across @ centre - reach) < ON_AXIS
    share = float((weight * near).sum() / weight.sum())
    found = Revolution(centre, share, near | (weight == 0.0))
    agreeing, off = _agreement(samples, found)
    return found if share >= SHARE and agreeing >= AGREEING and off <= OFF else None


def _first_centre(
    across: FloatArray, reach: FloatArray, weight: FloatArray, random: np.random.Generator
) -> FloatArray | None:
    """Of the crossings of pairs of lines, that which most lines pass."""
    lines = np.nonzero(weight > 0.0)[0]
    best, centre = -1.0, None
    for _ in range(_PAIRS if len(lines) > 1 else 0):
        pair = random.choice(lines, 2, replace=False)
        if abs(np.linalg.det(across[pair])) < 0.3:
            continue
        tried = np.linalg.solve(across[pair], reach[pair])
        score = float(weight[np.abs(across @ tried - reach) < ON_AXIS].sum())
        if score > best:
            best, centre = score, tried
    return centre


def _agreement(samples: ContactSamples, found: Revolution) -> tuple[int, float]:
    """How many places have another touch's at their height that faces alike, and their median difference."""
    from_axis = samples.points[:, :2] - found.centre
    radius = np.linalg.norm(from_axis, axis=1)
    outward = np.einsum("ij,ij->i", samples.normals[:, :2], from_axis) / np.maximum(radius, 1e-6)
    height = samples.points[:, 2]
    differ = []
    for i in np.nonzero(found.of_body)[0]:
        other = found.of_body & (samples.touches != samples.touches[i])
        other &= (np.abs(height - height[i]) < _HEIGHT) & (np.abs(outward - outward[i]) < _ALIKE)
        if other.any():
            differ.append(float(np.median(np.abs(radius[other] - radius[i]))))
    return len(differ), float(np.median(differ)) if differ else np.inf
