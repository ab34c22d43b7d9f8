"""Ball presses drawn by formula: three lights on a gel, shaded by the cosine law, a skirt around the ball.

Nothing of the package draws here. The gel follows the ball out to the contact line and fades from there.
"""

from dataclasses import dataclass

import numpy as np

from calibration.taxim.pictures import Pictures, Refused
from harness.basics.arrays import ByteArray, FloatArray

ROWS, COLUMNS = 96, 128
BALL = 12.0
CONTACT = 9.0
LIGHTS = np.array([[0.8, 0.2, 0.6], [-0.5, 0.7, 0.6], [-0.2, -0.8, 0.6]])
_GAIN = np.array([95.0, 110.0, 100.0])
_SKIRT = 3.0


@dataclass(frozen=True)
class DrawnGel:
    """A sensor."""

    dimming: float = 0.0  #: grey levels that a contact takes from every channel.
    noise: float = 1.0  #: grey levels.
    aspect: float = 1.0  #: a pixel's height over its width; lengths are in square pixels of the same area.

    def rest(self) -> FloatArray:
        """``(rows, columns, 3)`` the untouched gel: a slope of brightness, and three different levels."""
        x, y = _places()
        level = np.array([130.0, 115.0, 150.0])
        right, down = (x / COLUMNS - 0.5)[..., None], (y / ROWS - 0.5)[..., None]
        rest: FloatArray = (
            level + 15.0 * right * np.array([1.0, -1.0, 0.5]) + 8.0 * down * np.array([-0.5, 1.0, 1.0])
        )
        return rest

    def press(self, centre: tuple[float, float], seed: int, contact: float = CONTACT) -> FloatArray:
        """``(rows, columns, 3)`` a ball at (column, row), not yet rounded."""
        x, y = _places()
        right, down = (x - centre[0]) / np.sqrt(self.aspect), (y - centre[1]) * np.sqrt(self.aspect)
        away = np.hypot(right, down)
        sine = np.minimum(away, contact) / BALL * np.exp(-np.maximum(away - contact, 0.0) / _SKIRT)
        share = sine / np.maximum(away, 1e-9)
        normal = np.stack([share * right, share * down, np.sqrt(1.0 - sine**2)], axis=-1)
        lit = _lit(normal, x, y)
        dim = self.dimming * (away <= contact)
        noise = np.random.default_rng(seed).normal(0.0, self.noise, (ROWS, COLUMNS, 3))
        drawn: FloatArray = self.rest() + lit - dim[..., None] + noise
        return drawn

    def colours(self, x: FloatArray, y: FloatArray, normals: FloatArray) -> FloatArray:
        """``(n, ..., 3)`` grey levels against the untouched gel, of ``(..., 3)`` normals at n places."""
        places = (len(x), *[1] * (normals.ndim - 1))
        return _lit(normals[None], x.reshape(places), y.reshape(places)) - self.dimming


def spread_centres(count: int, seed: int = 0) -> FloatArray:
    """``(count, 2)`` pixels (column, row): on a lattice over the whole gel, none quite on it."""
    columns = int(np.ceil(np.sqrt(count * COLUMNS / ROWS)))
    rows = -(-count // columns)
    x, y = np.meshgrid(np.linspace(14, COLUMNS - 15, columns), np.linspace(14, ROWS - 15, rows))
    lattice = np.column_stack([x.ravel(), y.ravel()])[:count]
    return lattice + np.random.default_rng(seed).uniform(-2.5, 2.5, lattice.shape)


def rounded(picture: FloatArray) -> ByteArray:
    """As a camera hands it out."""
    return np.clip(np.round(picture), 0.0, 255.0).astype(np.uint8)


def press_set(images: list[ByteArray], background: ByteArray, refused: tuple[Refused, ...] = ()) -> Pictures:
    """Pictures named by their number."""
    names = tuple(f"{number:04d}.png" for number in range(len(images)))
    return Pictures(background, "drawn", np.stack(images), names, None, "drawn", "0" * 64, refused)


def drawn_set(count: int, gel: DrawnGel | None = None) -> tuple[Pictures, FloatArray]:
    """Presses all over the gel, and their true centres."""
    gel = DrawnGel() if gel is None else gel
    centres = spread_centres(count)
    images = [rounded(gel.press((x, y), seed)) for seed, (x, y) in enumerate(centres)]
    return press_set(images, rounded(gel.rest())), centres


def _lit(normal: FloatArray, x: FloatArray, y: FloatArray) -> FloatArray:
    bright = 1.0 + 0.15 * (x / COLUMNS - 0.5) - 0.1 * (y / ROWS - 0.5)
    shade: FloatArray = _GAIN * (normal @ LIGHTS.T - LIGHTS[:, 2]) * bright[..., None]
    return shade


def _places() -> tuple[FloatArray, FloatArray]:
    y, x = (axis.astype(np.float64) for axis in np.mgrid[:ROWS, :COLUMNS])
    return x, y
