"""The shadows that a pressed ball throws over the gel, from the same presses as the colours.

What slopes, skirt and light of a press (``light_fit``) leave over is looked at along rays from the rim of
the contact. A shadow is a wedge that is darker than explained, on the side away from the light of its colour;
the light is seen in the slopes' own colours, whose dark side is the shadow's. Where a wedge is hardly darker
than other places are too bright, or lies towards the light, nothing is fitted: it is said why.

Balls of one depth show the shadows of one depth. For others the law of the nine depths that Taxim published
is taken: samples move out in proportion to the depth of the rim, and darken with its square root. From the
deepest of those nine it gives the other eight to 3.6 grey levels rms, where the same shadow at every depth is
16.5 off and no shadow 23.4 (``tests/benchmarks/touch/real_shadows.py law``).

``around`` samples the presses by direction and by distance from the rim. Its polar grid is that of
``harness.sim.optics.shadow``: rays that start at the outermost pixel of a contact's rim, with a sample every
so many pixels.
"""

from dataclasses import dataclass

import numpy as np
from scipy import ndimage
from scipy.ndimage import map_coordinates

from calibration.taxim.held_out import HeldOut, decibels
from calibration.taxim.light_fit import REACH, GelLight, light_shades, pressed_ball
from calibration.taxim.pictures import PressPack
from calibration.taxim.smooth_fit import distance
from harness.basics.arrays import BoolArray, FloatArray, IntArray, read_only
from harness.sim.optics.shadow import RIM, ShadowTable, soft_shadows

COLOURS = ("red", "green", "blue")

LEAST = 2.0
"""Grey levels, of a sample of a shadow; and no fewer than twice its own standard error."""

DEEPEST = 4.0
"""Grey levels that a shadow's darkest sample must have, at the least."""

OVER_MISFIT = 1.5
"""Times by which it must be darker than anything that far out is too bright: what colours are off by."""

_ASIDE = np.radians(75.0)
"""From the dark side of the slopes: further off a dark wedge is no shadow of that light."""

_SMOOTH = (1.0, 1.0)
"""Directions and samples, sigma of the blur of the medians."""

_LEAST_PRESSES = 8
"""That must show a sample."""

_MEDIAN_ERROR = 1.2533
"""Of a median against a mean, of Gaussian errors."""

_NONE = 255.0
"""Grey levels, a sample that darkens nothing."""

ROWS = 8
"""Of depths."""

DIRECTIONS = 64
SAMPLE_STEP = 1.25
"""Pixels, as the published tables have it."""

WITHIN = 0.7
"""Of the contact's radius: where its slopes show which way the light comes."""

OWN = 1.0
"""Grey levels by which a shadow moves a pixel that is its own."""

LEAST_PIXELS = 20
"""Of a press, for it to be scored."""

LEAST_GAIN = 0.3
"""dB in the median over the shadow's own pixels; and two presses in three must gain."""

_SHARE = 2.0 / 3.0


@dataclass(frozen=True)
class ColourShadow:
    """What presses show of one colour's shadow."""

    colour: str  #: red, green or blue.
    missing: str  #: why it is not drawn; empty where it is.
    falls: float
    """rad, direction in the picture (from columns towards rows) in which the shadow falls; the light comes
    from the other side. NaN where nothing is darker than explained."""
    falls_error: float  #: rad, one standard error, by the presses' scatter.
    dark_side: float  #: rad, where slopes turn the gel away from that light.
    deepest: float  #: grey levels by which the darkest sample is darker than explained.
    deepest_error: float  #: one standard error of it.
    misfit: float  #: grey levels by which the brightest sample is brighter than explained: what is no shadow.
    reach: float  #: pixels from the rim within which half of the shadow's darkness lies.
    wide: float  #: rad, of all directions that are shaded.


@dataclass(frozen=True, eq=False)
class ShadowFit:
    """The shadows of a set of presses."""

    table: ShadowTable | None  #: with depths in pixels of indentation; None where no colour throws any.
    colours: tuple[ColourShadow, ...]  #: red, green, blue.
    rim: float  #: pixels of indentation, of the rim that was seen.
    directions: FloatArray  #: ``(d,)`` rad, of the rays.
    typical: FloatArray  #: ``(3, d, samples)`` grey levels that presses leave over along them, median.
    cells: BoolArray  #: ``(3, d, samples)`` what is taken for a shadow.

    def in_metres(self, pitch: float) -> ShadowTable | None:
        """The table as simulators take it; ``pitch`` in metres a pixel."""
        one = self.table
        if one is None:
            return None
        return ShadowTable(
            one.directions, one.lengths, one.values, pitch * one.shallowest, pitch * one.depth_step
        )


def fit_shadow(pack: PressPack, clean: FloatArray, centres: FloatArray, light: GelLight) -> ShadowFit:
    """Fit the shadows of presses.

    Args:
        pack: the presses.
        clean: ``(presses, rows, columns, 3)`` grey levels against the untouched gel.
        centres: ``(presses, 2)`` pixels (column, row), of the balls' axes.
        light: slopes, skirt and light of the same presses.
    """
    seen = around(pack, clean, centres, light)
    known = np.isfinite(seen.left[..., 0]).sum(axis=0)
    enough = known >= _LEAST_PRESSES
    found = [_colour(seen, c, enough, known) for c in range(3)]
    depth = float(np.interp(seen.starts, np.arange(len(light.profile.height)), light.profile.height).mean())
    # Of every colour and direction the grey levels that its shadow holds it down to, outwards from the rim.
    lists: list[list[FloatArray]] = []
    for c, (_, cells) in enumerate(found):
        level = np.where(cells, _typical(seen.seen[..., c], enough), _NONE)
        ends = [1 + int(np.flatnonzero(one)[-1]) if one.any() else 0 for one in cells]
        lists.append([level[d, :end] for d, end in enumerate(ends)])
    drawn = any(len(one) for colour in lists for one in colour)
    table = _table(seen.directions, lists, depth) if drawn else None
    typical = read_only(np.stack([_typical(seen.left[..., c], enough) for c in range(3)]))
    cells = read_only(np.stack([cells for _, cells in found]))
    return ShadowFit(table, tuple(colour for colour, _ in found), depth, seen.directions, typical, cells)


@dataclass(frozen=True, eq=False)
class Around:
    """Presses on one polar grid about their contacts."""

    directions: FloatArray  #: ``(d,)`` rad, in the picture: from the columns' direction towards the rows'.
    starts: FloatArray  #: ``(d,)`` pixels from the axis where rays begin: the outermost pixel of the rim.
    seen: FloatArray
    """``(presses, d, samples, 3)`` grey levels against the untouched gel; NaN outside the picture."""
    left: FloatArray  #: the same less what slopes, skirt and light explain.
    within: FloatArray
    """``(d, 3)`` grey levels that are explained within the contact, where no shadow falls."""


def _colour(seen: Around, c: int, enough: BoolArray, known: IntArray) -> tuple[ColourShadow, BoolArray]:
    """What is known of one colour, and which ``(directions, samples)`` its shadow takes."""
    left = seen.left[..., c]
    typical = _typical(left, enough)
    error = _MEDIAN_ERROR * np.nanstd(np.where(enough, left, 0.0), axis=0) / np.sqrt(np.maximum(known, 1))
    dark_side = float(np.angle(-(seen.within[:, c] * np.exp(1j * seen.directions)).sum()) % (2.0 * np.pi))
    turned: FloatArray = (seen.directions - dark_side + np.pi) % (2.0 * np.pi) - np.pi
    aside = np.abs(turned) < _ASIDE
    dark = (typical < -np.maximum(LEAST, 2.0 * error)) & enough & aside[:, None]
    cells = _largest(dark, typical)
    misfit = float(typical[enough].max(initial=0.0))
    if not cells.any():
        sentence = f"nothing away from the light is darker than explained by {LEAST:g} grey levels or more"
        nothing = ColourShadow(COLOURS[c], sentence, np.nan, np.nan, dark_side, 0.0, np.nan, misfit, 0.0, 0.0)
        return nothing, cells
    darkest = np.unravel_index(np.argmin(np.where(cells, typical, 0.0)), cells.shape)
    deepest = -float(typical[darkest])
    sentence = _missing(deepest, float(error[darkest]), misfit)
    falls, falls_error = _direction(seen, left, cells)
    by_sample = np.where(cells, -typical, 0.0).sum(axis=0)
    share = np.cumsum(by_sample) / by_sample.sum()
    reach = float(SAMPLE_STEP * np.interp(0.5, share, np.arange(1, len(share) + 1)))
    return ColourShadow(
        COLOURS[c],
        sentence,
        falls,
        falls_error,
        dark_side,
        deepest,
        float(error[darkest]),
        misfit,
        reach,
        float(cells.any(axis=1).sum() * 2.0 * np.pi / DIRECTIONS),
    ), cells if not sentence else np.zeros_like(cells)


def _missing(deepest: float, error: float, misfit: float) -> str:
    if deepest < max(DEEPEST, 3.0 * error):
        return (
            f"its darkest place is {deepest:.1f} grey levels (to {error:.1f}) darker than explained; "
            f"at least {DEEPEST:g}, and three times the error, are wanted"
        )
    if deepest < OVER_MISFIT * misfit:
        return (
            f"its darkest place is {deepest:.1f} grey levels darker than explained, and other places are up "
            f"to {misfit:.1f} too bright: what colours are off by, not to be told from a shadow"
        )
    return ""


def _typical(values: FloatArray, enough: BoolArray) -> FloatArray:
    """``(directions, samples)``: the presses' median, smoothed; 0 where too few show a sample."""
    middle = np.zeros(enough.shape)
    middle[enough] = np.nanmedian(values[:, enough], axis=0)
    share = ndimage.gaussian_filter(enough.astype(np.float64), _SMOOTH, mode=("wrap", "nearest"))
    smooth = ndimage.gaussian_filter(middle, _SMOOTH, mode=("wrap", "nearest"))
    typical: FloatArray = np.where(enough, smooth / np.maximum(share, 1e-9), 0.0)
    return typical


def _largest(dark: BoolArray, typical: FloatArray) -> BoolArray:
    """The connected part that is darkest in all; the last direction touches the first."""
    labels, count = ndimage.label(np.concatenate([dark, dark]))
    if count == 0:
        return dark
    twice = np.concatenate([typical, typical])
    best = 1 + int(np.argmin(ndimage.sum_labels(twice, labels, np.arange(1, count + 1))))
    first, second = np.split(labels == best, 2)
    return np.asarray(first | second)


def _direction(seen: Around, left: FloatArray, cells: BoolArray) -> tuple[float, float]:
    """Where the shadow falls, and one standard error of it by the scatter of the presses."""
    darkness = -left[:, cells]
    # A press at the border shows a part of the wedge; of the rest it is taken to be like the others.
    darkness = np.where(np.isfinite(darkness), darkness, np.nanmean(darkness, axis=0))
    each = darkness @ np.exp(1j * seen.directions)[np.nonzero(cells)[0]]
    mean = each.mean()
    across = (each * np.conj(mean)).imag / np.abs(mean) ** 2
    error = float(across.std(ddof=1) / np.sqrt(len(each)))
    return float(np.angle(mean) % (2.0 * np.pi)), error


def _table(directions: FloatArray, lists: list[list[FloatArray]], depth: float) -> ShadowTable:
    """Lists of the rim that was seen, and of shallower ones by the published law."""
    shares = (np.arange(ROWS) + 0.5) / (ROWS - 0.5)
    kept = [[[_at_depth(one, share) for share in shares] for one in colour] for colour in lists]
    lengths = np.array([[[len(row) for row in one] for one in colour] for colour in kept], dtype=np.int64)
    values = np.concatenate([row for colour in kept for one in colour for row in one])
    return ShadowTable(directions, read_only(lengths), read_only(values), 0.0, depth / (ROWS - 0.5))


def _at_depth(one: FloatArray, share: float) -> FloatArray:
    """A list of a rim at a share of the depth: nearer by that, and darker by less, by its square root."""
    at = np.rint(np.arange(int(np.ceil(share * len(one)))) / share).astype(np.int64)
    level = one[np.minimum(at, len(one) - 1)]
    return np.where(level < _NONE, np.sqrt(share) * level, _NONE)


def around(pack: PressPack, clean: FloatArray, centres: FloatArray, light: GelLight) -> Around:
    """Look at presses along rays from their rims.

    Args:
        pack: the presses.
        clean: ``(presses, rows, columns, 3)`` grey levels against the untouched gel.
        centres: ``(presses, 2)`` pixels (column, row), of the balls' axes.
        light: what is explained already.
    """
    directions = (np.arange(DIRECTIONS, dtype=np.float64) + 0.5) * (2.0 * np.pi / DIRECTIONS)
    starts = rim_reach(light.edge, directions)
    samples = max(2, int((REACH * light.edge - starts.max()) / SAMPLE_STEP))
    away = starts[:, None] + SAMPLE_STEP * np.arange(samples)
    offset = np.stack([away * np.cos(directions[:, None]), away * np.sin(directions[:, None])], axis=-1)
    shape = (len(clean), DIRECTIONS, samples, 3)
    seen, left = np.empty(shape), np.empty(shape)
    within: FloatArray = np.zeros((DIRECTIONS, 3))
    ring = WITHIN * light.edge * np.stack([np.cos(directions), np.sin(directions)], axis=1)
    for k, centre in enumerate(centres):
        place = (centre + offset).reshape(-1, 2)[:, ::-1]
        looked = np.stack(
            [
                map_coordinates(clean[k][..., c], place.T, order=1, mode="constant", cval=np.nan)
                for c in range(3)
            ],
            axis=-1,
        )
        seen[k] = looked.reshape(shape[1:])
        left[k] = (looked - light_shades(pack, light, centre, place)).reshape(shape[1:])
        within += light_shades(pack, light, centre, (centre + ring)[:, ::-1]) / len(centres)
    return Around(
        read_only(directions), read_only(starts), read_only(seen), read_only(left), read_only(within)
    )


def rim_reach(edge: float, directions: FloatArray) -> FloatArray:
    """``(d,)`` pixels from the axis of a round contact to the outermost pixel of its rim.

    The rim is the contact widened by a square, so it reaches further along the diagonals.

    Args:
        edge: pixels, radius of the contact.
        directions: ``(d,)`` rad.
    """
    side = np.arange(-RIM, RIM + 1)
    corner = np.stack(np.meshgrid(side, side), axis=-1).reshape(-1, 2)
    along = np.stack([np.cos(directions), np.sin(directions)], axis=1) @ corner.T
    left = edge**2 - (corner**2).sum(axis=1) + along**2
    reach: FloatArray = np.where(left >= 0.0, along + np.sqrt(np.maximum(left, 0.0)), 0.0).max(axis=1)
    return reach


@dataclass(frozen=True)
class ShadowScore:
    """Scores of held-out presses, over the pixels that the shadow changes by a grey level or more."""

    shaded: float  #: dB, median PSNR with the shadow.
    plain: float  #: dB, the same without.
    gain: float  #: dB, median over the presses of the difference.
    better: float  #: share of the presses that are predicted better with it.
    presses: int  #: that were scored.
    pixels: float  #: of a press, median.

    of: int  #: presses there are.

    @property
    def worth(self) -> bool:
        """Whether the shadow is to be drawn."""
        return self.presses >= 0.5 * self.of and self.gain >= LEAST_GAIN and self.better >= _SHARE

    @property
    def sentence(self) -> str:
        """What was found, and what was wanted."""
        return (
            f"the shadow that all presses show was found by the folds of {self.presses} of {self.of} "
            f"presses, and predicts {self.better:.0%} of those better, by {self.gain:.2f} dB in the median; "
            f"half of all, {_SHARE:.0%} and {LEAST_GAIN:g} dB are wanted"
        )


def score_shadow(pack: PressPack, change: FloatArray, out: HeldOut, pitch: float, ball: float) -> ShadowScore:
    """Score the shadows of every fold on its held-out presses.

    Args:
        pack: the presses.
        change: ``(presses, rows, columns, 3)`` grey levels against the background, drift removed.
        out: how the folds were taught, and the centres of held-out presses.
        pitch: metres a pixel.
        ball: radius in pixels.
    """
    pairs: list[tuple[float, float, int]] = []
    for model, taught, left_out in out.folds:
        clean = change - model.rest
        fit = fit_shadow(pack.of(taught), clean[taught], model.fit.centres, model.light)
        for k in left_out:
            one = _press(pack, clean[k], out.centres[k], model.light, fit, pitch, ball)
            pairs += [] if one is None else [one]
    if not pairs:
        return ShadowScore(np.nan, np.nan, 0.0, 0.0, 0, 0.0, len(change))
    shaded, plain, pixels = np.array(pairs).T
    gain = shaded - plain
    return ShadowScore(
        float(np.median(shaded)),
        float(np.median(plain)),
        float(np.median(gain)),
        float((gain > 0.0).mean()),
        len(gain),
        float(np.median(pixels)),
        len(change),
    )


def _press(
    pack: PressPack,
    clean: FloatArray,
    centre: FloatArray,
    light: GelLight,
    fit: ShadowFit,
    pitch: float,
    ball: float,
) -> tuple[float, float, int] | None:
    table = fit.in_metres(pitch)
    if table is None:
        return None
    drawn, taken = _render_press(pack, centre, light, table, pitch, ball)
    own = taken.max(axis=-1) >= OWN
    if own.sum() < LEAST_PIXELS:
        return None
    left = (drawn - clean)[own]
    return decibels(left - taken[own]), decibels(left), int(own.sum())


def _render_press(
    pack: PressPack, centre: FloatArray, light: GelLight, table: ShadowTable, pitch: float, ball: float
) -> tuple[FloatArray, FloatArray]:
    """Render a press without its shadows, and the darkening by them, both in grey levels."""
    away = distance(pack.shape, centre)
    place = np.argwhere(away < REACH * light.edge)
    change = np.zeros((*pack.shape, 3))
    change[place[:, 0], place[:, 1]] = light_shades(pack, light, centre, place)
    surface = np.interp(away, np.arange(len(light.profile.height)), light.profile.height, right=0.0)
    core: BoolArray = pressed_ball(away, light.depth, ball) > light.skirt.core * light.depth
    taken, _ = soft_shadows(change[None], pitch * surface[None], surface[None], core[None], table, pitch)
    return change, taken[0]
