"""Search the shape family for hypotheses that the readings allow: propose, place, refine, vary, finish."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from experiments.shape_reconstruction import thresholds as limits
from experiments.shape_reconstruction.evidence import ShapeEvidence
from experiments.shape_reconstruction.family import freedom, kinds, layout
from experiments.shape_reconstruction.family.kind import FamilyShape, Random
from experiments.shape_reconstruction.family.observed import FamilyEvidence, observe
from experiments.shape_reconstruction.family.proposals import Guides, change, guides_of, perturb, place_sample
from experiments.shape_reconstruction.family.residuals import (
    Rows,
    active_rows,
    evaluate,
    make_rows,
    prepared_buffer,
    slopes_along,
)
from harness.basics.arrays import FloatArray, IntArray
from harness.basics.compiled import compiled


class PriorRows(NamedTuple):
    """A normal density of a shape's vector."""

    middle: FloatArray  #: ``(size,)`` mean.
    rows: FloatArray  #: ``(k, size)``: ``rows @ (theta - middle)`` are independent, of unit deviation.


_SETTLED = 1.0e-3  #: fraction of the cost: an iteration that gains less is the last.

_HOPELESS = 1.0e6
_MAX_STEP = 0.6
"""Longest step of a logarithm or an angle: beyond it the model's slope says nothing."""


@dataclass(frozen=True)
class FamilySettings:
    """Amount of search."""

    draws: int = 1850
    """samples of the prior, spread evenly over classes and their combinations of parts."""
    yaws: int = 4  #: yaws that each sample is tried at.
    starts: int = 84  #: placed samples that are fitted to all readings, for a few iterations.
    refined: int = 42  #: of those, the number that is refined.
    refining: int = 14  #: iterations of each.
    changed: int = 4  #: hypotheses of which parts are added, removed or exchanged.
    hops: int = 4  #: rounds of perturbing the best.
    hopping: int = 7  #: iterations of each perturbed shape.
    finals: int = 10  #: hypotheses that are finished.
    finishing: int = 14  #: iterations of each of those.
    pitch: float = 2.5e-3  #: pitch of the grid that the surface is extracted from, m.
    seed: int = 0  #: seed of the samples.


LEVELS = {
    "coarse": FamilySettings(
        draws=600, starts=40, refined=16, changed=2, hops=2, finals=5, finishing=8, pitch=4.0e-3
    ),
    "default": FamilySettings(),
    "fine": FamilySettings(
        draws=6000, yaws=8, starts=300, refined=100, changed=10, hops=8, finals=20, finishing=20, pitch=2.0e-3
    ),
}
"""By name, the cheapest first."""

CONTINUED = replace(LEVELS["coarse"], draws=200, starts=14, refined=6, changed=1, finals=4, finishing=6)
"""Between two presses, next to the hypotheses before the last one: other samples each time."""


PLACED = 0.6
"""Fraction of the samples of one code that are placed: those that fit best at their best yaw."""

PLACING = ((1, 0.5), (1, 0.5), (2, 1.0))
"""Iterations in which samples find position, yaw and size; the fraction of each code that continues."""

FIRST_ROUNDS, CHANGE_ROUNDS = 3, 5
"""Iterations after which the worst starts are dropped; iterations in which a changed shape is fitted."""

CHANGES = 2
"""Changed shapes of one code that are refined per hypothesis: those that fit best as they were changed."""

PERTURBED, PERTURBATIONS = 2, 8
"""Hypotheses that are perturbed, and perturbed shapes of each in a round."""


@dataclass(frozen=True, eq=False)
class Hypothesis:
    """A shape that the readings allow."""

    shape: FamilyShape  #: in the frame ``stand``.
    prior: PriorRows  #: density that its numbers are refined under.
    cost: float
    """half the sum of squares of readings and prior, and the price of rare parts and sizes."""
    curvature: FloatArray
    """``(n, n)`` of the cost along its free numbers; empty before the last refinement."""
    price: float = 0.0  #: price of its parts and its size.

    @property
    def misfit(self) -> float:
        """The cost without the price of kinds.rarity."""
        return self.cost - self.price


class FamilySearch:
    """One search of the family for shapes that fit some readings."""

    def __init__(self, evidence: ShapeEvidence, settings: FamilySettings) -> None:
        self.settings = settings
        self.guides: Guides = guides_of(evidence)  #: proposals of the readings.
        self.coarse: FamilyEvidence = observe(evidence, coarse=True)  #: a part of the readings, for ranking.
        self.full: FamilyEvidence = observe(evidence)  #: all readings.
        self._place_error = evidence.place_error
        rays = self.full.rays
        self._bench = freedom.bench_rows(
            evidence.place_error, evidence.support_error, rays.pixel, rays.position_sigma, rays.scale_sigma
        )
        self._bench_middle = np.zeros(layout.POSE_SIZE)
        self._bench_middle[layout.OUTLINE] = freedom.OUTLINE_BIAS * rays.pixel

    def run(self, seeds: Iterable[Hypothesis] = ()) -> list[Hypothesis]:
        """Run all stages; return hypotheses in the order of their cost.

        Args:
            seeds: hypotheses of earlier fits, where the search begins as well.
        """
        random = np.random.default_rng(self.settings.seed + 1)
        placed = self._place(self._propose())
        settings = self.settings
        begun = [self.refine(one, FIRST_ROUNDS) for one in _stratified(placed, settings.starts)]
        kept = [*_stratified(begun, settings.refined), *seeds]
        refined = _ranked(self.refine(one, settings.refining) for one in kept)
        changed = self._change_parts(refined, random)
        varied = self._perturb_best(changed, random)
        return self._finish(changed, varied)

    # Stage 1: propose samples of the prior.

    def _propose(self) -> Iterator[tuple[list[FamilyShape], Random]]:
        """Sample all classes; yield the samples of each combination of parts with the class's generator."""
        each = -(-self.settings.draws // sum(len(kinds.codes_of(name)) for name in kinds.CLASSES))
        for k, name in enumerate(kinds.CLASSES):
            # A class is sampled independently of the others: a change to one changes none of them.
            random = np.random.default_rng((self.settings.seed, k))
            by_code: dict[bytes, list[FamilyShape]] = {}
            for shape in (kinds.draw_shape(name, random) for _ in range(each * len(kinds.codes_of(name)))):
                by_code.setdefault(shape.code.tobytes(), []).append(shape)
            yield from ((shapes, random) for shapes in by_code.values())

    # Stage 2: place them by the readings.

    def _place(self, proposed: Iterable[tuple[list[FamilyShape], Random]]) -> list[Hypothesis]:
        return [one for shapes, random in proposed for one in self._place_alike(shapes, random)]

    def _place_alike(self, shapes: list[FamilyShape], random: Random) -> list[Hypothesis]:
        draws = _ranked(self._at_best_yaw(shape, random) for shape in shapes)
        draws = draws[: max(int(PLACED * len(draws)), 1)]
        for rounds, fraction in PLACING:
            draws = _ranked(self._placed(one, rounds) for one in draws)
            draws = draws[: max(int(fraction * len(draws)), 1)]
        return [replace(self.start(one.shape, one.shape.theta), cost=one.cost) for one in draws]

    def _at_best_yaw(self, shape: FamilyShape, random: Random) -> Hypothesis:
        yaws = self.settings.yaws * kinds.kind_of(shape.code).traits(shape.code).yaw_factor
        tried = place_sample(shape, self.guides, random, self._place_error, yaws)
        tried[:, layout.OUTLINE] = self._bench_middle[layout.OUTLINE]
        prior = PriorRows(
            self._middle(tried[0]), freedom.prior_rows(self._bench, freedom.stand_rows(shape.code))
        )
        best, cost = cheapest(
            shape.code, tried, self.coarse, prior, False, make_rows(self.coarse), prepared_buffer()
        )
        placed = FamilyShape(shape.name, shape.code, tried[best])
        return Hypothesis(placed, prior, cost, np.empty((0, 0)))

    def _placed(self, one: Hypothesis, rounds: int) -> Hypothesis:
        """Fit position, yaw and size to the coarse readings."""
        shape, guides = one.shape, self.guides
        basis = freedom.stand_basis(shape.code, guides.sighted and guides.touched)
        theta, cost, curvature = minimize(
            shape.code, shape.theta, self.coarse, one.prior, basis, False, rounds, False
        )
        return Hypothesis(FamilyShape(shape.name, shape.code, theta), one.prior, cost, curvature)

    # Stage 3: refine all parameters of the best.

    def refine(self, one: Hypothesis, rounds: int, last: bool = False) -> Hypothesis:
        """Fit all free numbers of a hypothesis to all readings.

        Args:
            one: the start.
            rounds: most iterations.
            last: whether contacts that do not fit lose their weight, and the curvature is computed.
        """
        code = one.shape.code
        basis = freedom.basis_of(code, self.guides.sighted, self.guides.touched)
        theta, cost, curvature = minimize(
            code, one.shape.theta, self.full, one.prior, basis, last, rounds, last
        )
        shape = FamilyShape(one.shape.name, code, theta)
        price = limits.TEMPERATURE * (kinds.rarity(shape) + kinds.rarity_of_size(shape))
        return Hypothesis(shape, one.prior, cost + price, curvature, price)

    # Stage 4: vary parts, then all parameters.

    def _change_parts(self, refined: list[Hypothesis], random: Random) -> list[Hypothesis]:
        count = self.settings.changed
        changed = self._changes_of_best(refined, count, random)
        # What one change made better may need another: a wall that was fitted as solid is hollow again.
        again = self._changes_of_best(changed, -(-count // 2), random)
        return _ranked([*refined, *changed, *again])

    def _changes_of_best(self, hypotheses: list[Hypothesis], count: int, random: Random) -> list[Hypothesis]:
        ranked = sorted(hypotheses, key=lambda one: one.misfit)
        # The best of so many classes: neighbours of two of one class are the same shapes.
        best = {one.shape.name: one for one in reversed(ranked)}
        promising = sorted(best.values(), key=ranked.index)[:count]
        return [
            self.refine(changed, CHANGE_ROUNDS)
            for one in promising
            for changed in self._changes_of(one, random)
        ]

    def _changes_of(self, one: Hypothesis, random: Random) -> Iterator[Hypothesis]:
        """Yield, of each code that a changed part gives, the shapes that fit best before they are refined."""
        by_code: dict[bytes, list[Hypothesis]] = {}
        for shape in change(one.shape, random):
            # Numbers that both have keep their prior: they are not expected where they were fitted.
            middle = np.where(shape.theta == one.shape.theta, one.prior.middle, shape.theta)
            by_code.setdefault(shape.code.tobytes(), []).append(self.start(shape, middle))
        for alike in by_code.values():
            few = alike if len(alike) <= CHANGES else _ranked(self._costed(other) for other in alike)
            yield from few[:CHANGES]

    def _costed(self, one: Hypothesis) -> Hypothesis:
        out, q, shape = make_rows(self.coarse), prepared_buffer(), one.shape
        return replace(
            one, cost=total_cost(shape.code, shape.theta, self.coarse, one.prior, False, out, q, np.inf)
        )

    def _perturb_best(self, hypotheses: list[Hypothesis], random: Random) -> list[Hypothesis]:
        """Refine perturbed copies of the best: a fit ends in the local minimum of its start."""
        varied, rounds = hypotheses, self.settings.hopping
        for _ in range(self.settings.hops):
            copies = [
                self.refine(replace(one, shape=perturb(one.shape, random)), rounds)
                for one in _distinct(varied, PERTURBED)
                for _ in range(PERTURBATIONS)
            ]
            varied = _ranked([*varied, *copies])
        return varied

    # Stage 5: finish a few hypotheses.

    def _finish(self, changed: list[Hypothesis], varied: list[Hypothesis]) -> list[Hypothesis]:
        # Perturbed copies of the best must not replace what is likely elsewhere.
        last = _distinct([*_distinct(varied, PERTURBED), *changed], self.settings.finals + PERTURBED)
        return _ranked(self.refine(one, self.settings.finishing, last=True) for one in last)

    def start(self, shape: FamilyShape, middle: FloatArray) -> Hypothesis:
        """Return a hypothesis that is not fitted yet.

        Args:
            shape: in ``stand``.
            middle: ``(size,)`` mean of the prior of its parameters.
        """
        prior = PriorRows(
            self._middle(middle), freedom.prior_rows(self._bench, freedom.shape_rows(shape.code))
        )
        return Hypothesis(shape, prior, np.inf, np.empty((0, 0)))

    def nuisance(self, shape: FamilyShape) -> freedom.NuisanceCost:
        """Compute the cost of the bench errors that a shape needs."""
        return freedom.nuisance_cost(shape.theta, self._bench, self._bench_middle)

    def _middle(self, theta: FloatArray) -> FloatArray:
        middle = theta.copy()
        middle[: layout.POSE_SIZE] = self._bench_middle
        return middle


def _ranked(hypotheses: Iterable[Hypothesis]) -> list[Hypothesis]:
    return sorted(hypotheses, key=lambda one: one.cost)


def _stratified(hypotheses: list[Hypothesis], count: int) -> list[Hypothesis]:
    """Select the best of every class, to half the count, then the best of all."""
    ranked = _ranked(hypotheses)
    first = {one.shape.name: one for one in reversed(ranked)}
    chosen = _ranked(first.values())[: max(count // 2, 1)]
    taken = {id(one) for one in chosen}
    rest = [one for one in ranked if id(one) not in taken]
    return chosen + rest[: count - len(chosen)]


def _distinct(ranked: list[Hypothesis], count: int) -> list[Hypothesis]:
    """Select the best, each with a code or numbers of its own."""
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
    return bool(max(place, own) < limits.SAME_SHAPE)


@compiled
def total_cost(
    code: IntArray,
    theta: FloatArray,
    seen: FamilyEvidence,
    prior: PriorRows,
    robust: bool,
    out: Rows,
    q: FloatArray,
    most: float,
) -> float:
    """Compute half the sum of squares of readings and prior; very large where the shape is not finite.

    The evaluation of a shape that costs more than ``most`` stops early: the result is above ``most``.
    """
    off = prior.rows @ (theta - prior.middle)
    by_prior = 0.5 * np.dot(off, off)
    cost = evaluate(code, theta, seen, robust, out, q, most - by_prior) + by_prior
    return cost if np.isfinite(cost) or np.isfinite(most) else _HOPELESS


@compiled
def cheapest(
    code: IntArray,
    tried: FloatArray,
    seen: FamilyEvidence,
    prior: PriorRows,
    robust: bool,
    out: Rows,
    q: FloatArray,
) -> tuple[int, float]:
    """Find which of ``(n, size)`` vectors costs least, the first of equals; return its row and cost."""
    best, least = 0, np.inf
    for k in range(len(tried)):
        cost = total_cost(code, tried[k], seen, prior, robust, out, q, least)
        if cost < least:
            best, least = k, cost
    return best, least


@compiled
def minimize(
    code: IntArray,
    theta: FloatArray,
    seen: FamilyEvidence,
    prior: PriorRows,
    basis: FloatArray,
    robust: bool,
    rounds: int,
    curved: bool,
) -> tuple[FloatArray, float, FloatArray]:
    """Find the vector of least cost near a start, along the directions of ``basis`` (Levenberg-Marquardt).

    Args:
        code: kind and parts of the shape.
        theta: ``(size,)`` start.
        seen: the readings.
        prior: density of the vector.
        basis: ``(n, size)`` directions that it may move along.
        robust: whether contacts that do not fit lose their weight.
        rounds: most iterations.
        curved: whether the curvature there is wanted; it costs as much as a round.

    Returns:
        The vector, its cost, and ``(n, n)`` the curvature of the cost along the directions; empty where it is
        not wanted.
    """
    best = theta.copy()
    out, trial, q = make_rows(seen), make_rows(seen), prepared_buffer()
    cost = total_cost(code, best, seen, prior, robust, out, q, np.inf)
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
    """Compute Gauss-Newton's curvature and slope of the cost along the directions."""
    rows = active_rows(seen, out.values)
    root = np.sqrt(out.weights[rows])
    slopes = slopes_along(code, theta, seen, basis, rows, out, q) * root
    off = prior.rows @ (theta - prior.middle)
    curvature = slopes @ slopes.T + along.T @ along
    slope = slopes @ (out.values[rows] * root) + along.T @ off
    return curvature, slope
