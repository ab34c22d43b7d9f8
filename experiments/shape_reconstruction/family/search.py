"""From draws of the prior to shapes that the readings allow: many are laid, some refined, few finished."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from experiments.shape_reconstruction.evidence import ShapeEvidence
from experiments.shape_reconstruction.family import layout
from experiments.shape_reconstruction.family.freedom import (
    OUTLINE_BIAS,
    NuisanceCost,
    basis_of,
    bench_rows,
    nuisance_cost,
    shape_rows,
    stand_basis,
    stand_rows,
)
from experiments.shape_reconstruction.family.kind import FamilyShape
from experiments.shape_reconstruction.family.kinds import (
    CLASSES,
    codes_of,
    draw_shape,
    kind_of,
    rarity,
    rarity_of_size,
)
from experiments.shape_reconstruction.family.observed import FamilyEvidence, observe
from experiments.shape_reconstruction.family.proposals import Guides, beside, changes, guides_of, lay
from experiments.shape_reconstruction.family.residuals import (
    Rows,
    active_rows,
    evaluate,
    prepared_room,
    rows_for,
    slopes_along,
)
from experiments.shape_reconstruction.family.settings import FamilySettings
from harness.basics.arrays import FloatArray, IntArray
from harness.basics.compiled import compiled

_Random = np.random.Generator

LAID = 0.6
"""Share of the draws of one code that is laid, those that fit best at their best turn."""

LAYING = ((1, 0.5), (1, 0.5), (2, 1.0))
"""Rounds in which draws find their place, turn and size; the share of each code that goes on after them."""

TEMPERATURE = 3.0
"""By which costs are divided where they become weights: readings near each other err together."""

BEGINNING = 3
"""Rounds after which the starts that fit worst are left."""

CHANGING = 5
"""Rounds in which a changed shape finds its numbers."""

LIKELY = 2
"""Changes of one code that are refined, of each shape: those that fit best as they were put on."""

HOPPED, HOPS = 2, 8
"""Hypotheses beside which others are looked for, and how many beside each in a round."""

ALIKE = 1.5e-3
"""M by which two shapes of one code differ at most to be one hypothesis."""


class PriorRows(NamedTuple):
    """A normal density about a vector."""

    middle: FloatArray  #: ``(SIZE,)``.
    rows: FloatArray  #: ``(k, SIZE)``: ``rows @ (theta - middle)`` are independent, of unit deviation.


@dataclass(frozen=True, eq=False)
class Hypothesis:
    """A shape that the readings may be of."""

    shape: FamilyShape  #: in the frame ``stand``.
    prior: PriorRows  #: that its numbers are refined under.
    cost: float
    """half the sum of squares of readings and prior, and the price of parts and sizes that are rare."""
    curvature: FloatArray
    """``(n, n)`` of the cost along its free numbers; empty until it is refined for the last time."""
    price: float = 0.0  #: of its parts and its size.

    @property
    def misfit(self) -> float:
        """The cost less the price: how well the shape fits, however rare it is."""
        return self.cost - self.price


class FamilySearch:
    """One search through the family."""

    def __init__(self, evidence: ShapeEvidence, settings: FamilySettings) -> None:
        """Read the evidence into arrays."""
        self.settings = settings  #: how much is searched.
        self.guides: Guides = guides_of(evidence)  #: what the readings propose.
        self.coarse: FamilyEvidence = observe(evidence, coarse=True)  #: a part of the readings, for ranking.
        self.full: FamilyEvidence = observe(evidence)  #: all of them.
        self._place_error = evidence.place_error
        rays = self.full.rays
        self._bench = bench_rows(
            evidence.place_error, evidence.support_error, rays.pixel, rays.position_sigma, rays.scale_sigma
        )
        self._bench_middle = np.zeros(layout.POSE_SIZE)
        self._bench_middle[layout.OUTLINE] = OUTLINE_BIAS * rays.pixel

    def found(self, seeds: Iterable[Hypothesis] = ()) -> list[Hypothesis]:
        """Hypotheses of least cost, the best first.

        Args:
            seeds: of earlier estimates, to begin at as well.
        """
        settings = self.settings
        begun = [self.refined(one, BEGINNING) for one in _stratified(self.laid(), settings.starts)]
        kept = [*_stratified(begun, settings.refined), *seeds]
        started = _ranked(self.refined(one, settings.refining) for one in kept)
        random = np.random.default_rng(settings.seed + 1)
        changed = self._next_to(started, settings.changed, random)
        # What one change made better may need another: a wall that was taken for solid is hollow again.
        again = self._next_to(changed, -(-settings.changed // 2), random)
        found = hopped = _ranked([*started, *changed, *again])
        for _ in range(settings.hops):
            hopped = _ranked([*hopped, *self._beside(hopped, random)])
        # What lies beside the best must not take the places of what is likely elsewhere.
        last = _distinct([*_distinct(hopped, HOPPED), *found], settings.finals + HOPPED)
        return _ranked(self.refined(one, settings.finishing, last=True) for one in last)

    def _next_to(self, hypotheses: list[Hypothesis], count: int, random: _Random) -> list[Hypothesis]:
        """All shapes that differ by a part or a turn from those that fit best, refined."""
        ranked = sorted(hypotheses, key=lambda one: one.misfit)
        # The best of so many classes: next to two of one class lie the same shapes.
        best = {one.shape.name: one for one in reversed(ranked)}
        promising = sorted(best.values(), key=ranked.index)[:count]
        return [
            self.refined(changed, CHANGING) for one in promising for changed in self._changes_of(one, random)
        ]

    def _beside(self, ranked: list[Hypothesis], random: _Random) -> list[Hypothesis]:
        """Fitted anew from beside the best of all: a fit ends in the valley that it begins in."""
        return [
            self.refined(replace(one, shape=beside(one.shape, random)), self.settings.hopping)
            for one in _distinct(ranked, HOPPED)
            for _ in range(HOPS)
        ]

    def _changes_of(self, one: Hypothesis, random: _Random) -> Iterator[Hypothesis]:
        """Of each code that a part more or less gives, those that fit best before they are refined."""
        by_code: dict[bytes, list[Hypothesis]] = {}
        for shape in changes(one.shape, random):
            by_code.setdefault(shape.code.tobytes(), []).append(self._changed(one, shape))
        for alike in by_code.values():
            few = alike if len(alike) <= LIKELY else _ranked(self._costed(other) for other in alike)
            yield from few[:LIKELY]

    def _costed(self, one: Hypothesis) -> Hypothesis:
        out, q = rows_for(self.coarse), prepared_room()
        shape = one.shape
        return replace(one, cost=total_cost(shape.code, shape.theta, self.coarse, one.prior, False, out, q))

    def laid(self) -> list[Hypothesis]:
        """Draws in their best place, turn and size; of every class those that fit best."""
        each = -(-self.settings.draws // sum(len(codes_of(name)) for name in CLASSES))
        found = []
        for k, name in enumerate(CLASSES):
            # A class draws as it would without the others: what is added to one changes none of them.
            random = np.random.default_rng((self.settings.seed, k))
            found += self._laid_of(name, each * len(codes_of(name)), random)
        return found

    def _laid_of(self, name: str, count: int, random: _Random) -> list[Hypothesis]:
        """The best of a class's draws, of each combination of parts as many: none stands for another."""
        by_code: dict[bytes, list[FamilyShape]] = {}
        for shape in (draw_shape(name, random) for _ in range(count)):
            by_code.setdefault(shape.code.tobytes(), []).append(shape)
        return [one for alike in by_code.values() for one in self._laid_best(alike, random)]

    def _laid_best(self, shapes: list[FamilyShape], random: _Random) -> list[Hypothesis]:
        draws = _ranked(self._at_best_turn(shape, random) for shape in shapes)
        draws = draws[: max(int(LAID * len(draws)), 1)]
        for rounds, share in LAYING:
            draws = _ranked(self._stood(one, rounds) for one in draws)
            draws = draws[: max(int(share * len(draws)), 1)]
        return [self._under_prior(one.shape, one.cost) for one in draws]

    def _at_best_turn(self, shape: FamilyShape, random: _Random) -> Hypothesis:
        yaws = kind_of(shape.code).yaws(shape.code, self.settings.yaws)
        tried = lay(shape, self.guides, random, self._place_error, yaws)
        tried[:, layout.OUTLINE] = self._bench_middle[layout.OUTLINE]
        middle = self._middle(tried[0])
        prior = PriorRows(middle, self._prior_rows(stand_rows(shape.code)))
        out, q = rows_for(self.coarse), prepared_room()
        best, cost = cheapest(shape.code, tried, self.coarse, prior, out, q)
        placed = FamilyShape(shape.name, shape.code, tried[best])
        return Hypothesis(placed, prior, cost, np.empty((0, 0)))

    def _stood(self, one: Hypothesis, rounds: int) -> Hypothesis:
        """Moved, turned and scaled to fit the coarse readings better."""
        shape, guides = one.shape, self.guides
        basis = stand_basis(shape.code, guides.sighted and guides.touched)
        theta, cost, curvature = refine(
            shape.code, shape.theta, self.coarse, one.prior, basis, False, rounds, False
        )
        return Hypothesis(FamilyShape(shape.name, shape.code, theta), one.prior, cost, curvature)

    def _under_prior(self, shape: FamilyShape, cost: float = np.inf) -> Hypothesis:
        """A shape whose own numbers are believed as they are, give or take what such shapes differ by."""
        return replace(self.seeded(shape, shape.theta), cost=cost)

    def seeded(self, shape: FamilyShape, middle: FloatArray) -> Hypothesis:
        """A hypothesis of an earlier estimate, under the prior that it had then.

        Args:
            shape: in ``stand``.
            middle: ``(SIZE,)`` that its own numbers were drawn about.
        """
        rows = self._prior_rows(shape_rows(shape.code))
        return Hypothesis(shape, PriorRows(self._middle(middle), rows), np.inf, np.empty((0, 0)))

    def _prior_rows(self, own: FloatArray) -> FloatArray:
        """``(k, size)`` rows of the bench, then those of the parameters."""
        bench = np.zeros((len(self._bench), own.shape[1]))
        bench[:, : layout.POSE_SIZE] = self._bench
        return np.concatenate([bench, own])

    def nuisance(self, shape: FamilyShape) -> NuisanceCost:
        """Compute the cost of the bench errors that a shape needs."""
        return nuisance_cost(shape.theta, self._bench, self._bench_middle)

    def _changed(self, one: Hypothesis, shape: FamilyShape) -> Hypothesis:
        """Another shape beside a hypothesis: what they share is believed as before, not as it was fitted."""
        return self.seeded(shape, np.where(shape.theta == one.shape.theta, one.prior.middle, shape.theta))

    def _middle(self, theta: FloatArray) -> FloatArray:
        middle = theta.copy()
        middle[: layout.POSE_SIZE] = self._bench_middle
        return middle

    def refined(self, one: Hypothesis, rounds: int, last: bool = False) -> Hypothesis:
        """All its free numbers fitted to all readings.

        Args:
            one: to begin at.
            rounds: at most.
            last: whether contacts that do not fit are let go, and the curvature there is wanted.
        """
        code = one.shape.code
        basis = basis_of(code, self.guides.sighted, self.guides.touched)
        theta, cost, curvature = refine(
            code, one.shape.theta, self.full, one.prior, basis, last, rounds, last
        )
        shape = FamilyShape(one.shape.name, code, theta)
        price = TEMPERATURE * (rarity(shape) + rarity_of_size(shape))
        return Hypothesis(shape, one.prior, cost + price, curvature, price)


def _ranked(hypotheses: Iterable[Hypothesis]) -> list[Hypothesis]:
    return sorted(hypotheses, key=lambda one: one.cost)


def _stratified(laid: list[Hypothesis], count: int) -> list[Hypothesis]:
    """The best of every class, to half the count, then the best of all."""
    ranked = _ranked(laid)
    first = {one.shape.name: one for one in reversed(ranked)}
    chosen = _ranked(first.values())[: max(count // 2, 1)]
    taken = {id(one) for one in chosen}
    rest = [one for one in ranked if id(one) not in taken]
    return chosen + rest[: count - len(chosen)]


def _distinct(ranked: list[Hypothesis], count: int) -> list[Hypothesis]:
    """The best, each of its code or of numbers of its own."""
    chosen: list[Hypothesis] = []
    for one in ranked:
        if len(chosen) == count:
            break
        if not any(_alike(one.shape, other.shape) for other in chosen):
            chosen.append(one)
    return chosen


def _alike(a: FamilyShape, b: FamilyShape) -> bool:
    if not np.array_equal(a.code, b.code):
        return False
    place = np.abs(a.theta[: layout.Y + 1] - b.theta[: layout.Y + 1]).max()
    # A difference of logarithms, of a length of 50 mm.
    own = np.abs(a.theta[layout.POSE_SIZE :] - b.theta[layout.POSE_SIZE :]).max() * 50e-3
    return bool(max(place, own) < ALIKE)


_SETTLED = 1.0e-3
"""Of the cost: a round that gains less is the last."""

_HOPELESS = 1.0e6
_MAX_STEP = 0.6
"""Longest step of a logarithm or an angle: beyond it the model's slope says nothing."""


@compiled
def total_cost(
    code: IntArray,
    theta: FloatArray,
    seen: FamilyEvidence,
    prior: PriorRows,
    robust: bool,
    out: Rows,
    q: FloatArray,
    most: float = np.inf,
) -> float:
    """Half the sum of squares of readings and prior; very large where the shape is no number.

    Of a shape that costs more than ``most``, a number above that, or none; ``out`` is filled in part then.
    """
    off = prior.rows @ (theta - prior.middle)
    believed = 0.5 * np.dot(off, off)
    cost = evaluate(code, theta, seen, robust, out, q, most - believed) + believed
    return cost if np.isfinite(cost) or np.isfinite(most) else _HOPELESS


@compiled
def cheapest(
    code: IntArray, tried: FloatArray, seen: FamilyEvidence, prior: PriorRows, out: Rows, q: FloatArray
) -> tuple[int, float]:
    """Which of ``(n, SIZE)`` vectors of one shape costs least, the first of equals, and what it costs."""
    best, least = 0, np.inf
    for k in range(len(tried)):
        cost = total_cost(code, tried[k], seen, prior, False, out, q, least)
        if cost < least:
            best, least = k, cost
    return best, least


@compiled
def refine(
    code: IntArray,
    theta: FloatArray,
    seen: FamilyEvidence,
    prior: PriorRows,
    basis: FloatArray,
    robust: bool,
    rounds: int,
    curved: bool = True,
) -> tuple[FloatArray, float, FloatArray]:
    """The vector of least cost near one, along the directions of ``basis``.

    Args:
        code: of the shape.
        theta: ``(SIZE,)`` to begin at.
        seen: readings.
        prior: of the vector.
        basis: ``(n, SIZE)`` directions that it may move along.
        robust: whether contacts that do not fit are let go.
        rounds: at most.
        curved: whether the curvature there is wanted; it costs as much as a round.

    Returns:
        The vector, its cost, and ``(n, n)`` the curvature of the cost along the directions; empty where it is
        not wanted.
    """
    best = theta.copy()
    out, trial, q = rows_for(seen), rows_for(seen), prepared_room()
    cost = total_cost(code, best, seen, prior, robust, out, q)
    damping = 1e-2
    along = prior.rows @ basis.T
    curvature, slope, current = np.empty((0, 0)), np.empty(0), False
    for _ in range(rounds):
        if not current:
            curvature, slope = _normal_equations(code, best, seen, prior, basis, along, out, q)
            current = True
        damped = curvature.copy()
        for i in range(len(damped)):
            damped[i, i] += damping * curvature[i, i] + 1e-9
        step = np.linalg.solve(damped, -slope).astype(np.float64)
        longest = np.abs(step).max()
        if longest > _MAX_STEP:
            step = step * (_MAX_STEP / longest)
        moved = best + step @ basis
        now = total_cost(code, moved, seen, prior, robust, trial, q, cost)
        if now < cost:
            gain = cost - now
            best, cost, current = moved, now, False
            out, trial = trial, out
            damping = max(0.2 * damping, 1e-6)
            if gain < _SETTLED * cost:
                break
        else:
            damping *= 8.0
            if damping > 1e5:
                break
    if not curved:
        return best, cost, np.empty((0, 0))
    if not current:
        curvature, slope = _normal_equations(code, best, seen, prior, basis, along, out, q)
    return best, cost, curvature


@compiled
def _normal_equations(
    code: IntArray,
    theta: FloatArray,
    seen: FamilyEvidence,
    prior: PriorRows,
    basis: FloatArray,
    along: FloatArray,
    out: Rows,
    q: FloatArray,
) -> tuple[FloatArray, FloatArray]:
    """Gauss-Newton's curvature and slope along the directions."""
    rows = active_rows(seen, out.values)
    root = np.sqrt(out.weights[rows])
    slopes = slopes_along(code, theta, seen, basis, rows, out, q) * root
    off = prior.rows @ (theta - prior.middle)
    curvature = slopes @ slopes.T + along.T @ along
    slope = slopes @ (out.values[rows] * root) + along.T @ off
    return curvature, slope
