"""What contacts with their poses say of the size of a known object."""

import time
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.interpolate import PchipInterpolator

from experiments.scale_estimation.size import Belief, SizeRange
from experiments.scale_estimation.touch.fit import UNKNOWNS, FreeSpace, Stand, TouchProblem
from experiments.scale_estimation.touch.patch import Patch
from harness.basics.arrays import FloatArray
from harness.basics.errors import FitRefused

CHANCE = 0.5
"""Of a contact: that it lies on the object at a wrong size too, where there are many places to be."""

MISFIT = 5.0
"""Cost a contact beyond which the contacts are not of this object."""

_COARSE = 0.06
"""Of the size's logarithm, between the sizes of the first scan."""

_YAWS = 16
_FOLLOWED = 2
"""Stands of each size that are followed with all points."""

_FEW = 4
"""Contacts up to which several places of the object are begun from."""

_COARSE_POINTS = 1
_FINE = np.linspace(-4.0, 4.0, 17)
_FAR = 12.0


@dataclass(frozen=True, eq=False)
class Touch:
    """The answer by touch.

    Attributes:
        belief: over the size.
        unknowns: ``(UNKNOWNS,)`` the best.
        cost: of a contact, at the best.
        seconds: s of the estimate.
    """

    belief: Belief
    unknowns: FloatArray
    cost: float
    seconds: float


def by_touch(
    stand: Stand,
    patches: Sequence[Patch],
    nominal: float,
    sizes: SizeRange,
    refined: int = 12,
    free: Sequence[FloatArray] = (),
) -> Touch:
    """The sizes at which the contacts lie on the model's surface.

    Args:
        stand: the model.
        patches: of the contacts; one or more.
        nominal: m, the longest side of the model.
        sizes: asked about.
        refined: of the best hypotheses of the first scan that are followed to their minima.
        free: ``(n, 3)`` m in base each, places along the ways that the gel has passed.

    Raises:
        FitRefused: at no size and place do the contacts lie on this object.
    """
    began = time.perf_counter()
    logs = sizes.logs - np.log(nominal)
    coarse = np.linspace(logs[0], logs[-1], int(np.ceil((logs[-1] - logs[0]) / _COARSE)) + 1)
    rough = TouchProblem(stand, patches, _COARSE_POINTS)
    stands = _stands(stand, len(patches))
    starts = np.tile(stands, (len(coarse), 1))
    starts[:, 0] = np.repeat(coarse, len(stands))
    found, costs = rough.refined(starts, 3, fixed_size=True)
    fine = TouchProblem(stand, patches, len(patches[0].points))
    # Every size is followed alike: one that was not would look worse than it is beside one that was.
    likely = np.argsort(costs.reshape(len(coarse), -1), axis=1)[:, :_FOLLOWED]
    kept = (np.arange(len(coarse))[:, None] * len(stands) + likely).ravel()
    passed = FreeSpace(stand, free)
    found, costs = fine.refined(found[kept], 5, fixed_size=True)
    costs = costs + passed.cost(found)
    order = np.argsort(costs)[:refined]
    minima, misfits = fine.refined(found[order], 8, fixed_size=False)
    least = misfits + passed.cost(minima)
    best = int(least.argmin())
    if misfits[best] / len(patches) > MISFIT:
        raise FitRefused(
            "the contacts are off this object's surface at any size and turn: "
            f"{misfits[best] / len(patches):.1f} a contact (limit {MISFIT:g}); check that it is this object, "
            "and that it stands upright where the scene says"
        )
    scan = [np.column_stack([coarse, costs.reshape(len(coarse), _FOLLOWED).min(axis=1)])]
    for k in _apart(minima, least):
        scan.append(_scanned(fine, minima[k], float(least[k] - misfits[k])))
    belief = Belief.of(sizes, -_least_of(np.vstack(scan), logs))
    belief = belief.doubted(CHANCE ** (len(patches) - 1))
    return Touch(belief, minima[best], float(misfits[best] / len(patches)), time.perf_counter() - began)


def _stands(stand: Stand, contacts: int) -> FloatArray:
    """``(n, UNKNOWNS)`` turns, and places where the contacts are too few to lead there, to begin from."""
    reach = (0.0, 1.0, -1.0) if contacts <= _FEW else (0.0,)
    places = stand.errors.place * np.array([(x, y) for x in reach for y in reach])
    starts = np.zeros((len(places) * _YAWS, UNKNOWNS))
    starts[:, 1:3] = np.repeat(places, _YAWS, axis=0)
    starts[:, 3] = np.tile(np.arange(_YAWS) * 2.0 * np.pi / _YAWS, len(places))
    return starts


def _apart(minima: FloatArray, least: FloatArray) -> list[int]:
    kept: list[int] = []
    for k in np.argsort(least):
        if least[k] > least.min() + _FAR or len(kept) == 6:
            break
        if all(abs(minima[k, 0] - minima[j, 0]) > 5e-3 for j in kept):
            kept.append(int(k))
    return kept


def _scanned(problem: TouchProblem, minimum: FloatArray, beside: float) -> FloatArray:
    """``(n, 2)`` logarithms of sizes about a minimum, and the least cost there, with what comes beside it."""
    sigma = min(problem.sigma(minimum), 0.25)
    starts = np.tile(minimum, (len(_FINE), 1))
    starts[:, 0] += sigma * _FINE
    _, costs = problem.refined(starts, 6, fixed_size=True)
    return np.column_stack([starts[:, 0], costs + beside])


def _least_of(scan: FloatArray, logs: FloatArray) -> FloatArray:
    """``(n,)`` the least cost at each logarithm: the scan's lower envelope, monotone between its points."""
    at, costs = scan[np.argsort(scan[:, 0])].T
    at, first = np.unique(at, return_index=True)
    return np.asarray(PchipInterpolator(at, costs[first])(logs))
