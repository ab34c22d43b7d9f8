"""Weights of the hypotheses, and shapes sampled from the uncertainty of each."""

from dataclasses import dataclass

import numpy as np

from experiments.shape_reconstruction import thresholds as limits
from experiments.shape_reconstruction.family import layout
from experiments.shape_reconstruction.family.freedom import basis_of
from experiments.shape_reconstruction.family.kind import FamilyShape
from experiments.shape_reconstruction.family.kinds import KINDS
from experiments.shape_reconstruction.family.search import Hypothesis
from harness.basics.arrays import FloatArray

SAMPLES = 16
"""Shapes drawn about each hypothesis: fewer tell a press apart from others by chance."""

VECTOR_SIZE = max(kind.size for kind in KINDS)
"""Numbers of each vector in the result; those that a kind has not are zero."""

_LONGEST = 2.5
"""Standard deviations of a prior that a drawn number is off its hypothesis at most."""


@dataclass(frozen=True, eq=False)
class Mixture:
    """The posterior: hypotheses with weights, and samples of each."""

    hypotheses: tuple[Hypothesis, ...]  #: by weight, the greatest first.
    weights: FloatArray  #: ``(n,)``, their sum 1.
    about: tuple[tuple[FamilyShape, ...], ...]  #: ``SAMPLES`` shapes drawn about each, in their order.

    @property
    def best(self) -> Hypothesis:
        """The one of greatest weight."""
        return self.hypotheses[0]

    def by_class(self) -> dict[str, float]:
        """Weight of every class among them, the greatest first; classes of the same parts are one.

        A bowl and a vase of one shape are no two answers: the name is that of the one of most weight.
        """
        names: dict[bytes, str] = {}
        totals: dict[str, float] = {}
        for one, weight in zip(self.hypotheses, self.weights, strict=True):
            name = names.setdefault(one.shape.code.tobytes(), one.shape.name)
            totals[name] = totals.get(name, 0.0) + float(weight)
        return dict(sorted(totals.items(), key=lambda item: -item[1]))

    def as_json(self) -> list[dict[str, object]]:
        """Return the hypotheses as JSON values."""
        return [
            {
                "class": one.shape.name,
                "weight": float(weight),
                "cost": one.cost,
                "code": one.shape.code.tolist(),
                "numbers": _padded(one.shape.theta),
                "about": [_padded(shape.theta) for shape in about],
                "drawn_about": _padded(one.prior.middle),
            }
            for one, weight, about in zip(self.hypotheses, self.weights, self.about, strict=True)
        ]


def _padded(theta: FloatArray) -> list[float]:
    return [*theta.tolist(), *[0.0] * (VECTOR_SIZE - len(theta))]


def mixture_of(found: list[Hypothesis], sighted: bool, touched: bool, seed: int) -> Mixture:
    """Weights by cost and by how much of its prior each hypothesis had to give up (Laplace).

    Of each mode only the hypothesis of least cost counts: two within one uncertainty would count it twice.
    """
    modes: list[Hypothesis] = []
    for one in sorted(found, key=lambda one: one.cost):
        if not any(_of_one_mode(one, other, sighted, touched) for other in modes):
            modes.append(one)
    scores = np.empty(len(modes))
    for k, one in enumerate(modes):
        prior = _prior_precision(one, sighted, touched)
        _, narrow = np.linalg.slogdet(
            one.curvature / limits.TEMPERATURE + prior * (1.0 - 1.0 / limits.TEMPERATURE)
        )
        _, wide = np.linalg.slogdet(prior)
        scores[k] = -one.cost / limits.TEMPERATURE - 0.5 * (narrow - wide)
    weights = np.exp(scores - scores.max())
    order = [int(i) for i in np.argsort(-weights, kind="stable") if weights[i] >= limits.MIN_WEIGHT]
    kept = weights[order] / weights[order].sum()
    random = np.random.default_rng(seed)
    about = tuple(_drawn(modes[i], sighted, touched, random) for i in order)
    return Mixture(tuple(modes[i] for i in order), kept, about)


def _of_one_mode(one: Hypothesis, other: Hypothesis, sighted: bool, touched: bool) -> bool:
    if not np.array_equal(one.shape.code, other.shape.code):
        return False
    basis = basis_of(one.shape.code, sighted, touched)
    off = basis @ (one.shape.theta - other.shape.theta)
    turn = basis[:, layout.YAW] != 0.0
    off[turn] = np.arctan2(np.sin(off[turn]), np.cos(off[turn]))
    precision = other.curvature / limits.TEMPERATURE + _prior_precision(other, sighted, touched)
    return float(off @ precision @ off) < len(off)


def _prior_precision(one: Hypothesis, sighted: bool, touched: bool) -> FloatArray:
    basis = basis_of(one.shape.code, sighted, touched)
    along = one.prior.rows @ basis.T
    precision = along.T @ along
    # A turn is as likely as any other: the deviation of a uniform density over all of them.
    turn = np.flatnonzero(basis[:, layout.YAW])
    precision[turn, turn] += 3.0 / np.pi**2
    return np.asarray(precision)


def _drawn(
    one: Hypothesis, sighted: bool, touched: bool, random: np.random.Generator
) -> tuple[FamilyShape, ...]:
    basis = basis_of(one.shape.code, sighted, touched)
    prior = _prior_precision(one, sighted, touched)
    precision = one.curvature / limits.TEMPERATURE + prior
    values, vectors = np.linalg.eigh(0.5 * (precision + precision.T))
    spread = vectors / np.sqrt(np.maximum(values, 1e-6))
    steps = random.standard_normal((SAMPLES, len(values))) @ spread.T
    most = _LONGEST / np.sqrt(np.diag(prior))
    steps = np.clip(steps, -most, most)
    return tuple(
        FamilyShape(one.shape.name, one.shape.code, one.shape.theta + step @ basis) for step in steps
    )
