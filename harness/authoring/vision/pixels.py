"""What pixels say of the samples along their rays: lessons for tiny networks that know the surface already.

A pixel is the sum of what its samples scatter, each by its share of the ray's light. What the sum is wrong
by is handed to every sample whole, as if all of them were to move together, which is what neighbouring places
of smooth networks do; then pictures are drawn anew and what is left is handed out again. That is the
simultaneous iterative reconstruction of tomography (Gilbert, Journal of Theoretical Biology 36, 1972), and
unlike a descent through whole rays it leaves every cell's network to be trained alone.
"""

import numpy as np

from harness.authoring.vision.lessons import Lessons
from harness.authoring.vision.seen import SeenRays
from harness.basics.arrays import AnyArray, FloatArray

_LEAST_SHARE = 0.05
"""Of a ray's light: samples that give it less are left alone."""

_LEAST_STOPPED = 0.5
"""Of a ray's light: what passes by more of the time is wrong in its density, not in its colour."""


def pixel_lessons(seen: SeenRays, density_scale: float) -> Lessons:
    """The samples that matter, with the colour that each should have had.

    Args:
        seen: rays, as the networks answer them now.
        density_scale: 1/m of a density of 1.

    Returns:
        Lessons of samples, with lamps of their own; weights are 1 in the mean, and ``depth`` says nothing.
    """
    ray = np.repeat(np.arange(len(seen)), np.diff(seen.first))
    shares = shares_along(density_scale * seen.density.astype(np.float64) * seen.lengths, seen.first)
    stopped = np.bincount(ray, shares, len(seen))
    drawn = np.stack([np.bincount(ray, shares * seen.scattered[:, c], len(seen)) for c in range(3)], axis=1)
    missing = (seen.wanted - drawn) / np.maximum(stopped, _LEAST_STOPPED)[:, None]
    kept = np.flatnonzero((shares >= _LEAST_SHARE) & (stopped[ray] >= _LEAST_STOPPED))
    of, told = ray[kept], seen.extras[ray[kept]]
    # A colour that no surface can have is the nearest one that it can.
    colours = np.clip(seen.scattered[kept] + missing[of], 0.0, 1.0)
    weight = shares[kept] * seen.weight[of]
    return Lessons(
        points=seen.points[kept],
        normals=told[:, 1:],
        colours=colours.astype(np.float32),
        depth=np.zeros(len(kept), np.float32),
        weight=(weight / max(weight.mean(), 1e-9)).astype(np.float32) if len(kept) else weight,
        views=seen.views[of],
        lamps=seen.lights[of],
        seen=told[:, :1],
    )


def shares_along(thick: FloatArray, first: AnyArray) -> FloatArray:
    """``(s,)`` what each sample gives of its ray's light.

    Args:
        thick: ``(s,)`` optical thickness of each, from near to far, ray after ray.
        first: ``(r + 1,)`` where each ray's begin, and the last one's end.
    """
    total = np.concatenate([[0.0], np.cumsum(thick)])
    before = total[:-1] - np.repeat(total[first[:-1]], np.diff(first))
    shares: FloatArray = np.exp(-before) * -np.expm1(-thick)
    return shares
