"""Poles from spectral lines: separable least squares, every pole pair in two real numbers.

A damped mode of undamped frequency ``w`` and decay ``d`` has the pole pair ``-d +- sqrt(d^2 - w^2)``,
conjugate below critical damping and real beyond it; its characteristic polynomial ``A`` is real and
smooth in ``w`` and ``d`` through the critical point, and so is what is fitted here:

- transfer functions: ``(a + b s) / (s^2 + 2 d s + w^2)``, ``s = i 2 pi f``;
- lines of a free decay, its discrete Fourier transform over whatever time was recorded:
  ``(a + b q) / ((1 - q exp(p / rate)) (1 - q exp(p' / rate)))``, ``q = exp(-i 2 pi f / rate)``. A
  recursion of two real coefficients gives every sample of the decay, and on the lines of a transform of
  the same length the end that is cut off adds to the numerator only: no window, and no leakage.

The numerators are linear and eliminated (variable projection: Golub and Pereyra, 1973; the Jacobian is
Kaufman's, 1975), so that only ``w`` and ``d`` of every mode are searched. A polynomial of a few terms
stands for the skirts of modes out of the band. All channels share the poles.
"""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from numpy.polynomial import chebyshev
from scipy.ndimage import median_filter, uniform_filter1d
from scipy.optimize import least_squares

from harness.basics.arrays import AnyArray, FloatArray, read_only

ComplexArray = npt.NDArray[np.complex128]

_DAMPED = (-0.05, 20.0)
"""Of ``d`` over where ``w`` starts: what is searched. Noise may bring a decay below zero."""

_BEYOND = np.array([0.5, 1.05])
"""Of the first and the last line: where poles are searched."""

_TOLERANCE, _MOST_STEPS = 1e-12, 60

_LEAST_CHANNELS = 3
"""From which their disagreement says something."""

_NEIGHBOURS = 16
"""Lines to each side over which the noise is taken to be as strong as at a line."""

_MEDIAN_COSTS = 1.0 / np.log(2.0) ** 2
"""Variance of the median of an exponential distribution over that of its mean, both scaled to the mean."""

APART = 8
"""Half widths from a stronger peak within which a peak waits for the next round."""


@dataclass(frozen=True, eq=False)
class SpectralLines:
    """Spectral lines of one structure."""

    frequencies: FloatArray  #: ``(f,)`` Hz, evenly spaced, above zero.
    values: ComplexArray  #: ``(k, f)``, a row a channel.
    rate: float | None  #: samples per second of the decay that they transform; None of transfer functions.

    @property
    def step(self) -> float:
        """Hz from line to line."""
        return float(self.frequencies[1] - self.frequencies[0])

    def between(self, low: float, high: float) -> "SpectralLines":
        """Those of a band, in Hz."""
        kept = (self.frequencies >= low) & (self.frequencies <= high)
        return SpectralLines(self.frequencies[kept], self.values[:, kept], self.rate)


@dataclass(frozen=True, eq=False)
class PoleFit:
    """Poles that fit lines best."""

    omegas: FloatArray  #: ``(m,)`` rad/s, undamped.
    decays: FloatArray  #: ``(m,)`` 1/s.
    covariance: FloatArray
    """``(2 m, 2 m)`` of the relative errors of ``omegas``, then of the decays over ``omegas``."""
    model: ComplexArray  #: ``(m, k, f)`` what each mode adds to each line.
    residual: ComplexArray  #: ``(k, f)`` what the modes and the skirts leave.


def fit_poles(lines: SpectralLines, omegas: FloatArray, decays: FloatArray, skirt: int) -> PoleFit:
    """Refine ``(m,)`` poles in rad/s and 1/s by least squares on at least as many lines as unknowns.

    ``skirt`` is the number of terms of the polynomial of distant modes.
    """
    problem = _Problem(lines, omegas, skirt)
    if len(omegas) == 0:
        return problem.fitted(np.zeros(0))
    edges = 2.0 * np.pi * lines.frequencies[[0, -1]] * _BEYOND
    low = np.concatenate([np.log(edges[0] / omegas), np.full(len(omegas), _DAMPED[0])])
    high = np.concatenate([np.log(edges[1] / omegas), np.full(len(omegas), _DAMPED[1])])
    inside = 1e-6 * (high - low)
    start = np.clip(np.concatenate([np.zeros(len(omegas)), decays / omegas]), low + inside, high - inside)
    found = least_squares(
        problem.residual, start, problem.jacobian, (low, high), method="trf", x_scale="jac",
        xtol=_TOLERANCE, ftol=_TOLERANCE, gtol=None, max_nfev=_MOST_STEPS,
    )  # fmt: skip
    return problem.fitted(found.x)


class _Problem:
    """One fit; remembers the projection of the last poles it was asked for.

    The unknowns are ``log(w / w0)`` and ``d / w0`` of every mode, ``w0`` where it starts.
    """

    def __init__(self, lines: SpectralLines, starts: FloatArray, skirt: int) -> None:
        self._lines = lines
        self._starts = starts
        self._size = float(np.linalg.norm(lines.values)) or 1.0
        self._right = _stacked(lines.values.T / self._size)
        spread = np.linspace(-1.0, 1.0, len(lines.frequencies))
        terms = chebyshev.chebvander(spread, max(0, skirt - 1))[:, :skirt].astype(np.complex128)
        self._skirt = np.concatenate([_stacked(terms), _stacked(1j * terms)], axis=1)
        self._at: FloatArray | None = None

    def residual(self, unknowns: FloatArray) -> FloatArray:
        self._project(unknowns)
        return np.asarray(self._left.T.ravel())

    def jacobian(self, unknowns: FloatArray) -> FloatArray:
        """``(2 f k, 2 m)`` by Kaufman: what a pole's motion adds, less what the linear terms take up."""
        self._project(unknowns)
        motions = np.concatenate([self._motion(self._by_omega), self._motion(self._by_decay)])
        free = motions - self._basis @ (self._basis.T @ motions)
        return -np.ascontiguousarray(np.transpose(free, (0, 2, 1))).reshape(len(motions), -1).T

    def fitted(self, unknowns: FloatArray) -> PoleFit:
        self._project(unknowns)
        count, channels = len(self._starts), len(self._lines.values)
        omegas, decays = self._poles(unknowns)
        left = self._size * (self._left[: len(self._left) // 2] + 1j * self._left[len(self._left) // 2 :])
        parts = np.zeros((count, channels, len(self._lines.frequencies)), np.complex128)
        for mode in range(count):
            columns, weights = self._columns[:, [mode, count + mode]], self._weights[[mode, count + mode]]
            parts[mode] = self._size * (columns @ weights).T
        return PoleFit(
            read_only(omegas),
            read_only(decays),
            read_only(self._covariance(unknowns)),
            parts,
            np.asarray(left.T),
        )

    def _covariance(self, unknowns: FloatArray) -> FloatArray:
        """Of what the fit left, relative to ``w``: the greater of two estimates for each unknown.

        One takes errors to be independent from line to line and as strong as the residual about each.
        The other takes them to be independent from channel to channel only (the sandwich of Liang
        and Zeger, 1986), which says how far the channels disagree about a pole.
        """
        count = len(self._starts)
        if count == 0:
            return np.zeros((0, 0))
        motions = self.jacobian(unknowns)
        inverse = np.linalg.pinv(motions)
        spread = (inverse * self._variance()) @ inverse.T
        channels = self._left.shape[1]
        if channels >= _LEAST_CHANNELS:
            pulls = (inverse * self.residual(unknowns)).reshape(2 * count, channels, -1).sum(axis=2)
            disagreement = np.sum(pulls**2, axis=1) * channels / (channels - 1)
            more = np.sqrt(np.maximum(1.0, disagreement / np.maximum(np.diag(spread), 1e-300)))
            spread = spread * np.outer(more, more)
        scale = np.concatenate([np.ones(count), np.exp(-unknowns[:count])])
        return np.asarray(spread * np.outer(scale, scale))

    def _variance(self) -> FloatArray:
        """``(2 f k,)``: of each row of the residual, from the lines about it."""
        half, channels = len(self._left) // 2, self._left.shape[1]
        power = self._left[:half] ** 2 + self._left[half:] ** 2
        local = uniform_filter1d(power, 2 * _NEIGHBOURS + 1, axis=0, mode="nearest")
        spent = self._basis.shape[1] * channels + 2 * len(self._starts)
        share = self._left.size / max(self._left.size - spent, 1)
        return np.asarray(0.5 * share * np.concatenate([local, local]).T.ravel())

    def _poles(self, unknowns: FloatArray) -> tuple[FloatArray, FloatArray]:
        count = len(self._starts)
        return self._starts * np.exp(unknowns[:count]), self._starts * unknowns[count:]

    def _project(self, unknowns: FloatArray) -> None:
        if self._at is not None and np.array_equal(self._at, unknowns):
            return
        omegas, decays = self._poles(unknowns)
        turn, inverse, by_omega, by_decay = _characteristic(self._lines, omegas, decays)
        columns = np.concatenate([inverse, turn * inverse], axis=1)
        design = np.concatenate([_stacked(columns), self._skirt], axis=1)
        lengths = np.linalg.norm(design, axis=0)
        basis, upper = np.linalg.qr(design / lengths)
        along = basis.T @ self._right
        weights = np.linalg.lstsq(upper, along, rcond=None)[0] / lengths[:, None]
        self._basis, self._columns, self._weights = basis, columns, weights
        self._left = self._right - basis @ along
        self._by_omega = by_omega * omegas
        self._by_decay = by_decay * self._starts
        self._at = unknowns.copy()

    def _motion(self, slopes: AnyArray) -> FloatArray:
        """``(m, 2 f, k)``: what changes as ``A`` does, by ``slopes`` over ``A``."""
        count = len(self._starts)
        moved = []
        for mode in range(count):
            columns, weights = self._columns[:, [mode, count + mode]], self._weights[[mode, count + mode]]
            moved.append(_stacked(-slopes[:, mode, None] * (columns @ weights)))
        return np.array(moved)


def _characteristic(
    lines: SpectralLines, omegas: FloatArray, decays: FloatArray
) -> tuple[AnyArray, AnyArray, AnyArray, AnyArray]:
    """``(f, m)``: the second numerator, ``1 / A``, and the slopes of ``log A`` by ``w`` and by ``d``."""
    turns = 2j * np.pi * lines.frequencies[:, None]
    if lines.rate is None:
        values = omegas**2 + turns * (2.0 * decays + turns)
        return turns / omegas, 1.0 / values, 2.0 * omegas / values, 2.0 * turns / values
    lag = 1.0 / lines.rate
    split = np.sqrt((decays**2 - omegas**2).astype(np.complex128))
    back = np.exp(-turns * lag)
    values = np.expm1((split - decays - turns) * lag) * np.expm1((-split - decays - turns) * lag)
    fall = np.exp(-decays * lag)
    # d cosh(split lag) / d (split^2), smooth through the critical point.
    bend = 0.5 * lag**2 * np.sinc(1j * split * lag / np.pi).real
    by_split = -2.0 * back * fall * bend
    sum_of_two = 2.0 * fall * np.cosh(split * lag).real
    by_fall = lag * (back * sum_of_two - 2.0 * back**2 * fall**2)
    by_omega = -2.0 * omegas * by_split
    by_decay = by_fall + 2.0 * decays * by_split
    return back, 1.0 / values, by_omega / values, by_decay / values


def _stacked(values: ComplexArray) -> FloatArray:
    """Real parts over imaginary ones."""
    return np.concatenate([values.real, values.imag])


@dataclass(frozen=True)
class PoleSearch:
    """How modes are looked for."""

    low: float = 0.0  #: Hz, of the band that is fitted.
    high: float | None = None  #: Hz; None for half the rate, or the last line.
    most: int = 40  #: modes at most.
    false_alarm: float = 1e-3  #: chance that noise alone is taken for a mode, in all of the band.
    misfit: float = 0.02
    """share of a line's power that may stay unexplained without there being another mode."""
    floor_reach: int = 100  #: lines to each side over whose median the noise is known.
    prominence: float = 6.0  #: dB that a peak of the residual stands above what surrounds it.
    skirt: int = 3  #: terms of the polynomial that stands for modes out of the band.


def new_poles(
    lines: SpectralLines, fit: PoleFit, search: PoleSearch, rounding: float
) -> list[tuple[float, float]]:
    """Find peaks of the residual, strongest first: initial ``w`` in rad/s and ``d`` in 1/s of a fit.

    Lines below ``rounding`` times the strongest line of a channel are rounding errors.
    """
    power = np.abs(fit.residual) ** 2
    reach = min(2 * search.floor_reach + 1, power.shape[1])
    # The mean of an exponential distribution is its median over log 2.
    floor = median_filter(power, size=(1, reach), mode="reflect") / np.log(2.0)
    least = (rounding * np.abs(lines.values).max(axis=1, keepdims=True)) ** 2
    sizes = np.sum(power / np.maximum(floor, least), axis=0)
    channels, count = power.shape
    # The floor is itself an estimate: a median of n is worth a mean of n / 2.08.
    known = 2.0 * channels * reach / _MEDIAN_COSTS
    # Imported here, because they take half a second and most commands do not need them.
    from scipy.signal import find_peaks
    from scipy.stats import f as f_distribution

    threshold = channels * float(f_distribution.isf(search.false_alarm / count, 2.0 * channels, known))
    level = 10.0 * np.log10(np.maximum(sizes, 1e-30))
    padded = np.concatenate([[-300.0], level, [-300.0]])
    tops = find_peaks(padded, height=10.0 * np.log10(threshold), prominence=search.prominence)[0] - 1
    everything = np.sum(np.abs(lines.values) ** 2, axis=0)
    left = np.sum(power, axis=0)
    tops = tops[left[tops] > search.misfit * everything[tops]]
    return _select_peaks(lines, fit, left, tops[np.argsort(-left[tops])])


def _select_peaks(
    lines: SpectralLines, fit: PoleFit, power: FloatArray, tops: AnyArray
) -> list[tuple[float, float]]:
    """Select the peaks that no stronger peak can explain, by its tail or as a poorly fitted mode."""
    chosen: list[tuple[float, float]] = []
    reach: list[tuple[float, float]] = []
    known, widths = fit.omegas / (2.0 * np.pi), fit.decays / (2.0 * np.pi)
    for top in tops:
        frequency = float(lines.frequencies[top])
        # Hz from the peak to where it has half its power, on its steeper side.
        below = power < 0.5 * power[top]
        sides = np.flatnonzero(below[top:]), np.flatnonzero(below[top::-1])
        steeper = min([int(side[0]) for side in sides if len(side)], default=1)
        half = max(0.5, steeper - 0.5) * lines.step
        beside = np.abs(known - frequency) < 2.0 * APART * widths
        broad = max(half, 2.0 * float(widths[beside].max(initial=0.0)))
        if all(abs(frequency - other) > APART * max(broad, breadth) for other, breadth in reach):
            reach.append((frequency, broad))
            # A hump at the lowest lines is a mode near critical damping, as fast as it is broad.
            chosen.append((2.0 * np.pi * max(frequency, half), 2.0 * np.pi * half))
    return chosen
