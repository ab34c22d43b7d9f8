"""Coordinates of a mesh file far from its origin: moved near to it, or refused where they are too coarse."""

import numpy as np

from harness.basics.arrays import FloatArray, IntArray
from harness.basics.errors import MeshRefused

_FAR = 1e3
"""Sizes of the object from the origin above which it is moved: below, float64 keeps 13 digits of its size."""

_MAX_STEP = 1e-4
"""Step of the coordinates, as a fraction of the object's size: with more, walls and frequencies are off by
more than 0.1 %."""


def move_near(
    vertices: FloatArray, used: IntArray, name: str, single: bool = False
) -> tuple[FloatArray, tuple[str, ...]]:
    """Move an object that is far from the origin there, by its first vertex.

    Georeferenced files place an object millions of metres from the origin, where sums over its volume lose
    their digits and simulators with float32 coordinates lose its shape.

    Args:
        vertices: ``(n, 3)`` in the file's unit; values that are no numbers stay as they are.
        used: indices of the vertices that faces or cells use.
        name: name of the file.
        single: the file holds float32 coordinates.

    Returns:
        The vertices, and a note that states the offset where they were moved.

    Raises:
        MeshRefused: neighbouring numbers of the file's type are too far apart to hold the shape.
    """
    places = vertices[np.unique(used)]
    places = places[np.isfinite(places).all(axis=1)]
    if not len(places):
        return vertices, ()
    low, high = places.min(axis=0), places.max(axis=0)
    size, farthest = float((high - low).max()), float(np.maximum(np.abs(low), np.abs(high)).max())
    step = float(np.spacing(np.float32(farthest) if single else np.float64(farthest)))
    if farthest > 0.0 and step > _MAX_STEP * size and (single or size > 0.0):
        raise MeshRefused(
            f"{name}: float{32 if single else 64} coordinates of up to {farthest:.4g} have steps of "
            f"{step:.2g}, too coarse for an object {size:.4g} long; move it to the origin and export it again"
        )
    if farthest <= _FAR * size or size == 0.0:
        return vertices, ()
    offset = ", ".join(f"{-value:.10g}" for value in places[0])
    return vertices - places[0], (
        f"it is up to {farthest / size:.1e} object lengths from the origin: moved by ({offset}) in its unit",
    )
