"""The comparison as a value: residuals in units of their stated noise, and one verdict a sense."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np
from scipy.special import chdtri

from harness.basics.arrays import FloatArray
from harness.basics.errors import OutOfDomain

Sense = Literal["arm", "touch", "sound", "camera"]
Source = Literal["twin", "network", "reference"]
Verdict = Literal["fits", "does not fit", "not comparable"]

FALSE_ALARM = 0.01
"""Probability that a run which the model describes is said not to fit, in any of its senses."""

_MOST = 1.0e12
"""Of a chi-square: JSON has no infinity, and beyond this it says no more."""


@dataclass(frozen=True, eq=False)
class SideBySide:
    """A reading and what a model says of it, as a report shows them; no verdict reads it."""

    live: FloatArray  #: ``(rows, columns)`` a field, or ``(n,)`` values in ascending order.
    model: FloatArray  #: of the same shape for a field; ``(m,)`` for values.
    unit: str  #: of both.


@dataclass(frozen=True)
class Residual:
    """One reading less what a model says, in units of its noise."""

    step: int  #: of the run, from 0; of what all steps have in common, the last that it was read at.
    quantity: str  #: what was compared: ``"contact depth"``.
    chi_square: float  #: 0 or more.
    dof: float  #: its degrees of freedom, more than 0; need not be whole.
    numbers: Mapping[str, float] = field(default_factory=dict)  #: that it is made of, keys with their units.
    sides: SideBySide | None = field(default=None, compare=False, repr=False)
    """the reading and the model; None where the numbers are all of it."""

    def __post_init__(self) -> None:
        if not (np.isfinite(self.chi_square) and self.chi_square >= 0.0 and self.dof > 0.0):
            raise OutOfDomain(
                f"step {self.step + 1}, {self.quantity}: chi-square {self.chi_square:g} with {self.dof:g} "
                "degrees of freedom; it must be finite and 0 or more, and they more than 0"
            )
        object.__setattr__(self, "chi_square", max(0.0, min(self.chi_square, _MOST)))


@dataclass(frozen=True)
class SenseResiduals:
    """What one sense was compared with, and the residuals."""

    sense: Sense  #: which.
    source: Source  #: what it is compared with.
    residuals: tuple[Residual, ...]  #: in order of the steps; empty where it cannot be compared.
    why: str = ""  #: it cannot be compared, or what a reader must know of how it was.
    seconds: float = 0.0  #: of CPU that the comparison took.
    refused_at: int | None = None
    """step of the first reading, where the calibration refuses all of them: none is left to compare, and the
    sense does not fit."""


@dataclass(frozen=True)
class JudgedSense:
    """One sense with its verdict."""

    compared: SenseResiduals  #: its residuals.
    verdict: Verdict  #: of all of them together.
    limits: tuple[float, ...]  #: for each residual, the chi-square beyond which it does not fit.

    @property
    def doubted(self) -> Residual | None:
        """The first residual beyond its limit."""
        pairs = zip(self.compared.residuals, self.limits, strict=True)
        return next((residual for residual, limit in pairs if residual.chi_square > limit), None)

    @property
    def first_doubt(self) -> int | None:
        """Step, from 0, of the first reading that does not fit."""
        return self.compared.refused_at if self.doubted is None else self.doubted.step


@dataclass(frozen=True)
class Agreement:
    """Every sense of a run against a model."""

    about: str  #: the object that was compared with.
    false_alarm: float  #: probability that a right model is said not to fit.
    senses: tuple[JudgedSense, ...]
    """judged; touch and sound may be there twice, by the network and by the reference."""

    @property
    def fits(self) -> bool:
        """Whether nothing that could be compared is in doubt, and something could be."""
        verdicts = {one.verdict for one in self.senses}
        return "fits" in verdicts and "does not fit" not in verdicts

    @property
    def first_doubt(self) -> tuple[int, Sense] | None:
        """Step, from 0, and sense of the earliest reading that does not fit."""
        found = [(one.first_doubt, one.compared.sense) for one in self.senses if one.first_doubt is not None]
        return min(found, key=lambda pair: pair[0], default=None)

    def as_json(self) -> dict[str, Any]:
        """Steps are counted from 1, as everywhere in a result."""
        doubt = self.first_doubt
        return {
            "object": self.about,
            "fits": self.fits,
            "false_alarm": self.false_alarm,
            "first_in_doubt": None if doubt is None else {"step": doubt[0] + 1, "sense": doubt[1]},
            "senses": [
                {
                    "sense": one.compared.sense,
                    "compared_with": one.compared.source,
                    "verdict": one.verdict,
                    "why": one.compared.why or None,
                    "seconds": one.compared.seconds,
                    "residuals": [
                        {
                            "step": residual.step + 1,
                            "quantity": residual.quantity,
                            "chi_square": residual.chi_square,
                            "dof": residual.dof,
                            "limit": limit,
                            "numbers": dict(residual.numbers),
                        }
                        for residual, limit in zip(one.compared.residuals, one.limits, strict=True)
                    ],
                }
                for one in self.senses
            ],
        }

    def sentences(self) -> list[str]:
        """For people, a sense each: the residual that speaks most against the model, with its numbers."""
        return [_sentence(one) for one in self.senses]

    def lines(self) -> list[str]:
        """For people, a sense each: what it was compared with, the verdict, and its sentence."""
        return [
            f"{one.compared.sense} against the {one.compared.source}: {one.verdict}; {sentence}"
            for one, sentence in zip(self.senses, self.sentences(), strict=True)
        ]


def judge_residuals(
    about: str, senses: Sequence[SenseResiduals], false_alarm: float = FALSE_ALARM
) -> Agreement:
    """Test the residuals of each sense, which have chi-square distributions if the model is right.

    ``false_alarm`` is divided evenly among the senses, and again among the residuals of each (Bonferroni).

    Raises:
        OutOfDomain: a rate that is not between 0 and 1.
    """
    if not 0.0 < false_alarm < 1.0:
        raise OutOfDomain(f"a false alarm rate of {false_alarm:g} was given; it must be between 0 and 1")
    compared = max(1, sum(bool(one.residuals) for one in senses))
    found = []
    for one in senses:
        verdict: Verdict = "not comparable" if one.refused_at is None else "does not fit"
        limits: tuple[float, ...] = ()
        if one.residuals:
            each = false_alarm / compared / len(one.residuals)
            dofs = [residual.dof for residual in one.residuals]
            limits = tuple(np.atleast_1d(chdtri(dofs, each)).tolist())
            beyond = any(r.chi_square > limit for r, limit in zip(one.residuals, limits, strict=True))
            verdict = "does not fit" if beyond else "fits"
        found.append(JudgedSense(one, verdict, limits))
    return Agreement(about, false_alarm, tuple(found))


def probability_of_at_least(found: int, count: int, share: float) -> float:
    """Return the probability of ``found`` or more successes in ``count`` trials, each of ``share``."""
    if found == 0:
        return 1.0
    from scipy.stats import binom  # here, because importing it takes half a second

    return float(binom.sf(found - 1, count, share))


def _sentence(one: JudgedSense) -> str:
    if not one.compared.residuals:
        return one.compared.why
    note = f" ({one.compared.why})" if one.compared.why else ""
    worst = one.doubted or max(one.compared.residuals, key=lambda r: r.chi_square / r.dof)
    limit = one.limits[one.compared.residuals.index(worst)]
    kind = "first in doubt" if one.doubted else "worst"
    return (
        f"{kind}: step {worst.step + 1}, {worst.quantity}, chi-square {worst.chi_square:.1f} with "
        f"{worst.dof:.1f} degrees of freedom (limit {limit:.1f}): {numbers_text(worst.numbers)}{note}"
    )


_SHOWN = {"m": (1e3, " mm"), "m2": (1e6, " mm²"), "rad": (180.0 / np.pi, "°"), "px": (1.0, " px")}
"""What the unit at the end of a number's name is shown in."""


def numbers_text(numbers: Mapping[str, float]) -> str:
    """Numbers in words, each by its name and in a unit that suits it: ``read_m`` is ``read 1.95 mm``."""
    said = []
    for name, value in numbers.items():
        words, _, unit = name.rpartition("_")
        factor, shown = _SHOWN.get(unit, (1.0, ""))
        said.append(f"{(words if shown else name).replace('_', ' ')} {factor * value:.3g}{shown}")
    return ", ".join(said)
