"""What contacts with their poses say of the size of a known object."""

import time
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.interpolate import PchipInterpolator

from experiments.scale_estimation.size import Belief, SizeRange, add_unevenness
from experiments.scale_estimation.touch.fit import (
    UNKNOWNS,
    FreeSpace,
    Patch,
    Stand,
    TouchProblem,
    distinct_paths,
)
from harness.basics.arrays import FloatArray
from harness.basics.errors import FitRefused

CHANCE = 0.5
"""Of a contact: that it lies on the object at a wrong size too, where there are many places to be."""

MISFIT = 3.5
"""Cost a contact beyond which the contacts are not of this object."""

DOUBTED = 0.7
"""Cost a contact beyond which they may be another object's: the right one's was 0.05 to 0.53 in 23 of 24
runs, and 0.9 to 3.4 where contacts with another were not refused."""

DOUBTED_PLACES = 10
"""Places touched for which that limit holds. The mean cost of fewer contacts varies more: one contact on a
rim, whose normal is uncertain, costs up to 1.5 alone."""

MIN_JUDGED_PLACES = 4
"""Places touched below which a misfit is no sign of another object: two or three contacts with the right
object cost more than the limit in every second run."""

STRANGER = 0.5
"""Probability that they are, then: the size may be any."""

_COARSE = 0.2
"""Of the size's logarithm, between the sizes of the first search; its steps lead from one to the next."""

_PROFILED = 0.06
"""Of the same, between the sizes at which the cost is known."""

_OUT = 1.5
"""Deviations of the place, between the places of the first search."""

_YAWS = 16
"""Turns of a round object that the first search begins from; more of a slender one."""

_SLENDER = 3.0
_FOLLOWED = 2
"""Stands of the first search that each size is followed from."""

CHEAP = 4
"""Refined starts up to which the first search begins at two places of the object alone, and each size is
followed from one stand of it."""

_LIKELY = 12
_FINE_POINTS = 6
_COARSE_POINTS = 1
_SLACK = 0.5
"""Of the nearest sample's distance, in the first search and at sizes all over the range: such searches take a
quarter of the time of exact ones, and what is near the best sizes is found exactly."""

_FINE = np.linspace(-4.0, 4.0, 17)
_FAR = 12.0


@dataclass(frozen=True, eq=False)
class Touch:
    """The answer by touch."""

    belief: Belief  #: over the size.
    unknowns: FloatArray  #: ``(UNKNOWNS,)`` the best.
    cost: float  #: of a contact, at the best.
    seconds: float  #: s of the estimate.
    places: int = DOUBTED_PLACES  #: number of different places that were touched.

    @property
    def is_doubted(self) -> bool:
        """True where the contacts are a sign of another object."""
        return self.places >= MIN_JUDGED_PLACES and self.cost > doubted_cost(self.places)


def doubted_cost(places: int) -> float:
    """Compute the mean cost of a contact above which the contacts may be of another object.

    Args:
        places: number of different places that were touched.
    """
    return DOUBTED * max(1.0, float(np.sqrt(DOUBTED_PLACES / places)))


def by_touch(
    stand: Stand,
    patches: Sequence[Patch],
    nominal: float,
    sizes: SizeRange,
    refined: int = 12,
    free: Sequence[FloatArray] = (),
) -> Touch:
    """Compute the density of the sizes at which the contacts lie on the model's surface.

    Contacts at one place count once, and so do paths to one place.

    Args:
        stand: the model.
        patches: of the contacts.
        nominal: m, the longest side of the model.
        sizes: asked about.
        refined: of the best hypotheses of the first scan that are followed to their minima.
        free: ``(n, 3)`` m in base each, places along the ways that the gel has passed.

    Raises:
        FitRefused: there is no contact, or at no size and place do they lie on this object.
    """
    if not patches:
        raise FitRefused("the gel touched nothing yet; touch the object")
    began = time.perf_counter()
    logs = sizes.logs - np.log(nominal)
    passed = FreeSpace(stand, distinct_paths(free, stand.errors.same_place))
    found, costs = TouchProblem(stand, patches, _COARSE_POINTS, _SLACK).refined(
        _starts(stand, patches, logs, refined > CHEAP), 5, fixed_size=False
    )
    likely = found[np.argsort(costs)[: max(refined, _LIKELY)]]
    fine = TouchProblem(stand, patches, _FINE_POINTS)
    minima, misfits = fine.refined(likely[:refined], 8, fixed_size=False)
    least = misfits + passed.cost(minima)
    best = int(least.argmin())
    cost = float(misfits[best] / fine.places)
    if cost > MISFIT:
        raise FitRefused(
            "the contacts are off this object's surface at any size and turn: "
            f"{cost:.1f} a contact (limit {MISFIT:g}); check that it is this object, "
            "and that it stands upright where the scene says"
        )
    apart = _apart(minima, least)
    rough = TouchProblem(stand, patches, _FINE_POINTS, _SLACK)
    followed = _FOLLOWED if refined > CHEAP else 1
    scan = [_profile(rough, passed, found, costs, minima[apart[:followed]], logs, followed)]
    for k in apart:
        # Sizes around the minimum, and the minimum cost at each with the other parameters.
        starts = np.tile(minima[k], (len(_FINE), 1))
        starts[:, 0] += min(fine.sigma(minima[k]), 0.25) * _FINE
        _, fine_costs = fine.refined(starts, 6, fixed_size=True)
        scan.append(np.column_stack([starts[:, 0], fine_costs + float(least[k] - misfits[k])]))
    rows = np.vstack(scan)
    at, costs_at = rows[np.argsort(rows[:, 0])].T
    at, first = np.unique(at, return_index=True)
    # The least cost at each size: monotone between the places of the scan.
    lowest = np.asarray(PchipInterpolator(at, costs_at[first])(logs))
    belief = add_unevenness(Belief.of(sizes, -lowest))
    belief = belief.doubted(max(CHANCE ** (fine.places - 1), STRANGER if cost > DOUBTED else 0.0))
    return Touch(belief, minima[best], cost, time.perf_counter() - began, fine.places)


def _starts(stand: Stand, patches: Sequence[Patch], logs: FloatArray, everywhere: bool) -> FloatArray:
    """``(n, UNKNOWNS)`` sizes, places and turns, all with all, that the first search begins from."""
    sizes = np.arange(logs[0], logs[-1] + _COARSE, _COARSE)
    across = np.linalg.svd(stand.points[:, :2] - stand.points[:, :2].mean(axis=0), compute_uv=False)
    count = round(_YAWS * min(across[0] / across[1], _SLENDER))
    turns = np.arange(count) * 2.0 * np.pi / count
    out = stand.errors.place * np.array([0.0, _OUT, -_OUT])
    ends = np.concatenate([patch.points for patch in patches])[:, :2] - stand.place[:2]
    # The middle of contacts all over an object is near its own.
    places = np.array([0.5 * (ends.min(axis=0) + ends.max(axis=0)), *((x, y) for x in out for y in out)])
    places = places if everywhere else places[:2]
    size, place, yaw = (grid.ravel() for grid in np.meshgrid(sizes, np.arange(len(places)), turns))
    starts = np.zeros((len(size), UNKNOWNS))
    starts[:, :4] = np.column_stack([size, places[place.astype(int)], yaw])
    return starts


def _profile(
    problem: TouchProblem,
    passed: FreeSpace,
    found: FloatArray,
    costs: FloatArray,
    minima: FloatArray,
    logs: FloatArray,
    followed: int,
) -> FloatArray:
    """``(n, 2)`` logarithms of sizes all over, and the least cost that was found at each.

    Every size is followed alike, from as many stands that the first search found nearest to it and from as
    many of the best minima: one that was not would look worse than it is beside one that was.
    """
    sizes = np.linspace(logs[0], logs[-1], int(np.ceil((logs[-1] - logs[0]) / _PROFILED)) + 1)
    away = costs + 0.5 * ((sizes[:, None] - found[:, 0]) / _COARSE) ** 2
    near = found[np.argpartition(away, followed, axis=1)[:, :followed]]
    best = np.broadcast_to(minima, (len(sizes), *minima.shape))
    starts = np.concatenate([near, best], axis=1)
    starts[..., 0] = sizes[:, None]
    there, least = problem.refined(starts.reshape(-1, UNKNOWNS), 5, fixed_size=True)
    least = (least + passed.cost(there)).reshape(len(sizes), -1)
    return np.column_stack([sizes, least.min(axis=1)])


def _apart(minima: FloatArray, least: FloatArray) -> list[int]:
    kept: list[int] = []
    for k in np.argsort(least):
        if least[k] > least.min() + _FAR or len(kept) == 6:
            break
        if all(abs(minima[k, 0] - minima[j, 0]) > 5e-3 for j in kept):
            kept.append(int(k))
    return kept
