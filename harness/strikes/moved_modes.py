"""One mode of a structure that changed between the rows, where shared poles would make it several.

Rows of transfer functions are often measured one after another: a hammer roves, a sensor is moved, the
structure warms up. A mode that lies elsewhere in each row is no pole that all rows share, and a fit of
shared poles adds one after another for it. Each row alone has one pole there; of two modes it has two.
"""

from dataclasses import dataclass

import numpy as np

from harness.basics.arrays import BoolArray, FloatArray, IntArray, read_only
from harness.strikes.pole_fit import ComplexArray, PoleFit, SpectralLines, fit_poles
from harness.strikes.pole_search import APART, PoleSearch

_NEAR = 0.005
"""Of a frequency: poles nearer to each other may be one mode; roving rows of a ruler moved by as much."""

_LEAST_LINES = 16
"""To each side of poles, in which a row alone is fitted."""

_FAINT = 1e-4
"""Of the strongest row's power: fainter rows are near a node and say nothing of where the mode is."""

_FAR_LESS = 0.5
"""Of what one pole of all rows leaves: a pole of its own for each row leaves less where they moved."""

_NOISE = 2.0
"""Times what many shared poles leave, as noise, that one pole a row may leave too."""


@dataclass(frozen=True, eq=False)
class MovedMode:
    """One mode that the rows have in different places; means weigh rows by their power.

    Attributes:
        members: ``(m,)`` indices of the shared poles that stood for it.
        reach: rad/s, the lowest and highest at which it explains a line.
        omega: rad/s, the mean over the rows.
        decay: 1/s, likewise.
        omega_sigma: rad/s, one standard deviation of the mean, by the rows' scatter.
        decay_sigma: 1/s, likewise.
        spread: rad/s, one standard deviation from row to row.
    """

    members: IntArray
    reach: tuple[float, float]
    omega: float
    decay: float
    omega_sigma: float
    decay_sigma: float
    spread: float

    def holds(self, omega: float) -> bool:
        """Whether a pole at a frequency would stand for the same mode."""
        return self.reach[0] <= omega <= self.reach[1]


def moved_modes(lines: SpectralLines, fit: PoleFit, search: PoleSearch) -> list[MovedMode]:
    """Groups of neighbouring shared poles that are each one mode, of rows that do not agree where.

    Args:
        lines: of two rows and more; one row alone holds no such group.
        fit: of shared poles.
        search: whose ``misfit`` says what a row's one pole may leave of a line's power.
    """
    if len(lines.values) < 2:
        return []
    found = (_moved(lines, fit, search, members) for members in _neighbours(fit) if len(members) > 1)
    return [one for one in found if one is not None]


def _neighbours(fit: PoleFit) -> list[IntArray]:
    """Indices of the poles, in groups that the next pole is too far from."""
    order = np.argsort(fit.omegas)
    if len(order) == 0:
        return []
    omegas, widths = fit.omegas[order], np.abs(fit.decays[order])
    wide = np.maximum(_NEAR * omegas[1:], APART * np.maximum(widths[1:], widths[:-1]))
    return np.split(order, np.flatnonzero(np.diff(omegas) > wide) + 1)


def _moved(lines: SpectralLines, fit: PoleFit, search: PoleSearch, members: IntArray) -> MovedMode | None:
    width = float(np.median(np.abs(fit.decays[members])))
    pad = max(APART * width, 2.0 * np.pi * _LEAST_LINES * lines.step)
    reach = float(fit.omegas[members].min()) - pad, float(fit.omegas[members].max()) + pad
    inside = (lines.frequencies >= reach[0] / (2.0 * np.pi)) & (lines.frequencies <= reach[1] / (2.0 * np.pi))
    own = fit.residual[:, inside]
    values = own + fit.model[members][:, :, inside].sum(axis=0)
    powers = np.sum(np.abs(values) ** 2, axis=1)
    rows = np.flatnonzero(powers > _FAINT * powers.max())
    if len(rows) < 2:
        return None
    poles = [_alone(lines, inside, values[[row]], width) for row in rows]
    left = sum(left for _, _, left in poles)
    allowed = search.misfit * powers[rows].sum() + _NOISE * float(np.sum(np.abs(own[rows]) ** 2))
    if left > min(allowed, _FAR_LESS * _alone(lines, inside, values[rows], width)[2]):
        return None
    omegas, decays = np.array([(omega, decay) for omega, decay, _ in poles]).T
    return _mean(members, reach, omegas, decays, powers[rows])


def _alone(
    lines: SpectralLines, inside: BoolArray, rows: ComplexArray, width: float
) -> tuple[float, float, float]:
    """``w``, ``d`` and the power left of the one pole that fits ``(k, f)`` rows best."""
    frequencies = lines.frequencies[inside]
    top = 2.0 * np.pi * float(frequencies[int(np.argmax(np.sum(np.abs(rows) ** 2, axis=0)))])
    alone = SpectralLines(frequencies, rows, lines.rate)
    fit = fit_poles(alone, np.array([top]), np.array([width]), 1)
    return float(fit.omegas[0]), float(fit.decays[0]), float(np.sum(np.abs(fit.residual) ** 2))


def _mean(
    members: IntArray,
    reach: tuple[float, float],
    omegas: FloatArray,
    decays: FloatArray,
    powers: FloatArray,
) -> MovedMode:
    shares = powers / powers.sum()
    known = float(1.0 / np.sum(shares**2))  # as many rows of one power would know the mean as well

    def scattered(values: FloatArray) -> tuple[float, float]:
        middle = float(shares @ values)
        variance = float(shares @ (values - middle) ** 2)
        return middle, float(np.sqrt(variance * known / max(known - 1.0, 1e-9)))

    (omega, spread), (decay, uneven) = scattered(omegas), scattered(decays)
    return MovedMode(
        read_only(members), reach, omega, decay, spread / known**0.5, uneven / known**0.5, spread
    )
