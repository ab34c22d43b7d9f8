"""Pictures of an object along the tool: for the touch term, and for where a housing fits."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.ndimage import minimum_filter

from harness.basics.arrays import FloatArray, read_only
from harness.basics.geometry import transform
from harness.bench.sensor import TactileSensor
from harness.sim.gel.height_map import RasterMesh, first_surface

_SLACK = 3.0e-3
"""Metres by which place and picture may disagree: arm, shape, attitude over the window's width."""

_MARGIN = 4.0e-3
"""Metres around the object: a tool's line may miss it by a little while the gel still touches."""


FirstSurface = Callable[[FloatArray, float, int, int], FloatArray]
"""As ``height_map.first_surface`` of one object: from a view, a pitch in m, rows and columns to depths."""

LEAN = 7
"""Numbers of a fit that say what an attitude which is expected of the gel changes of its score."""

POOL = 4
"""Pixels of a view, each way, that share the limits on where the gel can be."""


@dataclass(frozen=True, eq=False)
class ToolView:
    """The object seen along the tool, with the touch term at each place filled in on demand."""

    object_from_view: FloatArray  #: ``(3, 3)``, columns x and y of the gel's image and z along the tool.
    origin: FloatArray  #: ``(2,)`` metres, view x and y of the centre of pixel (0, 0).
    pitch: float  #: metres a pixel, half of the touch map's.
    depth: FloatArray  #: ``(rows, columns)`` metres along z of the first surface, inf where there is none.
    nearest: FloatArray
    """for blocks of ``POOL`` pixels each way, metres along z: the gel's centre cannot be nearer to the arm,
    or nothing would touch it."""
    farthest: FloatArray
    """for the same blocks, metres along z: it cannot be farther, or the object would reach through the
    gel."""
    score: FloatArray  #: ``(rows, columns)`` nats, NaN where not asked for yet.
    gel_depth: FloatArray  #: ``(rows, columns)`` metres along z of the gel's centre, from the fit.
    lean: FloatArray
    """``(rows, columns, LEAN)`` of the fit: what an attitude expected of the gel changes of the score."""


def view_along(
    surface: FirstSurface,
    samples: FloatArray,
    object_from_gel: FloatArray,
    pitch: float,
    sensor: TactileSensor,
) -> ToolView:
    """The object as the gel would meet it, everywhere at once.

    Args:
        surface: of the object: ``first_surface`` of a mesh, or what stands for it.
        samples: ``(n, 3)`` metres, points of its surface that say how far it reaches.
        object_from_gel: ``(3, 3)`` rotation; its third column is the way the tool points.
        pitch: metres a pixel.
        sensor: gives the gel's window and thickness.
    """
    across = object_from_gel[:, :2].T @ samples.T
    low, high = across.min(axis=1), across.max(axis=1)
    columns, rows = np.ceil((high - low) / pitch).astype(np.int64) + 2 * round(_MARGIN / pitch)
    centre = 0.5 * (low + high)
    view_from_object = transform(object_from_gel.T, np.array([-centre[0], -centre[1], 0.0]))
    depth = surface(view_from_object, pitch, int(rows), int(columns))
    origin = centre - 0.5 * pitch * np.array([columns - 1.0, rows - 1.0])
    return view_of(depth, object_from_gel, origin, pitch, sensor)


def view_of(
    depth: FloatArray, object_from_gel: FloatArray, origin: FloatArray, pitch: float, sensor: TactileSensor
) -> ToolView:
    """A view of a depth image, with the range of depths at which the gel's window meets something.

    Args:
        depth: ``(rows, columns)`` metres along the tool to the first surface; inf where none.
        object_from_gel: ``(3, 3)`` rotation; its third column is the way the tool points.
        origin: ``(2,)`` metres across the tool, of the first pixel's centre.
        pitch: metres a pixel.
        sensor: gives the gel's window and thickness.
    """
    # The rows first, by whole rows at a time: several times as fast as blocks.
    by_rows = np.minimum.reduceat(depth, np.arange(0, depth.shape[0], POOL), axis=0)
    pooled = np.asarray(np.minimum.reduceat(by_rows, np.arange(0, depth.shape[1], POOL), axis=1))
    nearest = _front(pooled, pitch, sensor.window, _SLACK) - _SLACK
    farthest = _front(pooled, pitch, sensor.window, -_SLACK) + sensor.gel_thickness + _SLACK
    missing = np.full(depth.shape, np.nan)
    return ToolView(
        read_only(object_from_gel.copy()),
        read_only(origin),
        pitch,
        read_only(np.ascontiguousarray(depth)),
        nearest,
        farthest,
        missing,
        missing.copy(),
        np.zeros((*depth.shape, LEAN)),
    )


def _front(pooled: FloatArray, pitch: float, window: tuple[float, float], wider: float) -> FloatArray:
    """The first surface under a window, widened on every side, centred on each block."""
    columns, rows = (2 * round((0.5 * side + wider) / (POOL * pitch)) + 1 for side in window)
    return np.asarray(minimum_filter(pooled, size=(rows, columns), mode="constant", cval=np.inf))


def window_depth(
    raster: RasterMesh,
    object_from_gel: FloatArray,
    centre_in_object: FloatArray,
    size: tuple[float, float],
    pitch: float,
) -> FloatArray:
    """``(rows, columns)`` metres along the tool from a centre to the first surface; inf where none.

    Args:
        raster: the object.
        object_from_gel: ``(3, 3)`` rotation; its third column is the way the tool points.
        centre_in_object: ``(3,)`` metres, under the middle pixel.
        size: metres (x, y); both sides get an odd number of pixels.
        pitch: metres a pixel.
    """
    columns, rows = (2 * round(0.5 * side / pitch) + 1 for side in size)
    view_from_object = transform(object_from_gel.T, -object_from_gel.T @ centre_in_object)
    return first_surface(raster, view_from_object, pitch, rows, columns)
