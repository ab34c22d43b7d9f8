"""What contacts with their poses say of the size of a known object."""

import time
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.interpolate import PchipInterpolator

from experiments.scale_estimation.size import Belief, SizeRange
from experiments.scale_estimation.touch.fit import Stand, TouchProblem
from experiments.scale_estimation.touch.patch import Patch
from harness.basics.arrays import FloatArray
from harness.basics.errors import FitRefused

MISFIT = 5.0
"""Cost a contact beyond which the contacts are not of this object."""

_COARSE = 0.06
"""Of the size's logarithm, between the sizes of the first scan."""

_YAWS = 16
_COARSE_POINTS = 3
_FINE = np.linspace(-4.0, 4.0, 17)
_FAR = 12.0


@dataclass(frozen=True, eq=False)
class Touch:
    """The answer by touch.

    Attributes:
        belief: over the size.
        unknowns: ``(5,)`` the best: log of the size over the nominal one, x, y, m, yaw, rad, height, m, off.
        cost: of a contact, at the best.
        seconds: s of the estimate.
    """

    belief: Belief
    unknowns: FloatArray
    cost: float
    seconds: float


def by_touch(
    stand: Stand, patches: Sequence[Patch], nominal: float, sizes: SizeRange, refined: int = 12
) -> Touch:
    """The sizes at which the contacts lie on the model's surface.

    Args:
        stand: the model.
        patches: of the contacts; one or more.
        nominal: m, the longest side of the model.
        sizes: asked about.
        refined: of the best hypotheses of the first scan that are followed to their minima.

    Raises:
        FitRefused: at no size and place do the contacts lie on this object.
    """
    began = time.perf_counter()
    logs = sizes.logs - np.log(nominal)
    coarse = np.linspace(logs[0], logs[-1], int(np.ceil((logs[-1] - logs[0]) / _COARSE)) + 1)
    rough = TouchProblem(stand, patches, _COARSE_POINTS)
    starts = np.zeros((len(coarse) * _YAWS, 5))
    starts[:, 0] = np.repeat(coarse, _YAWS)
    starts[:, 3] = np.tile(np.arange(_YAWS) * 2.0 * np.pi / _YAWS, len(coarse))
    found, costs = rough.refined(starts, 3, fixed_size=True)
    fine = TouchProblem(stand, patches, len(patches[0].points))
    order = np.argsort(costs)[:refined]
    minima, least = fine.refined(found[order], 8, fixed_size=False)
    best = int(least.argmin())
    if least[best] / len(patches) > MISFIT:
        raise FitRefused(
            "the contacts are off this object's surface at any size and turn: "
            f"{least[best] / len(patches):.1f} a contact (limit {MISFIT:g}); check that it is this object, "
            "and that it stands upright where the scene says"
        )
    scan = [np.column_stack([coarse, costs.reshape(len(coarse), _YAWS).min(axis=1)])]
    for k in _apart(minima, least):
        scan.append(_scanned(fine, minima[k]))
    density = -_least_of(np.vstack(scan), logs)
    belief = Belief.of(sizes, density)
    return Touch(belief, minima[best], float(least[best] / len(patches)), time.perf_counter() - began)


def _apart(minima: FloatArray, least: FloatArray) -> list[int]:
    kept: list[int] = []
    for k in np.argsort(least):
        if least[k] > least.min() + _FAR or len(kept) == 6:
            break
        if all(abs(minima[k, 0] - minima[j, 0]) > 5e-3 for j in kept):
            kept.append(int(k))
    return kept


def _scanned(problem: TouchProblem, minimum: FloatArray) -> FloatArray:
    """``(n, 2)`` logarithms of sizes about a minimum, and the least cost there."""
    sigma = min(problem.sigma(minimum), 0.25)
    starts = np.tile(minimum, (len(_FINE), 1))
    starts[:, 0] += sigma * _FINE
    _, costs = problem.refined(starts, 6, fixed_size=True)
    return np.column_stack([starts[:, 0], costs])


def _least_of(scan: FloatArray, logs: FloatArray) -> FloatArray:
    """``(n,)`` the least cost at each logarithm: the scan's lower envelope, monotone between its points."""
    at, costs = scan[np.argsort(scan[:, 0])].T
    at, first = np.unique(at, return_index=True)
    return np.asarray(PchipInterpolator(at, costs[first])(logs))
