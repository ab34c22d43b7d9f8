"""The closed surface of a field on a grid, where it crosses a level."""

import numpy as np
from skimage.measure import marching_cubes

from harness.basics.arrays import FloatArray
from harness.basics.errors import OutOfDomain
from harness.basics.mesh import Mesh

_NUDGE = 1e-3
"""Of a cell: no corner is nearer to the surface, so that no face is without area."""

_UNEVEN = 1e-4
"""Of a cell, by which corners differ from what was given: a saddle between equal corners has no one side."""


def isosurface(field: FloatArray, origin: FloatArray, pitch: float) -> Mesh:
    """The surface around all that is below zero, closed at the border of the grid.

    Marching cubes that never leave a hole (Lewiner et al., Journal of Graphics Tools 8(2), 2003).

    Args:
        field: ``(a, b, c)`` at the corners of cells, m; below zero is inside.
        origin: ``(3,)`` m, of the first corner.
        pitch: m between corners, greater than zero.

    Returns:
        Watertight and outward; it leaves the grid by at most a cell where the inside reaches its border.

    Raises:
        OutOfDomain: a field that is empty, not finite, or is nowhere below zero.
    """
    if (
        field.ndim != 3
        or field.size == 0
        or not np.isfinite(field).all()
        or not (np.isfinite(pitch) and pitch > 0.0)
    ):
        raise OutOfDomain(
            f"a field of shape {field.shape} with {np.count_nonzero(~np.isfinite(field))} numbers not "
            f"finite, at a pitch of {pitch:g} m, has no surface; give three axes and a larger pitch"
        )
    if not (field < 0.0).any():
        raise OutOfDomain(
            f"no corner of a grid of {field.shape} corners is inside (the least value is {field.min():.3g} "
            "m); use a finer grid, or check that readings bound a body"
        )
    cells = np.pad(np.asarray(field, np.float64) / pitch, 1, constant_values=1.0)
    cells = np.where(np.abs(cells) < _NUDGE, _NUDGE, cells)
    cells += _UNEVEN * np.random.default_rng(0).uniform(-1.0, 1.0, cells.shape)
    places, faces, _, _ = marching_cubes(  # type: ignore[no-untyped-call]
        cells, 0.0, gradient_direction="descent"
    )
    vertices = np.asarray(origin) + (places.astype(np.float64) - 1.0) * pitch
    return Mesh(vertices, faces.astype(np.int64))
