"""Taxim's two published presses with their shadows: what is known of them, and the published arithmetic.

Each object has a height map, a picture without shadows and one with them. Where the object shaped the gel was
not published; it is read off the height map. The last blur is five pixels wide, so what it leaves flat lies
two pixels within the core: the core is that, grown by a square of five.
"""

import io
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from PIL import Image
from scipy import ndimage
from scipy.optimize import minimize_scalar

from harness.basics.arrays import BoolArray, ByteArray, FloatArray
from harness.sim.optics.kernels import change_exactly
from harness.sim.optics.published_pack import read_table
from harness.sim.optics.shadow import ShadowTable, cast_shadows
from harness.sim.optics.shadow_file import read_shadow_table

PITCH = 0.0295e-3
TOPS = {"cylinder6": 7.0e-3, "square": 6.0e-3}
"""Metres, of the objects' flat tops."""

OTHER = {"cylinder6": "square", "square": "cylinder6"}
DEPTH = 1e-3
_FLAT = 1e-7
_SOFT = 2.0
_LAST = (5, 5)
_FIRST = 1.5
"""Pixels, sigma, by which the first estimate of the gel is smoothed; only its noise is looked at."""

_NEAR = 4.0
"""Pixels, sigma, within which compression makes alike noise: half a block."""


@dataclass(frozen=True, eq=False)
class PublishedPress:
    """One object; colours are RGB, heights in pixels towards the camera."""

    surface: FloatArray  #: ``(rows, columns)`` published.
    core: BoolArray  #: ``(rows, columns)`` where the object shaped the gel.
    penetration: FloatArray  #: ``(rows, columns)`` metres into the untouched gel.
    change: FloatArray  #: ``(rows, columns, 3)`` grey levels that the table gives the surface.
    shaded: FloatArray  #: ``(rows, columns, 3)`` the same under shadows, by the published arithmetic.
    plain: FloatArray  #: ``(rows, columns, 3)`` published without shadows.
    live: FloatArray  #: ``(rows, columns, 3)`` published with them.
    quantised: dict[int, list[int]]  #: the tables of that JPEG.

    @property
    def background(self) -> FloatArray:
        """``(rows, columns, 3)`` the untouched gel as this object's picture without shadows gives it."""
        return np.rint(self.plain - self.change)

    def own(self, background: FloatArray) -> BoolArray:
        """``(rows, columns)`` the shadow's own pixels: it moves them by a grey level or more."""
        moved = np.abs(soft(self.shaded, background) - soft(self.change, background))
        return np.asarray(moved.max(axis=-1) >= 1.0)

    def through_jpeg(self, picture: FloatArray) -> FloatArray:
        """A picture as the published one's compression would have handed it out."""
        held = io.BytesIO()
        whole: ByteArray = picture.astype(np.uint8)
        Image.fromarray(whole).save(held, "JPEG", qtables=self.quantised, subsampling=2)
        return np.asarray(Image.open(held), dtype=np.float64)


def published_press(taxim: Path, name: str) -> PublishedPress:
    """Read one of the two."""
    results, lab = taxim / "published_results", taxim / "gelsight_lab"
    surface = np.load(results / f"{name}_height.npy").astype(np.float64)
    gel = cv2.GaussianBlur(np.load(lab / "gelmap5.npy"), _LAST, 0)
    above = surface + np.asarray(gel, dtype=np.float64)
    penetration = (above - above.max()) * PITCH + DEPTH
    change = np.empty((*surface.shape, 3))
    change_exactly(surface, read_table(lab / "polycalib.npz"), change)
    core = core_of(surface, TOPS[name])
    shaded, _ = cast_shadows(
        change[None], penetration[None], surface[None], core[None], shadow_table(lab), beyond="skip"
    )
    live = Image.open(results / f"{name}_shadow.jpg")
    plain = np.asarray(Image.open(results / f"{name}_sim.jpg"), dtype=np.float64)
    tables = {int(k): list(v) for k, v in live.quantization.items()}  # type: ignore[attr-defined]
    seen = np.asarray(live, dtype=np.float64)
    return PublishedPress(surface, core, penetration, change, shaded[0], plain, seen, tables)


def shadow_table(lab: Path) -> ShadowTable:
    """Of Taxim's sensor, RGB."""
    return read_shadow_table(lab / "shadowTable.npz")


def core_of(surface: FloatArray, top: float) -> BoolArray:
    """``(rows, columns)`` where a flat-topped object shaped the gel; ``top`` in metres."""
    flat, count = ndimage.label(np.abs(surface * PITCH - top) < _FLAT)
    largest = int(np.argmax(np.bincount(flat.ravel(), minlength=count + 1)[1:])) + 1
    core: BoolArray = ndimage.binary_dilation(flat == largest, np.ones(_LAST, np.bool_))
    return core


def soft(change: FloatArray, background: FloatArray) -> FloatArray:
    """A picture as the published program finishes it: the change blurred, and then everything."""
    blurred = ndimage.gaussian_filter(change, (_SOFT, _SOFT, 0.0))
    drawn = cv2.GaussianBlur((blurred + background).astype(np.float32), _LAST, 0)
    return np.clip(np.rint(np.asarray(drawn, dtype=np.float64)), 0.0, 255.0)


def from_both(other: PublishedPress) -> FloatArray:
    """The untouched gel, blurred as pictures are, as an object's two pictures give it together."""
    plain, shadowed = _each(other)
    return 0.5 * (plain + shadowed)


def untouched(other: PublishedPress, where: BoolArray) -> tuple[FloatArray, float]:
    """As ``from_both``, without most of what compression left in it.

    The two pictures show one gel under colours that are known; where they differ is noise. How much of
    it is near a pixel is seen by compressing a first estimate as they were compressed: that gives weights. A
    Gaussian takes it out, of the width with which either picture predicts the other best over ``where``. Of
    another object nothing enters but ``where``, ``(rows, columns)``, which its shape alone gives.

    Returns:
        ``(rows, columns, 3)`` grey levels, and the width in pixels, sigma.
    """
    plain, shadowed = _each(other)
    weights = _weights(other, gaussian(0.5 * (plain + shadowed), _FIRST))

    def missed(width: float) -> float:
        left = (
            _weighted([plain], weights[:1], width) - shadowed,
            _weighted([shadowed], weights[1:], width) - plain,
        )
        return float(np.mean([(one[where] ** 2).mean() for one in left]))

    found = minimize_scalar(missed, bounds=(0.3, 5.0), method="bounded", options={"xatol": 0.05})
    return _weighted([plain, shadowed], weights, float(found.x)), float(found.x)


def _each(other: PublishedPress) -> tuple[FloatArray, FloatArray]:
    thrown = ndimage.gaussian_filter(other.shaded, (_SOFT, _SOFT, 0.0))
    return _last_blur(other.plain - other.change), other.live - _last_blur(thrown)


def _weights(other: PublishedPress, first: FloatArray) -> list[FloatArray]:
    """One over the squared noise of each of ``_each``, ``(rows, columns, 1)``."""
    plain, shadowed = np.clip(np.rint(first + other.change), 0.0, 255.0), over(first, other.shaded)
    noise = _last_blur(other.through_jpeg(plain) - plain), other.through_jpeg(shadowed) - shadowed
    return [1.0 / gaussian((each**2).mean(axis=-1, keepdims=True), _NEAR) for each in noise]


def _weighted(estimates: list[FloatArray], weights: list[FloatArray], width: float) -> FloatArray:
    known = [gaussian(one * weight, width) for one, weight in zip(estimates, weights, strict=True)]
    return np.asarray(sum(known) / sum(gaussian(weight, width) for weight in weights))


def gaussian(picture: FloatArray, width: float) -> FloatArray:
    """Blurred by ``width`` pixels, sigma, channel by channel."""
    return np.asarray(ndimage.gaussian_filter(picture, (width, width, 0.0)))


def _last_blur(picture: FloatArray) -> FloatArray:
    return np.asarray(cv2.GaussianBlur(picture.astype(np.float32), _LAST, 0), dtype=np.float64)


def over(blurred: FloatArray, change: FloatArray) -> FloatArray:
    """As ``soft``, over a background that is blurred already."""
    thrown = ndimage.gaussian_filter(change, (_SOFT, _SOFT, 0.0)).astype(np.float32)
    drawn = blurred + np.asarray(cv2.GaussianBlur(thrown, _LAST, 0))
    return np.asarray(np.clip(np.rint(drawn), 0.0, 255.0))
