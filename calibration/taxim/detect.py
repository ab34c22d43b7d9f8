"""Where a ball was pressed, from the picture alone: no marks.

Across a ball the change of colour is, to first order, linear in the place: each channel is a ramp
through zero at the centre. The detector looks for the disc that such ramps explain best,

    score(c) = explained(c) - price * (energy(c) - explained(c)),    summed over the channels

where ``explained`` is the energy of the least-squares ramp without a constant over the disc about ``c``.
A halo is bright and no ramp through zero, so it costs and gains nothing.
"""

from dataclasses import dataclass

import numpy as np
from scipy.fft import irfft2, next_fast_len, rfft2

from harness.basics.arrays import AnyArray, FloatArray, block_means

REACH = 0.85
"""Ball radii out to which the ramp is looked for."""

_PIXELS = 8.0
"""A ball's radius in pixels that is fine enough; larger pictures are averaged down to about it."""

_PRICE = 0.5
"""Of energy that is no ramp: at 1, a press half in shadow loses to a faint one that is not there."""

_LEAST_SEEN = 0.25
"""Share of a disc that must lie in the picture for its centre to be a candidate."""


@dataclass(frozen=True)
class Found:
    """A disc of changed colour.

    Attributes:
        centre: pixels (column, row); may lie outside the picture by less than the disc.
        strength: grey levels rms over the disc; hardly more than the noise where nothing was pressed.
        share: of the disc's energy that the ramps explain, 0 to 1.
    """

    centre: tuple[float, float]
    strength: float
    share: float


class Detector:
    """Finds presses of one ball in pictures of one shape.

    Args:
        rows: of the pictures.
        columns: of the pictures.
        ball: radius in pixels, more than 3.
    """

    def __init__(self, rows: int, columns: int, ball: float) -> None:
        self._block = max(1, round(ball / _PIXELS))
        radius = REACH * ball / self._block
        self._pad = int(np.ceil(radius))
        disc, x, y = _disc(radius)
        small = (rows // self._block, columns // self._block)
        self._shape = [next_fast_len(size + 4 * self._pad, real=True) for size in small]
        self._ramps = [self._of_kernel(kernel) for kernel in (disc * x, disc * y)]
        self._disc = self._of_kernel(disc)
        seen = rfft2(np.pad(np.ones(small), self._pad), self._shape)
        self._area = self._correlated(seen, self._disc, small)
        self._usable = self._area >= _LEAST_SEEN * disc.sum()
        xx, xy, yy = (
            self._correlated(seen, self._of_kernel(disc * one), small) for one in (x * x, x * y, y * y)
        )
        # The inverse of each place's moments: near the border only a part of the disc is seen.
        determinant = np.where(self._usable, xx * yy - xy**2, 1.0)
        self._inverse = (yy / determinant, xy / determinant, xx / determinant)

    def find(self, change: FloatArray) -> Found:
        """The disc that looks most like a ball in ``(rows, columns, 3)`` grey levels against rest."""
        small = block_means(change, self._block)
        size = (small.shape[0], small.shape[1])
        explained = np.zeros(self._area.shape)
        for c in range(3):
            spectrum = rfft2(np.pad(small[..., c], self._pad), self._shape)
            right, down = (self._correlated(spectrum, ramp, size) for ramp in self._ramps)
            yy, xy, xx = self._inverse
            explained += yy * right**2 - 2.0 * xy * right * down + xx * down**2
        power = np.pad((small**2).sum(axis=2), self._pad)
        energy = self._correlated(rfft2(power, self._shape), self._disc, size)
        left = np.maximum(energy - explained, 0.0)
        score = np.where(self._usable, explained - _PRICE * left, -np.inf)
        i, j = np.unravel_index(int(np.argmax(score)), score.shape)
        there = max(float(energy[i, j]), 1e-9)
        x, y = j + _vertex(score[i, j - 1 : j + 2]), i + _vertex(score[i - 1 : i + 2, j])
        return Found(
            centre=(
                float((x - self._pad + 0.5) * self._block - 0.5),
                float((y - self._pad + 0.5) * self._block - 0.5),
            ),
            strength=float(np.sqrt(there / (3.0 * self._area[i, j]))),
            share=float(explained[i, j]) / there,
        )

    def _of_kernel(self, kernel: FloatArray) -> AnyArray:
        return np.asarray(np.conj(rfft2(kernel, self._shape)))

    def _correlated(self, spectrum: AnyArray, kernel: AnyArray, size: tuple[int, int]) -> FloatArray:
        """Of the padded picture, at every place of it where a disc's centre may lie."""
        every = irfft2(spectrum * kernel, self._shape)
        # A kernel's middle is its reach in from its corner: roll it back there.
        reach = self._pad
        rolled = np.roll(every, (reach, reach), axis=(0, 1))
        return np.asarray(rolled[: size[0] + 2 * reach, : size[1] + 2 * reach], dtype=np.float64)


def _vertex(three: FloatArray) -> float:
    """Where the parabola through the middle, which is the highest, and its neighbours has its top."""
    if len(three) < 3 or not np.isfinite(three).all():
        return 0.0
    bend = three[0] - 2.0 * three[1] + three[2]
    return 0.0 if bend >= 0.0 else float(0.5 * (three[0] - three[2]) / bend)


def _disc(radius: float) -> tuple[FloatArray, FloatArray, FloatArray]:
    reach = int(np.ceil(radius))
    y, x = (axis.astype(np.float64) for axis in np.mgrid[-reach : reach + 1, -reach : reach + 1])
    return (np.hypot(x, y) <= radius).astype(np.float64), x, y
