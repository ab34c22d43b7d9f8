"""Dots on a gel, drawn by counting: every pixel is looked at in 64 places. Nothing of the package draws."""

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import gaussian_filter

from harness.basics.arrays import ByteArray, FloatArray

ROWS, COLUMNS = 240, 320
_FINE = 8


@dataclass(frozen=True)
class DrawnDots:
    """A marked gel at rest."""

    wide: int = 10  #: dots in a row.
    high: int = 7  #: rows of dots.
    spacing: float = 29.0  #: pixels.
    radius: float = 6.0  #: pixels.
    turned: float = 0.02  #: rad, of the grid in the picture.
    aspect: float = 1.0  #: a pixel's height over its width.
    ink: float = 0.2  #: share of the light that a dot gives back.
    blur: float = 0.7  #: pixels, sigma of the lens.
    noise: float = 1.5  #: grey levels.
    barrel: float = 0.0  #: pixels by which a lens draws the corner of the picture outwards.
    middle: tuple[float, float] = (160.3, 118.8)  #: ``(2,)`` pixels (column, row), of the grid.

    def places(self) -> FloatArray:
        """``(dots, 2)`` pixels (column, row), row by row."""
        across, down = np.meshgrid(
            np.arange(self.wide) - (self.wide - 1) / 2.0, np.arange(self.high) - (self.high - 1) / 2.0
        )
        c, s = np.cos(self.turned), np.sin(self.turned)
        x = self.spacing * (c * across - s * down).ravel() * np.sqrt(self.aspect)
        y = self.spacing * (s * across + c * down).ravel() / np.sqrt(self.aspect)
        far = (x**2 + y**2) / (0.25 * (ROWS**2 + COLUMNS**2))
        x, y = x + self.barrel * x / COLUMNS * 2.0 * far, y + self.barrel * y / ROWS * 2.0 * far
        return np.asarray(np.column_stack([x, y]) + np.array(self.middle))

    def picture(self, places: FloatArray | None = None, seed: int = 0) -> ByteArray:
        """``(rows, columns, 3)`` with dots at ``places``; at ``self.places()`` where None."""
        cover = np.zeros((ROWS, COLUMNS))
        sub = (np.arange(_FINE) + 0.5) / _FINE - 0.5
        tall, wide = self.radius / np.sqrt(self.aspect), self.radius * np.sqrt(self.aspect)
        for x, y in self.places() if places is None else places:
            rows = np.arange(max(0, int(y - tall) - 2), min(ROWS, int(y + tall) + 3))
            columns = np.arange(max(0, int(x - wide) - 2), min(COLUMNS, int(x + wide) + 3))
            if not len(rows) or not len(columns):
                continue
            down = (rows[:, None] + sub).ravel()[:, None] - y
            right = (columns[:, None] + sub).ravel()[None] - x
            inside = ((right / wide) ** 2 + (down / tall) ** 2 <= 1.0).astype(float)
            share = inside.reshape(len(rows), _FINE, len(columns), _FINE).mean(axis=(1, 3))
            here = cover[np.ix_(rows, columns)]
            cover[np.ix_(rows, columns)] = np.maximum(here, share)
        lit = gel()[..., :] * (1.0 - (1.0 - self.ink) * cover[..., None])
        seen = gaussian_filter(lit, (self.blur, self.blur, 0.0))
        noise = np.random.default_rng(seed).normal(0.0, self.noise, seen.shape)
        return np.clip(np.round(seen + noise), 0.0, 255.0).astype(np.uint8)


def gel() -> FloatArray:
    """``(rows, columns, 3)`` an untouched gel lit by three colours from three sides."""
    y, x = np.mgrid[:ROWS, :COLUMNS]
    right, down = (x / COLUMNS - 0.5)[..., None], (y / ROWS - 0.5)[..., None]
    level: FloatArray = (
        np.array([170.0, 150.0, 180.0])
        + 60.0 * right * np.array([-1.0, 1.0, 0.3])
        + 40.0 * down * np.array([-0.4, -0.2, 1.0])
    )
    return level
