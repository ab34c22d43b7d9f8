"""What a network of touch learns from: nodes of a surface, presses on it, and the maps of the rasteriser."""

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from harness.basics.arrays import BoolArray, FloatArray
from harness.basics.errors import OutOfDomain, WrongUse
from harness.basics.geometry import inverse
from harness.basics.mesh import Mesh
from harness.bench.sensor import TactileSensor
from harness.objectfile.surface_search import SurfaceSearch
from harness.objectfile.touch.nodes import SurfaceNodes, signatures
from harness.sim.gel.gel import GelSkirt, deform, over_range
from harness.sim.gel.height_file import MOST_BEYOND
from harness.sim.gel.height_map import RasterMesh, height_maps, penetration
from harness.sim.gel.press_pose import Presses, contact_place

DEPTHS = (0.5e-3, 2e-3)
"""m that a press may be deep, as in ObjectFolder 2.0."""

MOST_TILT = float(np.radians(15.0))
"""rad that a gel may lean from the normal, as in ObjectFolder 2.0."""

_CANDIDATES = 12
"""Random places for each patch of one spacing's square."""

_IN_THE_WAY = MOST_BEYOND - 1.0
"""Thicknesses of the gel beyond its own, as where ``sim.touch_press`` draws the line."""

_CHUNK = 64


def choose_nodes(mesh: Mesh, spacing: float, seed: int = 0) -> SurfaceNodes:
    """Choose points so dense that every point of the surface has a near one with a similar normal.

    Random points are added if no earlier point is within ``spacing`` in m. A difference of normals
    counts as distance (``touch_nodes.BEND``), so both sides of an edge have their own points.

    Raises:
        WrongUse: a spacing that is not positive.
    """
    if not (np.isfinite(spacing) and spacing > 0.0):
        raise WrongUse(f"nodes {spacing!r} m apart cannot be placed; give a spacing greater than zero")
    count = max(64, round(_CANDIDATES * float(mesh.face_areas.sum()) / spacing**2))
    points, normals = SurfaceSearch(mesh).spread(count, seed)
    described = signatures(points, normals)
    tree = cKDTree(described)
    alive = np.ones(count, dtype=np.bool_)
    kept = []
    for candidate in range(count):
        if alive[candidate]:
            kept.append(candidate)
            alive[tree.query_ball_point(described[candidate], spacing)] = False
    return SurfaceNodes(points[kept], normals[kept])


def draw_presses(mesh: Mesh, points: FloatArray, seed: int) -> Presses:
    """One random press at each of ``(n, 3)`` places of the surface.

    Depth, tilt, azimuth and yaw are uniform over what a press may be.

    Raises:
        OutOfDomain: a place off the surface.
    """
    return pressed(points, smooth_normals(mesh, points), seed)


def pressed(
    points: FloatArray,
    normals: FloatArray,
    seed: int,
    depths: tuple[float, float] = DEPTHS,
    most_tilt: float = MOST_TILT,
) -> Presses:
    """As ``draw_presses``, where the smooth normals are known.

    Args:
        points: ``(n, 3)`` m, of the surface.
        normals: ``(n, 3)`` unit, outward there.
        seed: of the presses.
        depths: m, least and greatest.
        most_tilt: rad.
    """
    random = np.random.default_rng([seed, 6])
    count = len(points)
    return Presses(
        points=points,
        normals=normals,
        depths=random.uniform(*depths, count),
        tilts=random.uniform(0.0, most_tilt, count),
        azimuths=random.uniform(0.0, 2.0 * np.pi, count),
        yaws=random.uniform(0.0, 2.0 * np.pi, count),
    )


def smooth_normals(mesh: Mesh, points: FloatArray) -> FloatArray:
    """``(n, 3)``: the normals of a press, of ``press_pose.contact_place``, at places of the surface."""
    return np.array([contact_place(mesh, point).normal for point in points]).reshape(-1, 3)


@dataclass(frozen=True, eq=False)
class SimulatedMaps:
    """What the reference simulator gives."""

    maps: FloatArray  #: ``(n, rows, columns)`` m of indentation of the gel.
    possible: BoolArray  #: ``(n,)``: no part of the object is where the sensor would be.


def reference_maps(
    raster: RasterMesh, presses: Presses, sensor: TactileSensor, skirt: GelSkirt
) -> SimulatedMaps:
    """The maps of presses by rasteriser and skirt, the reference level of touch.

    Raises:
        OutOfDomain: a gel that is not flat.
    """
    if sensor.gel_radius is not None:
        raise OutOfDomain(f"{sensor.name} has a dome; give a sensor with a flat gel")
    maps = np.empty((len(presses), sensor.rows, sensor.columns))
    possible = np.empty(len(presses), dtype=np.bool_)
    for first in range(0, len(presses), _CHUNK):
        part = slice(first, first + _CHUNK)
        gap = height_maps(raster, inverse(presses[part].object_from_gel), sensor)
        held, beyond = over_range(penetration(gap, sensor), sensor)
        maps[part], possible[part] = deform(held, skirt), beyond <= _IN_THE_WAY * sensor.gel_thickness
    return SimulatedMaps(maps, possible)
