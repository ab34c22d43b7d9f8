"""What the hypotheses say of one contact: where, how surely, and where else."""

from dataclasses import dataclass

import numpy as np

from harness.basics.arrays import BoolArray, FloatArray, read_only
from harness.sim.solid.surface_samples import Surface

_GROSS = 20.0e-3


_MODE_RADIUS = 12.0e-3


_SMALLEST_MODE = 0.05


_MOST_POINTS = 400


_MOST_IN_REGION = 4000


_CORE = 6.0e-3


_SETTLING = 8


_GOLDEN = 0.6180339887498949


@dataclass(frozen=True, eq=False)
class Mode:
    """One place the contact may be."""

    position: FloatArray  #: ``(3,)`` metres, mean of the mode, in the object's frame.
    weight: float  #: its share of the posterior.
    covariance: FloatArray  #: ``(3, 3)`` square metres.


@dataclass(frozen=True, eq=False)
class Region:
    """The surface samples that hold a stated share of the posterior, most probable first."""

    share: float  #: of the posterior.
    points: FloatArray  #: ``(n, 3)`` metres: the samples inside.
    area: float  #: square metres that they stand for.
    surface: Surface  #: the samples that it was chosen from.
    inside: BoolArray  #: ``(samples,)`` whether each belongs.

    def contains(self, point_in_object: FloatArray) -> bool:
        """Whether the sample nearest to a ``(3,)`` point of the surface belongs."""
        gaps = np.sum((self.surface.points - point_in_object) ** 2, axis=1)
        # On a wall thinner than the spacing both faces' samples are as near as each other.
        nearest = gaps <= (np.sqrt(gaps.min()) + 0.5 * self.surface.spacing) ** 2
        return bool(np.any(self.inside[nearest]))


def best_point(points: FloatArray, weights: FloatArray) -> FloatArray:
    """``(3,)``: about the candidate with the least expected error, errors beyond 20 mm counting alike.

    So capped, the answer stays inside the heaviest mode instead of falling between modes. Within
    that mode it is the mean, which hangs on no single draw; it lies a hair off the surface.
    """
    few, their_weights = thinned(points, weights)
    gaps = np.linalg.norm(few[:, None] - few[None], axis=2)
    expected = np.minimum(gaps, _GROSS) @ their_weights
    return settled(points, weights, few[int(np.argmin(expected))])


def settled(points: FloatArray, weights: FloatArray, start: FloatArray) -> FloatArray:
    """``(3,)``: the mean of what lies within 6 mm of itself, found from ``start``."""
    centre = start
    for _ in range(_SETTLING):
        near = weights * (np.linalg.norm(points - centre, axis=1) < _CORE)
        if near.sum() == 0.0:
            return start
        centre = near @ points / near.sum()
    return np.asarray(centre)


def thinned(
    points: FloatArray, weights: FloatArray, most: int = _MOST_POINTS
) -> tuple[FloatArray, FloatArray]:
    """At most so many points standing for all, each weight drawn evenly.

    One draw falls in each equal part of the weight, at a place in it that differs from one to the
    next, so that an order with a rhythm of its own does not favour some points.
    """
    if len(points) <= most:
        return points, weights / weights.sum()
    numbers = np.arange(most)
    marks = (numbers + np.mod((numbers + 0.5) * _GOLDEN, 1.0)) / most
    chosen = np.minimum(np.searchsorted(np.cumsum(weights / weights.sum()), marks), len(points) - 1)
    unique, counts = np.unique(chosen, return_counts=True)
    return points[unique], counts / most


def modes(points: FloatArray, weights: FloatArray) -> tuple[Mode, ...]:
    """Places that hold at least 5 % of the posterior, heaviest first.

    A mode is everything within 12 mm of the densest place left, until little is left.
    """
    points, weights = thinned(points, weights)
    left = weights.copy()
    gaps = np.linalg.norm(points[:, None] - points[None], axis=2)
    found = []
    while left.sum() >= _SMALLEST_MODE:
        peak = int(np.argmax(np.exp(-0.5 * (gaps / (0.25 * _MODE_RADIUS)) ** 2) @ left))
        members = (gaps[peak] < _MODE_RADIUS) & (left > 0.0)
        if not members.any():
            break
        weight = float(left[members].sum())
        if weight >= _SMALLEST_MODE:
            shares = left[members] / weight
            mean = shares @ points[members]
            centred = points[members] - mean
            covariance = (centred * shares[:, None]).T @ centred
            found.append(Mode(read_only(mean), weight, read_only(covariance)))
        left[members] = 0.0
    return tuple(sorted(found, key=lambda mode: -mode.weight))


def credible_region(
    points: FloatArray, weights: FloatArray, surface: Surface, floor: float, share: float = 0.9
) -> Region:
    """The densest part of the surface that holds ``share`` of the posterior.

    Args:
        points: ``(n, 3)`` metres, the hypotheses' contacts.
        weights: ``(n,)``.
        surface: whose samples make the region.
        floor: metres, one sigma of the errors that all contacts of a run share and that the
            hypotheses therefore do not show; fitted to calibration runs.
        share: of the posterior.
    """
    # A posterior along a whole rim needs many points: each fills only a few square millimetres.
    points, weights = thinned(points, weights, _MOST_IN_REGION)
    # The points' weights, each shared by the samples around it as a Gaussian of the area.
    near = [np.asarray(found, dtype=np.int64) for found in surface.tree.query_ball_point(points, 4.0 * floor)]
    counts = np.array([len(found) for found in near])
    far = np.nonzero(counts == 0)[0]
    owners = np.concatenate([np.repeat(np.arange(len(points)), counts), far])
    samples = np.concatenate([*near, surface.tree.query(points[far])[1]]).astype(np.int64)
    gaps = np.sum((surface.points[samples] - points[owners]) ** 2, axis=1)
    kernel = surface.areas[samples] * np.exp(-0.5 * gaps / floor**2) + 1e-300
    whole = np.bincount(owners, kernel, minlength=len(points))
    shares = weights[owners] * kernel / whole[owners]
    mass = np.bincount(samples, shares, minlength=len(surface.points))
    density = mass / np.maximum(surface.areas, 1e-12)
    order = np.argsort(-density, kind="stable")
    count = int(np.searchsorted(np.cumsum(mass[order]), share * mass.sum())) + 1
    inside = np.zeros(len(mass), dtype=np.bool_)
    inside[order[:count]] = True
    area = float(surface.areas[inside].sum())
    return Region(share, read_only(surface.points[inside]), area, surface, read_only(inside))


def credible_radius(
    points: FloatArray, weights: FloatArray, position: FloatArray, floor: float, share: float = 0.9
) -> float:
    """Metres around ``position`` that hold ``share`` of the posterior, the floor included."""
    gaps = np.linalg.norm(points - position, axis=1)
    order = np.argsort(gaps, kind="stable")
    reached = np.cumsum(weights[order]) / weights.sum()
    within = float(gaps[order][min(int(np.searchsorted(reached, share)), len(gaps) - 1)])
    # 2.15 sigma holds 90 % of a Gaussian on a surface (Rayleigh).
    return float(np.hypot(within, floor * np.sqrt(-2.0 * np.log(1.0 - share))))
