"""Lines into the space of an unknown object: to what was seen of it, or to where it is estimated to be."""

from collections.abc import Iterator

import numpy as np

from experiments.shape_reconstruction.choosing import BEHIND
from experiments.shape_reconstruction.evidence import SeenMask
from experiments.shape_reconstruction.surface import ShapeEstimate
from harness.basics.arrays import FloatArray
from harness.basics.faces.ray_mesh import RayMesh
from harness.basics.geometry import frame_facing, rotation_about, transform
from harness.bench.sensor import TactileSensor
from harness.sim.solid.surface_samples import random_points
from harness.skills.exploring.lines import LOWEST, LineTarget
from harness.skills.exploring.sensor_face import MIDDLE, face_places, gel_first, ways_of
from harness.skills.exploring.unknown_space import LYING, SeenThing

BEYOND = 0.02
"""M behind the estimated surface where a line ends that meets nothing."""

TILT = float(np.radians(10.0))
"""Rad, the most between a line and the estimated surface's normal; from some 20 degrees on a sensor's housing
is stopped by a plane before its gel is."""

_LESS = (1.0, 0.3, 0.0)
"""Shares of a drawn tilt that are tried in turn: over a flat object the sensor has room for little."""

_STEEPEST = 0.25
"""The way of the gel leads up no more steeply: its z in base."""

_DOWN = 0.3
_LEAST_BEYOND = 1.5e-3


def aims_at_mask(
    look: SeenMask, seen: SeenThing, place: FloatArray, count: int, random: np.random.Generator
) -> Iterator[LineTarget]:
    """Where lines lead after a look: through pixels of the silhouette drawn at random, from any side.

    Args:
        look: the silhouette.
        seen: at which distance the object is.
        place: ``(3,)`` m in base: the frame ``stand``.
        count: of them.
        random: what pixels and distances are drawn from.
    """
    rows, columns = np.nonzero(look.mask)
    drawn = random.integers(len(rows), size=count)
    height, width = look.mask.shape
    pixels = np.column_stack([columns[drawn] + 0.5 - 0.5 * width, rows[drawn] + 0.5 - 0.5 * height])
    rays = np.column_stack([pixels / look.focal_length, np.ones(count)]) @ look.stand_from_camera[:3, :3].T
    eye = look.stand_from_camera[:3, 3] + place
    if seen.lies:
        share = (place[2] + LYING - eye[2]) / rays[:, 2]
    else:
        sight = np.array([*(seen.middle - eye)[:2], 0.0])
        share = (sight @ (seen.middle - eye)) / (rays @ sight)
    ends = eye + share[:, None] * rays
    ends[:, :2] += random.normal(size=count)[:, None] * seen.off
    for end in ends:
        yield LineTarget(np.array([*end[:2], max(end[2], place[2])]), above=seen.lies)


def lines_at_surface(
    estimate: ShapeEstimate, sensor: TactileSensor, count: int, random: np.random.Generator
) -> FloatArray:
    """``(n, 4, 4)`` in ``stand``: where the gel would end, led to places drawn on an estimate's surface.

    Args:
        estimate: of the shape.
        sensor: whose face stays above the support.
        count: of the places drawn; fewer lines, as none leads steeply up, or past the estimate, or where the
            estimate meets the sensor's housing before its gel.
        random: what places, tilts and turns are drawn from.
    """
    points, faces = random_points(estimate.mesh, count, random)
    normals = estimate.mesh.face_normals[faces]
    drawn = [_line(*one, 0.5 * max(sensor.housing), random) for one in zip(points, normals, strict=True)]
    lines = np.array([line for line in drawn if line is not None]).reshape(-1, 4, 4)
    places = face_places(sensor.housing, sensor.gel_thickness)
    hits = RayMesh(estimate.mesh).first_hits(*ways_of(lines, places, BEHIND))
    along = hits.distance.reshape(-1, len(places))
    return np.asarray(lines[gel_first(along)[0] & (along[:, MIDDLE] <= BEHIND - _LEAST_BEYOND)])


def _line(
    point: FloatArray, normal: FloatArray, half: float, random: np.random.Generator
) -> FloatArray | None:
    """``(4, 4)`` in ``stand``; None where the gel would lead steeply up, or no room is behind the place."""
    aside = frame_facing(-normal, random.uniform(0.0, 2.0 * np.pi))[:, 0]
    tilt, turn = random.uniform(0.0, TILT), random.uniform(0.0, 2.0 * np.pi)
    for share in _LESS:
        forward = rotation_about(aside, share * tilt) @ -normal
        end = None if forward[2] > _STEEPEST else _end(point, forward, half)
        if end is not None:
            return transform(frame_facing(forward, turn), end)
    return None


def _end(point: FloatArray, forward: FloatArray, half: float) -> FloatArray | None:
    """``(3,)`` m in ``stand``: behind a place, the sensor off the support; None where no room is behind it.

    A line that leads down ends earlier; one that leads aside is raised, and meets the object higher up.
    """
    lowest = LOWEST + half * float(np.hypot(forward[0], forward[1]))
    if forward[2] < -_DOWN:
        beyond = min(BEYOND, (lowest - point[2]) / forward[2])
        return point + beyond * forward if beyond >= _LEAST_BEYOND else None
    end = point + BEYOND * forward
    end[2] = max(end[2], lowest)
    return np.asarray(end)
