"""Merge neighbouring shared poles that are one mode of the structure.

Rows of transfer functions are often measured one after another: a hammer roves, a sensor is moved, the
structure warms up. A mode whose frequency differs from row to row is not a pole that all rows share, and a
fit of shared poles uses several poles for it. Mode shapes separate it from modes that are really close
together:

- Each row alone has one pole there. A row that has two shows two modes.
- The rows' own frequencies are all different. Frequencies that repeat in several rows are those of separate
  modes, each near a node in some of the rows.
- As many poles as rows are needed. Fewer that explain a hundred times more are the modes.
"""

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import uniform_filter1d

from harness.basics.arrays import BoolArray, FloatArray, IntArray, read_only
from harness.strikes.pole_fit import ComplexArray, PoleFit, SpectralLines, fit_poles
from harness.strikes.pole_search import APART, PoleSearch

_NEIGHBOURHOODS = (0.015, 0.005)
"""Greatest relative gap between poles of one mode, tried in this order. The modes of a ruler that a hammer
roved along moved by half a per cent between rows."""

_MIN_LINES = 16
"""Lines to each side of the poles that are fitted with them."""

_MIN_ROW_POWER = 1e-4
"""Fraction of the strongest row's power. Weaker rows are near a node and do not show the frequency."""

_MAX_RESIDUAL_RATIO = 0.5
"""Power that one pole a row leaves, over the power that one pole of all rows leaves."""

_NOISE = 2.0
"""Power that one pole a row may leave, over the power that the shared poles leave."""

_EXPLAINED = 0.01
"""Power that shared poles leave, over the power that one pole a row leaves, below which fewer poles than
rows are the modes."""

_SMOOTHED_LINES = 3
_PEAK_FRACTION = 0.1
"""Factor on ``PoleSearch.misfit``: a row's residual below this fraction of its highest line is no mode."""

_NOISE_PEAK = 8.0
"""Local residual power over that of the shared poles from which a row has another mode."""

_RESOLVED = 1.5
"""Half widths of the broader pole between two poles that a row alone can show as two peaks."""

_REPEATED = 0.2
"""Range of the rows' frequencies about one mode, over the gap to those about the next."""

_MIN_REPEATS = 2
"""Rows beyond one for each frequency from which coincidence does not explain that frequencies repeat."""


@dataclass(frozen=True, eq=False)
class MovedMode:
    """One mode for which the fit used several shared poles.

    Attributes:
        members: ``(m,)`` indices of the shared poles.
        reach: lowest and highest frequency, in rad/s, at which the mode explains a line.
        omega: mean frequency over the rows in rad/s, weighted by their power.
        decay: mean damping in 1/s, weighted likewise.
        omega_sigma: standard deviation of ``omega`` in rad/s.
        decay_sigma: standard deviation of ``decay`` in 1/s.
        spread: standard deviation of the frequency from row to row in rad/s; zero where the rows agree.
    """

    members: IntArray
    reach: tuple[float, float]
    omega: float
    decay: float
    omega_sigma: float
    decay_sigma: float
    spread: float

    def contains(self, omega: float) -> bool:
        """Return whether a pole at ``omega`` rad/s belongs to this mode."""
        return self.reach[0] <= omega <= self.reach[1]


@dataclass(frozen=True, eq=False)
class _RowPoles:
    """One pole of each row, fitted to that row alone.

    Attributes:
        omegas: ``(r,)`` rad/s.
        decays: ``(r,)`` 1/s.
        residual: ``(r, f)`` lines that the poles leave.
    """

    omegas: FloatArray
    decays: FloatArray
    residual: ComplexArray


def merge_poles(lines: SpectralLines, fit: PoleFit, search: PoleSearch) -> list[MovedMode]:
    """Return the groups of neighbouring shared poles that are one mode each.

    Args:
        lines: spectral lines of two rows or more; a single row has no such group.
        fit: fit of shared poles.
        search: settings; ``misfit`` is the fraction of a line's power that one pole a row may leave.
    """
    if len(lines.values) < 2:
        return []
    merged: list[MovedMode] = []
    for gap in _NEIGHBOURHOODS:
        taken = {int(member) for mode in merged for member in mode.members}
        for group in _neighbours(fit, gap):
            if len(group) > 1 and not taken.intersection(group.tolist()):
                mode = _merge_rows(lines, fit, search, group)
                merged += [] if mode is None else [mode]
    return merged


def _neighbours(fit: PoleFit, gap: float) -> list[IntArray]:
    """Return groups of pole indices whose neighbours are within a relative gap or ``APART`` half widths."""
    order = np.argsort(fit.omegas)
    if len(order) == 0:
        return []
    omegas, widths = fit.omegas[order], np.abs(fit.decays[order])
    limits = np.maximum(gap * omegas[1:], APART * np.maximum(widths[1:], widths[:-1]))
    return np.split(order, np.flatnonzero(np.diff(omegas) > limits) + 1)


def _merge_rows(
    lines: SpectralLines, fit: PoleFit, search: PoleSearch, members: IntArray
) -> MovedMode | None:
    """Return the mode that moved from row to row, or None where the poles are several modes."""
    width = float(np.median(np.abs(fit.decays[members])))
    pad = max(APART * width, 2.0 * np.pi * _MIN_LINES * lines.step)
    reach = float(fit.omegas[members].min()) - pad, float(fit.omegas[members].max()) + pad
    inside = (lines.frequencies >= reach[0] / (2.0 * np.pi)) & (lines.frequencies <= reach[1] / (2.0 * np.pi))
    shared = fit.residual[:, inside]
    values = shared + fit.model[members][:, :, inside].sum(axis=0)
    powers = np.sum(np.abs(values) ** 2, axis=1)
    rows = np.flatnonzero(powers > _MIN_ROW_POWER * powers.max())
    if len(rows) < 2:
        return None
    values, shared, powers = values[rows], shared[rows], powers[rows]
    alone = _fit_rows(lines, inside, values, width)
    left = float(np.sum(np.abs(alone.residual) ** 2))
    unexplained = float(np.sum(np.abs(shared) ** 2))
    allowed = search.misfit * powers.sum() + _NOISE * unexplained
    common = _fit_one_pole(lines, inside, values, width)
    if left > min(allowed, _MAX_RESIDUAL_RATIO * float(np.sum(np.abs(common.residual) ** 2))):
        return None
    if len(members) < len(rows) and unexplained < _EXPLAINED * left:
        return None
    second = _are_resolved(fit, members) and _has_second_mode(values, alone.residual, shared, search.misfit)
    if second or _repeats(alone.omegas):
        return None
    return _average(members, reach, alone.omegas, alone.decays, powers)


def _fit_one_pole(lines: SpectralLines, inside: BoolArray, values: ComplexArray, width: float) -> PoleFit:
    """Fit one pole to ``(k, f)`` rows of a band; ``width`` is the damping to start from in 1/s."""
    frequencies = lines.frequencies[inside]
    top = 2.0 * np.pi * float(frequencies[int(np.argmax(np.sum(np.abs(values) ** 2, axis=0)))])
    return fit_poles(SpectralLines(frequencies, values, lines.rate), np.array([top]), np.array([width]), 1)


def _fit_rows(lines: SpectralLines, inside: BoolArray, values: ComplexArray, width: float) -> _RowPoles:
    fits = [_fit_one_pole(lines, inside, row[None], width) for row in values]
    return _RowPoles(
        np.array([float(fit.omegas[0]) for fit in fits]),
        np.array([float(fit.decays[0]) for fit in fits]),
        np.array([fit.residual[0] for fit in fits]),
    )


def _has_second_mode(
    values: ComplexArray, residual: ComplexArray, shared: ComplexArray, misfit: float
) -> bool:
    """Return whether the one pole of a row leaves a peak that the shared poles explain.

    Args:
        values: ``(r, f)`` lines of the group.
        residual: ``(r, f)`` lines that one pole a row leaves.
        shared: ``(r, f)`` lines that the shared poles leave.
        misfit: fraction of a line's power that may stay unexplained.
    """

    def smooth(signal: ComplexArray) -> FloatArray:
        return np.asarray(uniform_filter1d(np.abs(signal) ** 2, _SMOOTHED_LINES, axis=1, mode="nearest"))

    power, left, explained = smooth(values), smooth(residual), smooth(shared)
    limit = np.maximum(misfit * power, _PEAK_FRACTION * misfit * power.max(axis=1, keepdims=True))
    noise = np.maximum(explained, np.mean(explained, axis=1, keepdims=True))
    return bool(np.any(left > np.maximum(limit, _NOISE_PEAK * noise)))


def _are_resolved(fit: PoleFit, members: IntArray) -> bool:
    """Return whether neighbouring poles of a group are far enough apart for two peaks in one row."""
    order = members[np.argsort(fit.omegas[members])]
    widths = np.abs(fit.decays[order])
    return bool(np.any(np.diff(fit.omegas[order]) > _RESOLVED * np.maximum(widths[1:], widths[:-1])))


def _repeats(omegas: FloatArray) -> bool:
    """Return whether the rows' frequencies are a few values, each the same in several rows."""
    ordered = np.sort(omegas)
    gaps = np.diff(ordered)
    for count in range(2, min(len(ordered) // 2, len(ordered) - _MIN_REPEATS) + 1):
        splits = np.sort(np.argsort(gaps)[-(count - 1) :])
        ranges = [float(np.ptp(part)) for part in np.split(ordered, splits + 1)]
        if max(ranges) <= _REPEATED * float(gaps[splits].min()):
            return True
    return False


def _average(
    members: IntArray,
    reach: tuple[float, float],
    omegas: FloatArray,
    decays: FloatArray,
    powers: FloatArray,
) -> MovedMode:
    """Average poles, weighted by their power; deviations are those of their scatter."""
    weights = powers / powers.sum()
    count = float(1.0 / np.sum(weights**2))  # effective number of poles of equal weight

    def scatter(values: FloatArray) -> tuple[float, float]:
        mean = float(weights @ values)
        variance = float(weights @ (values - mean) ** 2)
        return mean, float(np.sqrt(variance * count / max(count - 1.0, 1e-9)))

    (omega, spread), (decay, uneven) = scatter(omegas), scatter(decays)
    return MovedMode(
        read_only(members), reach, omega, decay, spread / count**0.5, uneven / count**0.5, spread
    )
