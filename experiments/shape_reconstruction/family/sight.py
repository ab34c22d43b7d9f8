"""Rays of sight through a silhouette: those that graze the object, those that pass it, those that meet it."""

from functools import lru_cache
from typing import NamedTuple

import numpy as np
from scipy import ndimage

from experiments.shape_reconstruction.evidence import SeenMask
from experiments.shape_reconstruction.family.spread import farthest_points
from harness.basics.arrays import BoolArray, FloatArray, IntArray

PASS, GRAZE, MEET = 0, 1, 2
"""Kinds of rays."""

OUTLINE_SIGMA = 0.5
"""Pixels, of where a mask's smoothed border leaves the outline."""

OUTLINE_WORTH = 60.0
"""Independent readings that all grazing rays together count as at most: neighbours err alike."""

GAIN = 0.5
"""Of a ray that passes the mask, by pixel from it."""

_GRAZING = (36, 120)
_MEETING = (12, 60)
_PASSING = ((2.0, 14, 70), (4.0, 12, 60), (9.0, 10, 50), (20.0, 8, 40), (45.0, 5, 30), (90.0, 3, 20))
"""Pixels from the mask, and how many rays there: for ranking, and for fitting."""

_STEPS = (5.0e-3, 2.5e-3)
"""M between places on a ray, for ranking and for fitting: a cup then seems 0.1 mm too far from it
at most."""

_SMOOTH = 0.8
_CLEAR = 2


class SightRays(NamedTuple):
    """Rays of one camera in ``stand``.

    Attributes:
        eye: ``(3,)`` m.
        directions: ``(n, 3)`` unit.
        kinds: ``(n,)`` ``PASS``, ``GRAZE`` or ``MEET``.
        worth: ``(n,)`` weight of each one's squared residual.
        gain: ``(n,)`` by which a distance counts for more than it is: a thin part far outside of the mask is
            as wrong as a thick one.
        pixel: m per pixel at the object, a first guess of it.
        right, down: ``(3,)`` unit, axes of the picture.
        middle: ``(3,)`` unit, towards the middle of the mask.
        position_sigma: m at the object, by which the camera's errors shift the picture.
        scale_sigma: relative error of the picture's scale.
        step: m between places on a ray where a shape is looked for.
    """

    eye: FloatArray
    directions: FloatArray
    kinds: IntArray
    worth: FloatArray
    gain: FloatArray
    pixel: float
    right: FloatArray
    down: FloatArray
    middle: FloatArray
    position_sigma: float
    scale_sigma: float
    step: float


def no_rays() -> SightRays:
    """Of no picture."""
    zero, empty = np.zeros(3), np.empty(0)
    kinds = np.empty(0, np.int64)
    return SightRays(
        zero, np.empty((0, 3)), kinds, empty, empty, 1e-3, zero, zero, zero, 1e-3, 1e-3, _STEPS[1]
    )


@lru_cache(maxsize=4)
def sight_rays(look: SeenMask, coarse: bool) -> SightRays:
    """Rays through a mask; none where it is empty. A run's estimates share one look: its rays are kept."""
    if not look.mask.any():
        return no_rays()
    which = 0 if coarse else 1
    clear = ~ndimage.binary_dilation(look.hidden, iterations=_CLEAR) if look.hidden.any() else ~look.hidden
    outline = _spread(_outline(look.mask, clear), _GRAZING[which])
    inside = _spread(_inside(look.mask, clear), _MEETING[which])
    outside, away = _outside(look.mask, clear, which)
    places = np.concatenate([outline, inside, outside])
    kinds = np.repeat([GRAZE, MEET, PASS], [len(outline), len(inside), len(outside)]).astype(np.int64)
    worth = np.ones(len(places))
    worth[: len(outline)] = min(1.0, OUTLINE_WORTH / max(len(outline), 1))
    gain = np.ones(len(places))
    gain[len(places) - len(outside) :] += GAIN * away
    return _rays(look, places, kinds, (worth, gain), _STEPS[which])


def _rays(
    look: SeenMask, places: FloatArray, kinds: IntArray, weights: tuple[FloatArray, FloatArray], step: float
) -> SightRays:
    rotation, eye = look.stand_from_camera[:3, :3], np.ascontiguousarray(look.stand_from_camera[:3, 3])
    directions = directions_of(look, places)
    rows, columns = np.nonzero(look.mask)
    middle = directions_of(look, np.array([[columns.mean() + 0.5, rows.mean() + 0.5]]))[0]
    # Down to the support, where the middle of the mask looks; a few metres where it never does.
    away = min(eye[2] / max(-middle[2], 0.05), 5.0) if eye[2] > 0.0 else 1.0
    return SightRays(
        eye=eye,
        directions=directions,
        kinds=kinds,
        worth=weights[0],
        gain=weights[1],
        pixel=away / look.focal_length,
        right=np.ascontiguousarray(rotation[:, 0]),
        down=np.ascontiguousarray(rotation[:, 1]),
        middle=middle,
        position_sigma=float(np.hypot(look.position_error, look.rotation_error * away)),
        scale_sigma=float(np.hypot(look.focal_length_error, look.position_error / away)) + 1e-4,
        step=step,
    )


def directions_of(look: SeenMask, places: FloatArray) -> FloatArray:
    """``(n, 3)`` unit in ``stand``: where ``(n, 2)`` places (x, y) in the picture look."""
    rows, columns = look.mask.shape
    in_camera = np.ones((len(places), 3))
    in_camera[:, :2] = (places - 0.5 * np.array([columns, rows])) / look.focal_length
    in_camera /= np.linalg.norm(in_camera, axis=1, keepdims=True)
    return np.ascontiguousarray(in_camera @ look.stand_from_camera[:3, :3].T)


def _spread(places: FloatArray, count: int) -> FloatArray:
    if len(places) > 20 * count:
        places = places[:: len(places) // (20 * count) + 1]
    return places[farthest_points(np.ascontiguousarray(places), count)]


def _outline(mask: BoolArray, clear: BoolArray) -> FloatArray:
    """``(n, 2)`` places (x, y) where the smoothed mask passes one half, between pixels that are clear."""
    smooth = ndimage.gaussian_filter(mask.astype(np.float64), _SMOOTH)
    found = []
    for axis in (0, 1):
        before, after = (smooth[:-1], smooth[1:]) if axis == 0 else (smooth[:, :-1], smooth[:, 1:])
        seen = clear[:-1] & clear[1:] if axis == 0 else clear[:, :-1] & clear[:, 1:]
        rows, columns = np.nonzero(((before >= 0.5) != (after >= 0.5)) & seen)
        a, b = before[rows, columns], after[rows, columns]
        share = (0.5 - a) / (b - a)
        y = rows + 0.5 + (share if axis == 0 else 0.0)
        x = columns + 0.5 + (share if axis == 1 else 0.0)
        found.append(np.column_stack([x, y]))
    places = np.concatenate(found)
    height, width = mask.shape
    edge = (places[:, 0] < 3) | (places[:, 1] < 3) | (places[:, 0] > width - 3) | (places[:, 1] > height - 3)
    return np.asarray(places[~edge])


def _inside(mask: BoolArray, clear: BoolArray) -> FloatArray:
    depth = ndimage.distance_transform_edt(mask)
    rows, columns = np.nonzero((depth > 1.5) & clear)
    return np.column_stack([columns + 0.5, rows + 0.5])


def _outside(mask: BoolArray, clear: BoolArray, which: int) -> tuple[FloatArray, FloatArray]:
    """``(n, 2)`` places around the mask, and how many pixels each is from it.

    Dense near it: what is near is what a shape would stick out into.
    """
    away = ndimage.distance_transform_edt(~mask)
    found, distances = [np.empty((0, 2))], [np.empty(0)]
    for pixels, *counts in _PASSING:
        rows, columns = np.nonzero((np.abs(away - pixels) < 0.8) & clear)
        places = _spread(np.column_stack([columns + 0.5, rows + 0.5]), counts[which])
        found.append(places)
        distances.append(np.full(len(places), pixels))
    return np.concatenate(found), np.concatenate(distances)
