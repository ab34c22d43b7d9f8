"""What one picture by a calibrated camera says of the size of a known object."""

import time
from dataclasses import dataclass

import numpy as np
from scipy.interpolate import PchipInterpolator

from experiments.scale_estimation.size import Belief, SizeRange, add_unevenness
from experiments.scale_estimation.vision.fit import (
    ALIKE,
    PIXEL_SIGMA,
    UNKNOWNS,
    OutlineFit,
    OutlineProblem,
    View,
)
from harness.basics.arrays import FloatArray
from harness.basics.errors import FitRefused
from harness.picture.outline import DIRECTIONS, SeenOutline

MISFIT = 0.9
"""Pixels rms between the outlines beyond which the picture is not of this object."""

MISFIT_COST = 0.5 * DIRECTIONS * (MISFIT / PIXEL_SIGMA) ** 2 / ALIKE
"""What such a misfit costs, all else as stated. A fit that costs more, far from what is stated, is not of
this object either: tilted by ten standard deviations, a wrench has the outline of a mug."""

NO_SIZE = 0.3
"""Deviation of the size's logarithm beyond which a picture says nothing of it."""

_FIRST_ROUNDS = 4
_FOLLOWED = 4
_ROUNDS = 8
_SCAN = np.linspace(-5.0, 5.0, 21)
_SCAN_ROUNDS = 4
_FAR = 20.0
_MOST_MODES = 4
_FIRST_TURNS = 12
"""Rotations about the vertical from which the fit of the size starts."""

_TURNS = 24
_ROUNDS_OF_TURNS = 12
_TURNS_APART = 0.1


@dataclass(frozen=True, eq=False)
class Sight:
    """The answer by sight."""

    belief: Belief  #: over the size.
    fit: OutlineFit  #: the best.
    seconds: float  #: s of the estimate.


def by_sight(view: View, outline: SeenOutline, nominal: float, sizes: SizeRange) -> Sight:
    """The size at which the model's outline is that of the picture.

    Args:
        view: camera and object.
        outline: of the picture.
        nominal: m, the longest side of the model.
        sizes: asked about.

    Raises:
        FitRefused: at no size and turn is it this object's outline.
    """
    began = time.perf_counter()
    problem = OutlineProblem(view, outline)
    begun = sorted(problem.fit(_starts(view, outline, _FIRST_TURNS), _FIRST_ROUNDS), key=lambda fit: fit.cost)
    fits = problem.fit(np.array([fit.unknowns for fit in begun[:_FOLLOWED]]), _ROUNDS)
    best = min(fits, key=lambda fit: fit.cost)
    _require_same(view, best)
    log_nominal = np.log(nominal)
    density = np.full(len(sizes.logs), -np.inf)
    separate: list[OutlineFit] = []  # minima to scan, one per position and rotation
    for fit in sorted(fits, key=lambda fit: fit.cost):
        new = all(abs(fit.unknowns[0] - one.unknowns[0]) > 2e-3 for one in separate)
        if fit.cost < best.cost + _FAR and new and len(separate) < _MOST_MODES:
            separate.append(fit)
            density = np.logaddexp(density, _scanned(problem, fit, sizes.logs - log_nominal))
    return Sight(add_unevenness(Belief.of(sizes, density)), best, time.perf_counter() - began)


def _require_same(view: View, best: OutlineFit) -> None:
    """Refuse an outline that is another object's.

    Raises:
        FitRefused: at no size and turn, and with nothing far from what is stated, is it this object's.
    """
    if best.rms > MISFIT:
        raise FitRefused(
            f"the outline in the picture is {best.rms:.1f} px (rms) off this object's at any size and turn "
            f"(limit {MISFIT:g} px); check that it is this object, upright, with nothing in front of it"
        )
    if best.cost > MISFIT_COST:
        off = np.where(np.isinf(view.sigmas), 0.0, np.abs(best.unknowns) / view.sigmas)
        worst = int(off.argmax())
        raise FitRefused(
            f"the outline in the picture is this object's only if {UNKNOWNS[worst]} were {off[worst]:.0f} "
            "standard deviations off what is stated; check that it is this object, upright, and that the "
            "camera is where the station states"
        )


@dataclass(frozen=True, eq=False)
class SeenStand:
    """How the object may stand, by a look."""

    unknowns: FloatArray  #: ``(4,)`` log of the size over the nominal one, x, y, m, yaw, rad.
    farthest: FloatArray
    """``(2,)`` m along x and y: one standard deviation of its place the way it is known worst, the line of
    sight."""

    @property
    def place_error(self) -> float:
        """M, the length of ``farthest``."""
        return float(np.linalg.norm(self.farthest))


def stands_seen(view: View, outline: SeenOutline) -> tuple[SeenStand, ...]:
    """How the object may stand: every turn at which its outline is nearly that of the picture.

    A picture does not tell some turns apart, as those of a mug whose handle is behind it. What moves around
    the object keeps clear of all of them.

    Args:
        view: camera and object.
        outline: of the picture.

    Returns:
        The best first; none at all where the outline is not this object's.
    """
    problem = OutlineProblem(view, outline)
    fits = problem.fit(_starts(view, outline, _TURNS), _ROUNDS_OF_TURNS)
    found: list[OutlineFit] = []
    for fit in sorted(fits, key=lambda one: one.cost):
        turns = [(fit.unknowns[3] - one.unknowns[3] + np.pi) % (2.0 * np.pi) - np.pi for one in found]
        same = fit.rms <= MISFIT and fit.cost <= MISFIT_COST
        if same and all(abs(turn) > _TURNS_APART for turn in turns):
            found.append(fit)
    return tuple(_stand(problem, fit) for fit in found)


def _stand(problem: OutlineProblem, fit: OutlineFit) -> SeenStand:
    variances, axes = np.linalg.eigh(problem.covariance(fit.unknowns)[1:3, 1:3])
    return SeenStand(fit.unknowns[:4], np.sqrt(variances[-1]) * axes[:, -1])


def _starts(view: View, outline: SeenOutline, yaws: int) -> FloatArray:
    """``(yaws, 14)``: as large as the picture's outline is, and where it is."""
    starts = np.zeros((yaws, len(view.sigmas)))
    starts[:, 3] = np.arange(yaws) * 2.0 * np.pi / yaws
    half = len(outline.extents) // 2
    widths = outline.extents[:half] + outline.extents[half:]
    for _ in range(3):
        places = view.project(starts, view.corners)
        low, high = places.min(axis=1), places.max(axis=1)
        seen = 0.5 * ((high - low)[:, 0] / widths[0] + (high - low)[:, 1] / widths[half // 2])
        starts[:, 0] -= np.log(np.maximum(seen, 1e-3))
    return starts


def _scanned(problem: OutlineProblem, fit: OutlineFit, logs: FloatArray) -> FloatArray:
    """``(n,)`` minus the least cost at each logarithm of the size over the nominal one."""
    covariance = problem.covariance(fit.unknowns)
    middle, sigma = float(fit.unknowns[0]), min(float(np.sqrt(covariance[0, 0])), NO_SIZE)
    # The other unknowns go with the size as they do to first order, and are refined from there.
    along = covariance[0] / covariance[0, 0]
    starts = fit.unknowns + sigma * _SCAN[:, None] * along
    costs = np.array([one.cost for one in problem.fit(starts, _SCAN_ROUNDS, fixed_size=True)])
    away = (logs - middle) / sigma
    within = PchipInterpolator(_SCAN, costs)(np.clip(away, _SCAN[0], _SCAN[-1]))
    beyond = np.maximum(np.abs(away) - _SCAN[-1], 0.0)
    return np.asarray(-within - _SCAN[-1] * beyond)
