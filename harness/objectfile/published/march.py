"""Pictures of an imported look: samples along every ray, summed as the published programs do.

``sigma = max(density, 0)``, ``alpha = 1 - exp(-sigma * step)``, ``weight = alpha * prod(1 - alpha + 1e-10)``
of the samples before; the last step is endless. Colour is stretched by 1.2 about 0.5.
"""

from dataclasses import dataclass

import numpy as np

from harness.basics.arrays import ByteArray, FloatArray
from harness.objectfile.published.camera import PublishedView
from harness.objectfile.published.entries import PublishedVisionEntry
from harness.objectfile.published.field import Field

_ENDLESS = 1e10
_LEAK = 1e-10

_LEAST_WEIGHT = 1e-5
"""Of a sample, so that no ray is without any."""

_RAYS = 1024
"""At a time: with 384 samples, 393 216 points."""


@dataclass(frozen=True, eq=False)
class PublishedPicture:
    """A picture, before it is rounded.

    Attributes:
        colour: ``(size, size, 3)``, of which 0 is black and 1 white; it may lie beyond.
        cover: ``(size, size)`` share of each pixel that is covered.
    """

    colour: FloatArray
    cover: FloatArray

    def rounded(self) -> ByteArray:
        """``(size, size, 3)`` to the nearest of 256 greys."""
        return np.rint(255.0 * np.clip(self.colour, 0.0, 1.0)).astype(np.uint8)

    def truncated(self) -> ByteArray:
        """The same as the published programs write it: to the grey below."""
        return (255.0 * np.clip(self.colour, 0.0, 1.0)).astype(np.uint8)


def picture_of(
    entry: PublishedVisionEntry,
    fields: tuple[Field, Field | None],
    view: PublishedView,
    size: int,
    offset: float,
) -> PublishedPicture:
    """The picture of a view.

    Args:
        entry: how rays are sampled.
        fields: the only or coarse one, and the fine one.
        view: of the picture.
        size: pixels a side.
        offset: pixels from the corner of a pixel to where its ray is: 0 as published, 0.5 for its centre.
    """
    directions = view.directions(size, offset)
    colour, cover = np.empty((len(directions), 3)), np.empty(len(directions))
    for first in range(0, len(directions), _RAYS):
        at = slice(first, first + _RAYS)
        colour[at], cover[at] = _rays(entry, fields, view, directions[at])
    return PublishedPicture(colour.reshape(size, size, 3), cover.reshape(size, size))


def _rays(
    entry: PublishedVisionEntry,
    fields: tuple[Field, Field | None],
    view: PublishedView,
    directions: FloatArray,
) -> tuple[FloatArray, FloatArray]:
    depths = np.broadcast_to(
        np.linspace(entry.near, entry.far, entry.samples), (len(directions), entry.samples)
    )
    coarse, fine = fields
    raw = _raw(coarse, view, directions, depths)
    if fine is not None:
        weights = ray_weights(raw[..., 3], depths, directions)
        middles = 0.5 * (depths[:, 1:] + depths[:, :-1])
        added = drawn_depths(middles, weights[:, 1:-1], entry.importance)
        depths = np.sort(np.concatenate([depths, added], axis=1), axis=1)
        raw = _raw(fine, view, directions, depths)
    weights = ray_weights(raw[..., 3], depths, directions)
    cover = weights.sum(axis=1)
    colour = _summed(weights, raw, entry.colour)
    return colour + (1.0 - cover)[:, None] if entry.white else colour, cover


def _raw(field: Field, view: PublishedView, directions: FloatArray, depths: FloatArray) -> FloatArray:
    """``(rays, samples, 4)``."""
    points = view.eye + directions[:, None] * depths[..., None]
    units = directions / np.linalg.norm(directions, axis=1, keepdims=True)
    views = np.broadcast_to(units[:, None], points.shape)
    found = field(points.reshape(-1, 3), views.reshape(-1, 3), view.light)
    return found.reshape(*depths.shape, 4)


def ray_weights(density: FloatArray, depths: FloatArray, directions: FloatArray) -> FloatArray:
    """``(r, s)``: how much of each ray's light each sample scatters.

    Args:
        density: ``(r, s)`` raw.
        depths: ``(r, s)`` ascending, along the camera's axis.
        directions: ``(r, 3)`` whose length turns a depth into a distance.
    """
    steps = np.concatenate([np.diff(depths, axis=1), np.full((len(depths), 1), _ENDLESS)], axis=1)
    steps = steps * np.linalg.norm(directions, axis=1, keepdims=True)
    alpha = -np.expm1(-np.maximum(density, 0.0) * steps)
    passed = np.cumprod(1.0 - alpha + _LEAK, axis=1)
    weights: FloatArray = alpha * np.concatenate([np.ones((len(depths), 1)), passed[:, :-1]], axis=1)
    return weights


def drawn_depths(edges: FloatArray, weights: FloatArray, count: int) -> FloatArray:
    """``(r, count)``: depths spaced evenly in the cumulated weights of bins.

    Args:
        edges: ``(r, b + 1)`` of the bins.
        weights: ``(r, b)``.
        count: of depths, from the first edge to the last.
    """
    lifted = weights + _LEAST_WEIGHT
    cumulated = np.cumsum(lifted / lifted.sum(axis=1, keepdims=True), axis=1)
    cumulated = np.concatenate([np.zeros((len(weights), 1)), cumulated], axis=1)
    shares = np.broadcast_to(np.linspace(0.0, 1.0, count), (len(weights), count))
    above = (cumulated[:, None, :] <= shares[:, :, None]).sum(axis=2)
    before, behind = np.maximum(above - 1, 0), np.minimum(above, cumulated.shape[1] - 1)
    low, high = np.take_along_axis(cumulated, before, 1), np.take_along_axis(cumulated, behind, 1)
    width = np.where(high - low < _LEAST_WEIGHT, 1.0, high - low)
    first, last = np.take_along_axis(edges, before, 1), np.take_along_axis(edges, behind, 1)
    found: FloatArray = first + (shares - low) / width * (last - first)
    return found


def _summed(weights: FloatArray, raw: FloatArray, kind: str) -> FloatArray:
    """``(r, 3)``: the weighted colour of every ray; of most samples, nothing is seen."""
    rays, samples = np.nonzero(weights)
    scattered = weights[rays, samples, None] * _colour(raw[rays, samples, :3], kind)
    return np.stack([np.bincount(rays, channel, len(weights)) for channel in scattered.T], axis=1)


def _colour(raw: FloatArray, kind: str) -> FloatArray:
    if kind == "clipped":
        plain = np.clip(raw, 0.0, 1.0)
    else:
        # The two halves of the sigmoid that do not overflow.
        small = np.exp(-np.abs(raw))
        plain = np.where(raw >= 0.0, 1.0, small) / (1.0 + small)
    stretched: FloatArray = 1.2 * (plain - 0.5) + 0.5
    return stretched
