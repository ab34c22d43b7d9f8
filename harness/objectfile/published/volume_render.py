"""Volume renderer in NumPy: sample every ray at given depths and composite the samples front to back.

``alpha = 1 - exp(-density * step)``, ``weight = alpha * prod(1 - alpha + 1e-10)`` over the samples in front;
the last step is endless. The published looks and the rows 1.0 and 2.0 of the rendering tables use it.
"""

from collections.abc import Callable

import numpy as np

from harness.basics.arrays import FloatArray

Field = Callable[[FloatArray, FloatArray], tuple[FloatArray, FloatArray]]
"""``(n, 3)`` points and ``(n, 3)`` unit view directions, away from the camera, to ``(n,)`` densities in one
over the unit of length, below zero counting as zero, and ``(n, 3)`` colours."""

_ENDLESS = 1e10
_LEAK = 1e-10

_MIN_WEIGHT = 1e-5
"""Added to every sample's weight, so that further samples can be placed on a ray that hits nothing."""

_RAYS = 1024
"""Rays at a time; with 384 samples each, 393 216 points."""


def render_rays(
    field: Field,
    eye: FloatArray,
    directions: FloatArray,
    depths: FloatArray,
    fine: Field | None = None,
    further: int = 0,
) -> tuple[FloatArray, FloatArray]:
    """Render the colour of every ray before a black background.

    Args:
        field: density and colour at the first samples.
        eye: ``(3,)`` origin of the rays.
        directions: ``(r, 3)``, of any length: a depth is along the ray in units of it.
        depths: ``(s,)`` ascending depths of the samples.
        fine: field at all samples, if there are further ones.
        further: number of samples to add on each ray, placed by the weights of the first ones.

    Returns:
        ``(r, 3)`` colours and ``(r,)`` the fraction of each ray that is covered; add ``1 - cover`` times the
        background's colour.
    """
    colour, cover = np.empty((len(directions), 3)), np.empty(len(directions))
    for first in range(0, len(directions), _RAYS):
        at = slice(first, first + _RAYS)
        rays = directions[at]
        along = np.broadcast_to(depths, (len(rays), len(depths)))
        density, colours = _sampled(field, eye, rays, along)
        if fine is not None:
            weights = ray_weights(density, along, rays)
            added = further_depths(0.5 * (along[:, 1:] + along[:, :-1]), weights[:, 1:-1], further)
            along = np.sort(np.concatenate([along, added], axis=1), axis=1)
            density, colours = _sampled(fine, eye, rays, along)
        weights = ray_weights(density, along, rays)
        colour[at], cover[at] = np.einsum("rs,rsc->rc", weights, colours), weights.sum(axis=1)
    return colour, cover


def _sampled(
    field: Field, eye: FloatArray, directions: FloatArray, depths: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """``(r, s)`` densities and ``(r, s, 3)`` colours."""
    points = eye + directions[:, None] * depths[..., None]
    units = directions / np.linalg.norm(directions, axis=1, keepdims=True)
    views = np.broadcast_to(units[:, None], points.shape)
    density, colours = field(points.reshape(-1, 3), views.reshape(-1, 3))
    return density.reshape(depths.shape), colours.reshape(*depths.shape, 3)


def ray_weights(density: FloatArray, depths: FloatArray, directions: FloatArray) -> FloatArray:
    """Compute the fraction of each ray's light that each sample scatters.

    Args:
        density: ``(r, s)``; below zero counts as zero.
        depths: ``(r, s)`` ascending.
        directions: ``(r, 3)`` whose length turns a depth into a distance.

    Returns:
        ``(r, s)``, 0 to 1.
    """
    steps = np.concatenate([np.diff(depths, axis=1), np.full((len(depths), 1), _ENDLESS)], axis=1)
    steps = steps * np.linalg.norm(directions, axis=1, keepdims=True)
    alpha = -np.expm1(-np.maximum(density, 0.0) * steps)
    passed = np.cumprod(1.0 - alpha + _LEAK, axis=1)
    weights: FloatArray = alpha * np.concatenate([np.ones((len(depths), 1)), passed[:, :-1]], axis=1)
    return weights


def further_depths(edges: FloatArray, weights: FloatArray, count: int) -> FloatArray:
    """Place depths evenly in the cumulated weights of bins (Mildenhall et al., NeRF, 2020, section 5.2).

    Args:
        edges: ``(r, b + 1)`` of the bins.
        weights: ``(r, b)``.
        count: number of depths, from the first edge to the last.

    Returns:
        ``(r, count)``.
    """
    lifted = weights + _MIN_WEIGHT
    cumulated = np.cumsum(lifted / lifted.sum(axis=1, keepdims=True), axis=1)
    cumulated = np.concatenate([np.zeros((len(weights), 1)), cumulated], axis=1)
    fractions = np.broadcast_to(np.linspace(0.0, 1.0, count), (len(weights), count))
    above = (cumulated[:, None, :] <= fractions[:, :, None]).sum(axis=2)
    before, behind = np.maximum(above - 1, 0), np.minimum(above, cumulated.shape[1] - 1)
    low, high = np.take_along_axis(cumulated, before, 1), np.take_along_axis(cumulated, behind, 1)
    width = np.where(high - low < _MIN_WEIGHT, 1.0, high - low)
    first, last = np.take_along_axis(edges, before, 1), np.take_along_axis(edges, behind, 1)
    depths: FloatArray = first + (fractions - low) / width * (last - first)
    return depths


def stretched_sigmoid(raw: FloatArray) -> FloatArray:
    """Convert raw colours to displayed ones: a sigmoid stretched by 1.2 about a half, as published."""
    colours: FloatArray = 0.5 + 0.6 * np.tanh(0.5 * raw)
    return colours
