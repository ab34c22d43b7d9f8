"""Millimetres per pixel, aspect and rotation of a tactile camera, from known moves of the arm.

The ball stands still and the tool keeps its attitude, so the ball moves over the gel exactly as the arm
moves, backwards. Where the ball is seen, in pixels ``c``, and where the arm says it is on the gel, ``g`` in
metres, are joined by ``g = G c + t``: the columns of ``G`` are the gel that lies between two columns of the
picture, and between two rows. ``g`` is the side with the errors: an arm repeats a pose to hundredths of a
millimetre, a fifth of a pixel, and places in pictures are better than that.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.stats import t as student

from harness.basics.arrays import BoolArray, FloatArray, read_only
from harness.basics.errors import CalibrationRefused

LEAST = 8
"""Presses: the map has three numbers an axis, and its scatter is to be known as well."""

LEAST_SPREAD = 5.0
"""Scatters: the standard deviation of the places along their narrowest direction, in those of the fit."""

_UNSURE = 0.05
"""Of a correction, how well it is known: carrying middles back to the first touch changes a scale by some
four per cent on the mocked bench, and is wrong there by 0.2 % on average and by 0.4 % at worst."""

_OFF = 4.0
"""Robust standard deviations beyond which a press is off the map."""

LARGEST_SKEW = np.radians(2.0)
"""Beyond, it is no picture by an ordinary lens, and no number would hold all over it."""

_ROUNDS = 6
_STEP = 1e-6


@dataclass(frozen=True)
class Uncertain:
    """A number with its uncertainty."""

    value: float  #: in the unit of its name.
    sigma: float
    """one standard uncertainty: the presses' scatter, and how far ways to see their place differ."""
    of_scatter: float  #: the part of it that more presses make smaller.
    within95: float  #: half the width of the interval that holds the truth 19 times of 20.


@dataclass(frozen=True, eq=False)
class ArmScale:
    """How the picture lies on the gel, by the arm."""

    wide: Uncertain  #: m from column to column.
    high: Uncertain  #: m from row to row.
    pitch: Uncertain  #: m a pixel, of a square one of the same area.
    aspect: Uncertain  #: a pixel's height over its width.
    rotation: Uncertain  #: rad, of the picture against the tool's frame of the gel, about the gel's z axis.
    skew: Uncertain
    """rad, that rows and columns are from square; not zero by more than its error: look for a reason."""
    gel_from_pixels: FloatArray  #: ``(2, 2)`` m, ``G``.
    scatter: float  #: m, standard deviation of a press about the map, along one axis.
    used: tuple[int, ...]  #: places in the arguments of the presses that it stands on.
    off: tuple[int, ...]  #: of those that lie off it.
    residuals: FloatArray  #: ``(presses, 2)`` m, of all of them.

    @property
    def aspect_taken(self) -> float:
        """The aspect by which pictures are made square: as measured where one is out of its interval, else 1.

        What the presses cannot tell from a square pixel is not worth blurring every picture for.
        """
        told = abs(self.aspect.value - 1.0) > self.aspect.within95
        return self.aspect.value if told else 1.0


def arm_scale(
    places: Sequence[FloatArray], on_gel: FloatArray, uncorrected: FloatArray | None = None
) -> ArmScale:
    """Fit the map.

    Args:
        places: one or more ways to see the presses, each ``(presses, 2)`` pixels (column, row), NaN where
            nothing was seen. The values are those of their mean; how far they disagree is part of the error.
        on_gel: ``(presses, 2)`` m, where the arm says the ball is in the tool's frame of the gel.
        uncorrected: ``(presses, 2)`` pixels, the places as they would be seen without a correction that
            ``places`` have had; ``_UNSURE`` of what it changes counts as error. None where there was none.

    Raises:
        CalibrationRefused: too few presses, all at one place or in one line, a mirrored picture, or rows and
            columns further from square than any camera's.
    """
    maps = [_robust(seen, on_gel) for seen in places]
    every = np.array([_numbers(one.gel_from_pixels) for one in maps])
    middle = np.mean([one.gel_from_pixels for one in maps], axis=0)
    values = _numbers(middle)
    # Variances of the numbers by the scatter: first order, the same for both axes of the arm.
    variances = []
    for one in maps:
        slopes = _slopes(_numbers, one.gel_from_pixels)
        variances.append([sum(axis @ one.covariance @ axis for axis in slope) for slope in slopes])
    by_scatter = np.sqrt(np.mean(variances, axis=0))
    # All ways look at the same pictures: their standard deviation would make too little of what they share.
    by_seeing = np.abs(every - values).max(axis=0)
    if uncorrected is not None:
        corrected = _numbers(_robust(uncorrected, on_gel).gel_from_pixels) - values
        by_seeing = np.hypot(by_seeing, _UNSURE * corrected)
    freedom = 2 * min(int(one.kept.sum()) for one in maps) - 6
    factor = float(student.ppf(0.975, freedom))
    first = maps[0]
    pitch, aspect, rotation, skew, wide, high = (
        Uncertain(float(v), float(np.hypot(a, b)), float(a), factor * float(np.hypot(a, b)))
        for v, a, b in zip(values, by_scatter, by_seeing, strict=True)
    )
    if abs(skew.value) > max(LARGEST_SKEW, skew.within95):
        raise CalibrationRefused(
            f"rows and columns stand {np.degrees(skew.value):+.2f} deg (to {np.degrees(skew.within95):.2f}) "
            f"from square, and a camera's at most {np.degrees(LARGEST_SKEW):g}: the gel slips sideways as it "
            "is pressed, the arm's frames are wrong, or the picture is warped; look at the map of the presses"
        )
    return ArmScale(
        wide,
        high,
        pitch,
        aspect,
        rotation,
        skew,
        gel_from_pixels=read_only(middle),
        scatter=float(np.mean([one.scatter for one in maps])),
        used=tuple(int(k) for k in np.flatnonzero(first.kept)),
        off=tuple(int(k) for k in np.flatnonzero(~first.kept & np.isfinite(first.residuals).all(axis=1))),
        residuals=read_only(first.residuals),
    )


@dataclass(frozen=True, eq=False)
class _Map:
    gel_from_pixels: FloatArray
    covariance: FloatArray
    scatter: float
    kept: BoolArray
    residuals: FloatArray


def _robust(seen: FloatArray, on_gel: FloatArray) -> _Map:
    """Least squares, those beyond four robust deviations left out until nothing changes."""
    shown = kept = np.asarray(np.isfinite(seen).all(axis=1), dtype=np.bool_)
    for _ in range(_ROUNDS):
        found = _fitted(seen, on_gel, kept)
        away = np.abs(found.residuals)
        scatter = 1.4826 * np.median(away[kept], axis=0)
        near = (away <= np.maximum(_OFF * scatter, 1e-12)).all(axis=1)
        again = np.asarray(shown & near, dtype=np.bool_)
        if np.array_equal(again, kept):
            break
        kept = again
    _require_spread(seen[kept], found)
    return found


def _fitted(seen: FloatArray, on_gel: FloatArray, kept: BoolArray) -> _Map:
    count = int(kept.sum())
    if count < LEAST:
        raise CalibrationRefused(
            f"{count} presses show where the ball was first touched; at least {LEAST} are needed to measure "
            "millimetres per pixel: press more places, or look at why the others were refused"
        )
    terms = np.column_stack([seen - seen[kept].mean(axis=0), np.ones(len(seen))])
    solved, _, rank, _ = np.linalg.lstsq(terms[kept], on_gel[kept], rcond=None)
    if rank < 3:
        raise CalibrationRefused(
            f"{count} presses lie in one line or at one place in the picture: the arm has to move along both "
            "axes of the gel to show millimetres per pixel of both"
        )
    residuals = on_gel - terms @ solved
    scatter = float(np.sqrt((residuals[kept] ** 2).sum() / (2 * (count - 3))))
    covariance = scatter**2 * np.linalg.inv(terms[kept].T @ terms[kept])[:2, :2]
    return _Map(np.ascontiguousarray(solved[:2].T), covariance, scatter, kept, residuals)


def _require_spread(seen: FloatArray, found: _Map) -> None:
    determinant = float(np.linalg.det(found.gel_from_pixels))
    spread = np.linalg.svd(found.gel_from_pixels @ np.cov(seen.T), compute_uv=False)[-1]
    narrow = float(np.sqrt(abs(spread) * np.sqrt(abs(determinant))))
    if narrow < LEAST_SPREAD * found.scatter:
        raise CalibrationRefused(
            f"the presses spread by {1e3 * narrow:.2f} mm along their narrowest direction and scatter by "
            f"{1e3 * found.scatter:.3f} mm about any map: move the arm further between presses"
        )
    if determinant < 0.0:
        raise CalibrationRefused(
            "the picture is mirrored against the tool: turn it over in the camera's settings, or correct "
            "'frames.flange_from_gel' of the station"
        )


def _numbers(gel_from_pixels: FloatArray) -> FloatArray:
    """Pitch, aspect, rotation, skew, and the steps of columns and of rows, of a map: ``(6,)``."""
    column, row = gel_from_pixels.T
    wide, high = np.hypot(*column), np.hypot(*row)
    across, down = np.arctan2(column[1], column[0]), np.arctan2(-row[0], row[1])
    apart = np.mod(down - across + np.pi, 2.0 * np.pi) - np.pi
    middle = np.mod(across + 0.5 * apart + np.pi, 2.0 * np.pi) - np.pi
    return np.array([np.sqrt(wide * high), high / wide, middle, apart, wide, high])


def _slopes(of: Callable[[FloatArray], FloatArray], at: FloatArray) -> FloatArray:
    """``(numbers, 2, 2)``, by central differences."""
    step = _STEP * float(np.abs(at).max())
    slopes = np.zeros((len(of(at)), 2, 2))
    for i in range(2):
        for j in range(2):
            moved = np.zeros((2, 2))
            moved[i, j] = step
            slopes[:, i, j] = (of(at + moved) - of(at - moved)) / (2.0 * step)
    return slopes
