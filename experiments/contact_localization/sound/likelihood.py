"""How probable the sounds of a run are, given where its strikes fell.

At a peak the strikes' shares are ``y = c (G a + e)``: ``G`` the gains of the mode, or of a group of
near-equal modes, at the struck places along the strikes; ``a`` how the microphone hears each; ``c`` any
complex number; ``e`` what the model does not know. With ``a`` and ``c`` integrated out the direction
of ``y`` is complex angular central Gaussian with matrix ``G G^T + spread^2 I`` (Kent, Data analysis for
shapes and images, JSPI 57, 1997). The microphone's gains need not be known and signs between strikes count.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.special import logsumexp

from experiments.contact_localization.sound.gains import MOST_RANK, GainTable, sound_scores
from harness.basics.arrays import BoolArray, FloatArray, IntArray
from harness.basics.errors import WrongUse
from harness.basics.materials import Material
from harness.sim.modal.modes import Modes, dampings
from harness.strikes.peaks import Peak, SoundEvidence

_GRID = 1.0e-3


_FAR = 4.0
"""Sigmas of frequency at which a mode is no longer considered for a peak."""


_LEAST_DENSITY = 0.05
"""Of modes at a peak, in units of one mode right at it: with fewer about, clutter gains."""


_NEGLIGIBLE = -6.0
"""Nats behind the most probable scale at which one is left out."""


@dataclass(frozen=True)
class SoundNoise:
    """How far sound may differ from what the modes say."""

    spreads: tuple[float, ...] = (0.1, 0.4)
    """of a strike's share at a peak, in units of the mode's rms gain over the surface; some modes are as they
    were computed and some hardly, and each peak is weighed under every one."""
    frequency: float = 0.02  #: relative, one sigma of a mode's frequency about the common scale.
    scale: float = 0.05  #: relative, one sigma of the common scale.
    scale_limits: tuple[float, float] = (0.85, 1.15)  #: within which a common scale is looked for.
    scale_step: float = 0.015
    """between the logarithms of the common scales that are weighed; as ``frequency`` or finer."""
    scale_weight: float = 0.3  #: factor on the nats by which two lists of frequencies prefer a scale.
    clutter: float = 0.2  #: share of peaks that no mode explains.
    weight: float = 0.5
    """factor on a peak's nats, beside images: the model's errors are shared between peaks."""
    aside: float = 1.0e-3
    """metres, one sigma along each axis of the object, beside images: by so much places that sound tells are
    off together, as its modes, the hammer's mount and the object's attitude are."""
    alone: float = 0.2  #: ``weight`` by sound alone, where nothing names the errors that contacts share.
    group: float = 0.01  #: modes whose frequencies differ by less than this share mix freely.
    pair: float = 0.05
    """relative difference in frequency up to which the two modes of a round object's pair mix freely."""
    most: int = 3  #: modes in one group at most; at most ``density.MOST_RANK``.


@dataclass(frozen=True, eq=False)
class Scales:
    """Common factors between a real object's frequencies and its model's."""

    factors: FloatArray  #: ``(S,)`` real frequency over the model's, most probable first.
    log_shares: FloatArray  #: ``(S,)`` nats, of shares that sum to 1.


@dataclass(frozen=True, eq=False)
class Pairs:
    """Which group of modes may sound at which peak, pairs of a peak side by side."""

    starts: IntArray  #: ``(P + 1,)`` first pair of each peak.
    groups: IntArray  #: ``(Q,)`` group of each pair.
    shares: FloatArray  #: ``(S, Q)`` prior share of a pair in its peak, under each scale.
    clutter: FloatArray  #: ``(S, P)`` share left for anything else.

    def under(self, scale: int) -> "Pairs":
        """The same, were one scale the only one."""
        one = slice(scale, scale + 1)
        return Pairs(self.starts, self.groups, self.shares[one], self.clutter[one])


@dataclass(frozen=True)
class ModeRow:
    """One row of the table of peaks and modes."""

    frequency: float  #: Hz, of the peak.
    damping: float  #: 1/s, as heard.
    residual: float  #: share of the peak's band that is not one waveform.
    level: float  #: dB against the strongest peak.
    modes: tuple[int, ...]
    """numbers of the matched group's modes, from 0; empty for a peak that no mode explains."""
    model_frequency: float  #: Hz, of the matched modes, under the scale; 0 where there is none.
    model_damping: float  #: 1/s, of the matched modes; 0 where there is none.
    probability: float  #: of the match.
    nats: float  #: that the peak adds at the given places, over a peak that says nothing.


@dataclass(frozen=True, eq=False)
class _Heard:
    """Peaks as ``sound_scores`` takes them."""

    rows: FloatArray
    real: FloatArray
    imaginary: FloatArray
    counts: IntArray
    offsets: FloatArray


@dataclass(frozen=True, eq=False)
class _Struck:
    """Places and ways of strikes as ``sound_scores`` takes them."""

    samples: IntArray
    blend: FloatArray
    directions: FloatArray


class SoundTerm:
    """The sounds of one run as a term of its posterior."""

    def __init__(
        self,
        evidence: SoundEvidence,
        table: GainTable,
        modes: Modes,
        material: Material,
        noise: SoundNoise | None = None,
    ) -> None:
        """Prepare the term.

        Args:
            evidence: of the run's strikes.
            table: of the modes, at any spacing.
            modes: of the object.
            material: for the damping that the modes should have.
            noise: of the term.

        Raises:
            WrongUse: a group may be larger than the kernel takes.
        """
        noise = noise or SoundNoise()
        if not 1 <= noise.most <= MOST_RANK:
            raise WrongUse(f"groups of {noise.most} modes were asked for; 1 to {MOST_RANK} can be weighed")
        self.evidence = evidence  #: what the strikes said.
        self._table, self._modes, self._material, self._noise = table, modes, material, noise
        self._starts = group_starts(modes.frequencies, table.rotation_pairs, noise)
        self._peaks = evidence.peaks if len(modes.frequencies) else ()
        frequencies = np.array([peak.frequency for peak in self._peaks])
        self.scales: Scales = likely_scales(frequencies, modes.frequencies, noise)
        """frequency scales between object and model, most probable first."""
        self._pairs = _find_groups(frequencies, self._group_frequencies(), self.scales.factors, noise)
        squares = self._table.mean_squares
        result = np.empty(len(squares))
        for a, b in zip(self._starts[:-1], self._starts[1:], strict=True):
            result[a:b] = 1.0 / np.sqrt(squares[a:b].mean())
        self._gain_scales = np.asarray(result / np.array(self._noise.spreads)[:, None])

    @property
    def weight(self) -> float:
        """Factor on every peak's nats."""
        return self._noise.weight

    @property
    def aside(self) -> float:
        """Metres, one sigma along each axis: how far all strikes fell aside, by what they say."""
        return self._noise.aside

    @property
    def says_something(self) -> bool:
        """Whether any peak can set places apart."""
        return len(self._pairs.groups) > 0

    def log_likelihood(self, points: FloatArray, directions: FloatArray, between: bool = False) -> FloatArray:
        """``(h,)`` nats of hypotheses, 0 for sounds that say nothing.

        Args:
            points: ``(h, K, 3)`` metres, in the object's frame: where each strike fell.
            directions: ``(h, K, 3)`` or ``(K, 3)`` unit, in the object's frame: where the hammer went.
            between: whether gains are interpolated between samples, which takes longer, or are the
                nearest sample's.

        Raises:
            WrongUse: shapes that are not those of the evidence's strikes.
        """
        strikes = len(self.evidence.used)
        if points.ndim != 3 or points.shape[1:] != (strikes, 3):
            raise WrongUse(
                f"points of shape {points.shape} were given; {strikes} strikes need (h, {strikes}, 3)"
            )
        if directions.shape not in ((strikes, 3), points.shape):
            raise WrongUse(
                f"directions of shape {directions.shape} were given; ({strikes}, 3) or {points.shape} wanted"
            )
        if not self.says_something or len(points) == 0:
            return np.zeros(len(points))
        struck = self._struck(points, directions, between)
        return self._scores(struck, self._heard, self._pairs, self.scales.log_shares, self._noise.weight)

    def mode_table(self, points: FloatArray, directions: FloatArray) -> tuple[ModeRow, ...]:
        """Every peak with the group of modes that explains it best at one set of places.

        Args:
            points: ``(K, 3)`` metres, in the object's frame.
            directions: ``(K, 3)`` unit.
        """
        struck = self._struck(points[None], directions, between=True)
        shares = self._scale_shares(struck)
        return tuple(self._row(index, struck, shares) for index in range(len(self._peaks)))

    def scale_at(self, points: FloatArray, directions: FloatArray) -> float:
        """The most probable factor between the object's frequencies and the model's, at one set of places.

        Args:
            points: ``(K, 3)`` metres, in the object's frame.
            directions: ``(K, 3)`` unit.
        """
        shares = self._scale_shares(self._struck(points[None], directions, between=True))
        return float(self.scales.factors[int(np.argmax(shares))])

    @cached_property
    def _heard(self) -> _Heard:
        return _whitened(self._peaks, self._noise.spreads)

    def _struck(self, points: FloatArray, directions: FloatArray, between: bool) -> _Struck:
        """Of ``(h, K, 3)`` points and ``(h, K, 3)`` or ``(K, 3)`` directions."""
        strikes = len(self.evidence.used)
        flat = points.reshape(-1, 3)
        if between:
            samples, blend = self._table.about(flat)
        else:
            samples, blend = self._table.nearest(flat)[:, None], np.ones((len(flat), 1))
        shape = (len(points), strikes, samples.shape[1])
        return _Struck(
            samples.reshape(shape),
            blend.reshape(shape),
            np.ascontiguousarray(directions.reshape(-1, strikes, 3)),
        )

    def _scale_shares(self, struck: _Struck) -> FloatArray:
        """``(S,)``: how probable each scale is at one set of places, summing to 1."""
        nats = self.scales.log_shares.copy()
        for s in range(len(nats) if self.says_something else 0):
            nats[s] += self._scores(
                struck, self._heard, self._pairs.under(s), np.zeros(1), self._noise.weight
            )[0]
        return np.asarray(np.exp(nats - logsumexp(nats)))

    def _scores(
        self, struck: _Struck, heard: _Heard, pairs: Pairs, log_shares: FloatArray, weight: float
    ) -> FloatArray:
        return sound_scores(
            self._table.shapes,
            struck.samples,
            struck.blend,
            struck.directions,
            self._gain_scales,
            heard.rows,
            heard.real,
            heard.imaginary,
            heard.counts,
            heard.offsets,
            pairs.starts,
            pairs.groups,
            self._starts,
            pairs.shares,
            pairs.clutter,
            weight,
            log_shares,
        )

    def _group_frequencies(self) -> FloatArray:
        logs = np.log(self._modes.frequencies)
        return np.array(
            [np.exp(logs[a:b].mean()) for a, b in zip(self._starts[:-1], self._starts[1:], strict=True)]
        )

    def _row(self, index: int, struck: _Struck, scale_shares: FloatArray) -> ModeRow:
        peak, pairs = self._peaks[index], self._pairs
        span = range(int(pairs.starts[index]), int(pairs.starts[index + 1]))
        factor = self.scales.factors[int(np.argmax(scale_shares))]
        odds = np.array(
            [scale_shares @ pairs.clutter[:, index]] + [scale_shares @ pairs.shares[:, q] for q in span]
        )
        fits = np.array([0.0] + [self._fit_of(peak, int(pairs.groups[q]), struck) for q in span])
        total = float(np.sum(odds * np.exp(fits)))
        chances = odds * np.exp(fits) / total
        best = int(np.argmax(chances))
        group = int(pairs.groups[span[best - 1]]) if best else -1
        modes = tuple(range(int(self._starts[group]), int(self._starts[group + 1]))) if best else ()
        at = np.array([self._group_frequencies()[group]]) if best else np.zeros(0)
        return ModeRow(
            peak.frequency,
            peak.damping,
            peak.residual,
            peak.level,
            modes,
            float(at[0] * factor) if best else 0.0,
            float(dampings(at * factor, self._material)[0]) if best else 0.0,
            float(chances[best]),
            float(np.log(total)),
        )

    def _fit_of(self, peak: Peak, group: int, struck: _Struck) -> float:
        """Nats of one peak if one group of modes made it."""
        sure = Pairs(
            np.array([0, 1], dtype=np.int64),
            np.array([group], dtype=np.int64),
            np.ones((1, 1)),
            np.zeros((1, 1)),
        )
        heard = _whitened((peak,), self._noise.spreads)
        return float(self._scores(struck, heard, sure, np.zeros(1), 1.0)[0])


def _whitened(peaks: tuple[Peak, ...], spreads: tuple[float, ...]) -> _Heard:
    """The peaks' shares divided by what each spread leaves of them, and the nats of that division."""
    rows, ys, offsets = [], [], []
    for spread in spreads:
        for peak in peaks:
            unit = np.sqrt(np.mean(np.abs(peak.y[peak.heard]) ** 2))
            row = peak.heard / np.hypot(1.0, peak.sigma / (spread * unit))
            length = float(np.linalg.norm(row * peak.y))
            rows.append(row)
            ys.append(row * peak.y / length)
            logs = 2.0 * np.log(row[peak.heard])
            offsets.append(float(np.sum(logs - 2.0 * np.log(length / np.linalg.norm(peak.y)))))
    shape = (len(spreads), len(peaks))
    y = np.array(ys).reshape(*shape, -1)
    return _Heard(
        np.array(rows).reshape(y.shape),
        np.ascontiguousarray(y.real),
        np.ascontiguousarray(y.imag),
        np.array([peak.heard.sum() for peak in peaks], dtype=np.int64),
        np.array(offsets).reshape(shape) - np.log(len(spreads)),
    )


def group_starts(frequencies: FloatArray, pairs: BoolArray, noise: SoundNoise) -> IntArray:
    """Return ``(G + 1,)`` the first mode of every group of near-equal frequencies.

    Within a group the eigenvectors are any rotation of each other, and a small asymmetry of the real
    object picks another one; a group is therefore taken whole.

    Args:
        frequencies: ``(m,)`` frequencies in Hz, ascending.
        pairs: ``(m - 1,)`` whether a mode and the next one are a pair of a round object, which its
            asymmetries may split further.
        noise: widths of the groups.
    """
    starts = [0]
    for mode in range(1, len(frequencies)):
        width = noise.pair if pairs[mode - 1] else noise.group
        close = frequencies[mode] < (1.0 + width) * frequencies[mode - 1]
        if not close or mode - starts[-1] >= noise.most:
            starts.append(mode)
    return np.array([*starts, len(frequencies)] if len(frequencies) else [0], dtype=np.int64)


def likely_scales(peaks: FloatArray, modes: FloatArray, noise: SoundNoise) -> Scales:
    """Common factors under which the peaks fall on modes.

    Each peak is a normal mixture over the modes in log frequency, or clutter anywhere between them; the
    factor is normal about 1. Where modes are dense their frequencies hardly tell one factor from another,
    so that all that are likely are kept: the places struck must tell.

    Args:
        peaks: ``(P,)`` Hz.
        modes: ``(m,)`` Hz.
        noise: of the frequencies.
    """
    low, high = np.log(noise.scale_limits)
    grid = np.linspace(low, high, int(np.ceil((high - low) / _GRID)) + 1)
    score = np.zeros(len(grid))
    if len(peaks) and len(modes):
        gaps = np.log(peaks)[None, :, None] - np.log(modes)[None, None, :] - grid[:, None, None]
        near = np.exp(-0.5 * (gaps / noise.frequency) ** 2).sum(axis=2)
        density = near / (len(modes) * noise.frequency * np.sqrt(2.0 * np.pi))
        reach = float(np.log(modes.max() / modes.min())) + high - low
        score += np.log((1.0 - noise.clutter) * density + noise.clutter / reach).sum(axis=1)
    total = -0.5 * (grid / noise.scale) ** 2 + noise.scale_weight * score
    # At even steps about the most probable, which comes first; what hardly weighs is left out.
    nats = total - total.max()
    apart = max(1, round(noise.scale_step / (grid[1] - grid[0])))
    chosen = np.arange(int(np.argmax(nats)) % apart, len(grid), apart)
    chosen = chosen[nats[chosen] > _NEGLIGIBLE]
    chosen = chosen[np.argsort(-nats[chosen], kind="stable")]
    return Scales(np.exp(grid[chosen]), nats[chosen] - logsumexp(nats[chosen]))


def _find_groups(peaks: FloatArray, groups: FloatArray, factors: FloatArray, noise: SoundNoise) -> Pairs:
    """Find the groups of modes near each peak at each of ``(S,)`` frequency scales."""
    starts, found, shares = [0], [], []
    clutter = np.ones((len(factors), len(peaks)))
    for index, peak in enumerate(peaks):
        sigmas = (np.log(peak) - np.log(groups)[None] - np.log(factors)[:, None]) / noise.frequency
        density = np.where(np.abs(sigmas) < _FAR, np.exp(-0.5 * sigmas**2), 0.0)
        share = (1.0 - noise.clutter) * density / (density.sum(axis=1, keepdims=True) + _LEAST_DENSITY)
        near = np.nonzero(share.any(axis=0))[0]
        found.extend(near.tolist())
        shares.append(share[:, near])
        clutter[:, index] = 1.0 - share.sum(axis=1)
        starts.append(len(found))
    joined = np.concatenate(shares, axis=1) if shares else np.zeros((len(factors), 0))
    return Pairs(
        np.array(starts, dtype=np.int64),
        np.array(found, dtype=np.int64),
        np.ascontiguousarray(joined),
        clutter,
    )
