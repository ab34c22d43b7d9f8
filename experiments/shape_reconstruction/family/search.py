"""From draws of the prior to the shapes that the readings allow: many are laid, some refined, few finished."""

from dataclasses import dataclass

import numpy as np

from experiments.shape_reconstruction.evidence import ShapeEvidence
from experiments.shape_reconstruction.family import layout
from experiments.shape_reconstruction.family.classes import CLASSES, FamilyShape, draw_shape
from experiments.shape_reconstruction.family.freedom import (
    OUTLINE_BIAS,
    basis_of,
    bench_rows,
    shape_rows,
    stand_basis,
    stand_rows,
)
from experiments.shape_reconstruction.family.guides import Guides, guides_of
from experiments.shape_reconstruction.family.observed import Observed, observe
from experiments.shape_reconstruction.family.proposals import lay
from experiments.shape_reconstruction.family.refine import Prior, refine, total_cost
from experiments.shape_reconstruction.family.residuals import prepared_room, rows_for
from experiments.shape_reconstruction.family.settings import FamilySettings
from harness.basics.arrays import FloatArray


@dataclass(frozen=True, eq=False)
class Hypothesis:
    """A shape that the readings may be of.

    Attributes:
        shape: in the frame ``stand``.
        prior: that its numbers were refined under.
        cost: half the sum of squares of readings and prior.
        curvature: ``(n, n)`` of the cost along its free numbers.
    """

    shape: FamilyShape
    prior: Prior
    cost: float
    curvature: FloatArray


class Search:
    """One search through the family.

    Args:
        evidence: all readings.
        settings: how much is searched.
    """

    def __init__(self, evidence: ShapeEvidence, settings: FamilySettings) -> None:
        """Read the evidence into arrays, few for ranking and all for fitting."""
        self.settings = settings
        self.guides: Guides = guides_of(evidence)
        self.coarse: Observed = observe(evidence, coarse=True)
        self.full: Observed = observe(evidence)
        self.place_error = evidence.place_error
        rays = self.full.rays
        self._bench = bench_rows(
            evidence.place_error, evidence.support_error, rays.pixel, rays.position_sigma, rays.scale_sigma
        )

    def found(self) -> list[Hypothesis]:
        """Hypotheses of least cost, the best first."""
        laid = self.laid()
        started = [
            self._refined(one, False, self.settings.refining)
            for one in _stratified(laid, self.settings.starts)
        ]
        started.sort(key=lambda one: one.cost)
        finals = [
            self._refined(one, True, self.settings.finishing) for one in started[: self.settings.finals]
        ]
        finals.sort(key=lambda one: one.cost)
        return finals

    def laid(self) -> list[Hypothesis]:
        """Every draw in its best place, size and turn."""
        random = np.random.default_rng(self.settings.seed)
        each = -(-self.settings.draws // len(CLASSES))
        return [self._laid(draw_shape(name, random), random) for name in CLASSES for _ in range(each)]

    def _laid(self, shape: FamilyShape, random: np.random.Generator) -> Hypothesis:
        tried = lay(shape, self.guides, random, self.place_error, self.settings.yaws)
        tried[:, layout.OUTLINE] = OUTLINE_BIAS * self.full.rays.pixel
        middle = np.zeros(layout.SIZE)
        middle[layout.OUTLINE] = tried[0, layout.OUTLINE]
        prior = Prior(middle, self._bench)
        if len(tried) > 1:
            out, q = rows_for(self.coarse), prepared_room()
            costs = [total_cost(shape.code, one, self.coarse, prior, False, out, q) for one in tried]
            best = tried[int(np.argmin(costs))]
        else:
            best = tried[0]
        middle = best.copy()
        middle[: layout.POSE_END] = prior.middle[: layout.POSE_END]
        prior = Prior(middle, np.concatenate([self._bench, stand_rows(shape.code)]))
        theta, cost, curvature = refine(
            shape.code, best, self.coarse, prior, stand_basis(shape.code), False, self.settings.aligning
        )
        middle = theta.copy()
        middle[: layout.POSE_END] = prior.middle[: layout.POSE_END]
        moved = FamilyShape(shape.name, shape.code, theta)
        return Hypothesis(
            moved, Prior(middle, np.concatenate([self._bench, shape_rows(shape.code)])), cost, curvature
        )

    def _refined(self, one: Hypothesis, robust: bool, rounds: int) -> Hypothesis:
        code = one.shape.code
        basis = basis_of(code, self.guides.sighted, self.guides.touched)
        theta, cost, curvature = refine(code, one.shape.theta, self.full, one.prior, basis, robust, rounds)
        return Hypothesis(FamilyShape(one.shape.name, code, theta), one.prior, cost, curvature)


def _stratified(laid: list[Hypothesis], count: int) -> list[Hypothesis]:
    """The best of every class, then the best of all."""
    ranked = sorted(laid, key=lambda one: one.cost)
    chosen, names = [], set()
    for one in ranked:
        if one.shape.name not in names:
            names.add(one.shape.name)
            chosen.append(one)
    chosen = chosen[: max(count // 2, 1)]
    taken = {id(one) for one in chosen}
    rest = [one for one in ranked if id(one) not in taken]
    return chosen + rest[: count - len(chosen)]
