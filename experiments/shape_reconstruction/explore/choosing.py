"""Choose the line that the gel follows next: candidate lines, and a score for each.

The default score is the reduction of the Bayes risk: the hypotheses of the estimate stand for the truth, each
by its weight; the risk is the mean distance by which answers are judged, less that after the press is read.
"""

from collections.abc import Callable, Iterator, Sequence

import numpy as np
from scipy.spatial import cKDTree

from experiments.shape_reconstruction import thresholds as limits
from experiments.shape_reconstruction.evidence import SeenMask, ShapeEvidence
from experiments.shape_reconstruction.family.distance import distances
from experiments.shape_reconstruction.family.field import corners_of, grid_distances
from experiments.shape_reconstruction.family.kind import FamilyShape
from experiments.shape_reconstruction.family.rays import first_hit
from experiments.shape_reconstruction.fits import FamilyFit, ShapeEstimate
from experiments.shape_reconstruction.section import Choice
from harness.basics.arrays import FloatArray, IntArray
from harness.basics.faces.ray_mesh import RayMesh
from harness.basics.geometry import frame_facing, rotation_about, transform
from harness.bench.sensor import TactileSensor
from harness.sim.solid.surface_samples import random_points
from harness.skills.exploring.bayes_risk import bayes_risk, bayes_risk_after
from harness.skills.exploring.lines import LOWEST, MIDDLE, LineTarget, face_places, gel_first, ways_of
from harness.skills.exploring.unknown_space import LYING, SeenThing

Chooser = Callable[[ShapeEvidence, ShapeEstimate | None, FloatArray], FloatArray]
"""Of evidence, an estimate (None where there is none yet) and ``(n, 4, 4)`` ``stand_from_gel`` at the ends of
lines, drawn at random, that the gel would follow along its z: ``(n,)`` scores; the greatest goes first."""

BEHIND = 0.3
"""M before a line's end from where on it is looked for the estimate's surface."""


def blindly(_evidence: ShapeEvidence, _estimate: ShapeEstimate | None, lines: FloatArray) -> FloatArray:
    """All alike: they are drawn at random, and followed in that order."""
    return np.zeros(len(lines))


def farthest(evidence: ShapeEvidence, estimate: ShapeEstimate | None, lines: FloatArray) -> FloatArray:
    """M from where a line should meet the object to the nearest place that a way has led to."""
    led = [
        touch.points.mean(axis=0) if touch.met else touch.stand_from_gel[:3, 3] for touch in evidence.touches
    ]
    if not led:
        return np.zeros(len(lines))
    return np.asarray(cKDTree(np.array(led)).query(meeting_places(estimate, lines))[0])


def most_informative(
    evidence: ShapeEvidence, estimate: ShapeEstimate | None, lines: FloatArray
) -> FloatArray:
    """M of expected error that a press along each line spares; as ``farthest`` while likely shapes agree."""
    spared = None if estimate is None else error_spared(evidence, estimate, lines)
    return farthest(evidence, estimate, lines) if spared is None else spared


CHOOSERS: dict[Choice, Chooser] = {"random": blindly, "farthest": farthest, "active": most_informative}
"""Of lines into what is not known, by ``shape.choose``."""


def meeting_places(estimate: ShapeEstimate | None, lines: FloatArray) -> FloatArray:
    """``(n, 3)`` m in ``stand``: where lines meet an estimate first; their ends where they meet nothing.

    Args:
        estimate: None where there is none yet.
        lines: ``(n, 4, 4)``.
    """
    ends, forward = lines[:, :3, 3], lines[:, :3, 2]
    if estimate is None:
        return ends
    found = RayMesh(estimate.mesh).first_hits(ends - BEHIND * forward, forward)
    short = np.minimum(found.distance, BEHIND)  # a line that passes the surface by ends where it was to end
    return np.asarray(ends - (BEHIND - short)[:, None] * forward)


BEFORE = 0.15
"""M before a line's end from where on it is followed."""

DEPTH, NORMAL = 1.5e-3, 0.25
"""M and length of a unit normal's change: deviations of what is read, with how far shapes of the family are
off real ones."""

MOST = 18.0
"""Half squares that two readings differ by at most, and a line that is met and one that is not."""

CELL, MOST_CELLS, NEAR = 5.0e-3, 60, 0.6
"""M of the grid on which shapes are compared, how many cells it has along a side, and how near to a surface,
in cells, a place of it is of that."""

SHAPES = 80
"""Of hypotheses and the shapes drawn about them, as many of each, at most, roughly."""

_ASIDE = 3.0e-3


def error_spared(evidence: ShapeEvidence, estimate: ShapeEstimate, lines: FloatArray) -> FloatArray | None:
    """By how much a press along each line should lower the mean distance of the answer from the truth.

    Args:
        evidence: says how large an object may be.
        estimate: by the family, with its hypotheses.
        lines: ``(n, 4, 4)`` ``stand_from_gel`` at the ends of lines along their z.

    Returns:
        ``(n,)`` m, none negative; None where the estimate is not of the family, or its hypotheses are alike.
    """
    if not isinstance(estimate, FamilyFit):
        return None
    shapes: list[FamilyShape] = []
    shares: list[float] = []
    mixture = estimate.mixture
    count = SHAPES // len(mixture.hypotheses)
    for one, weight, about in zip(mixture.hypotheses, mixture.weights, mixture.about, strict=True):
        every = [one.shape, *about[:count]]
        shapes += every
        shares += [float(weight) / len(every)] * len(every)
    weights, apart = np.array(shares), distances_apart(shapes)
    now = bayes_risk(weights, apart)
    if now < limits.MIN_EXPECTED_ERROR:
        return None
    face = evidence.housing, evidence.gel_thickness
    read = readings_on(shapes, lines, max(BEFORE, 0.5 * evidence.largest), face)
    left = np.array([bayes_risk_after(one, weights, apart, MOST) for one in read.transpose(1, 0, 2)])
    return np.maximum(now - left, 0.0)  # rounding apart, no reading makes it worse


def readings_on(
    shapes: Sequence[FamilyShape], lines: FloatArray, back: float, face: tuple[tuple[float, float], float]
) -> FloatArray:
    """What a press along each line reads on each shape, in deviations of a reading.

    Args:
        shapes: in ``stand``.
        lines: ``(n, 4, 4)`` ``stand_from_gel`` at their ends.
        back: m before its end from where on each is followed.
        face: m, sides ``(x, y)`` of the sensor's housing, and by how much the gel stands out of it.

    Returns:
        ``(shapes, n, 4)``: how far from its end the gel is stopped, and the surface's normal there; infinite
        where the gel goes on to the line's end, or the housing stops it.
    """
    places = face_places(*face)
    starts, ways = ways_of(lines, places, back)
    rows, found = np.arange(len(lines)), np.full((len(shapes), len(lines), 4), np.inf)
    for one, shape in zip(found, shapes, strict=True):
        along = first_hit(shape.code, shape.theta, starts, ways, back).reshape(-1, len(places))
        met, first = gel_first(along)
        gone = along[rows, first][met]
        depth = back - gone
        at = starts.reshape(-1, len(places), 3)[rows, first][met] + gone[:, None] * lines[met, :3, 2]
        steps = _ASIDE * np.concatenate([np.eye(3), -np.eye(3)])
        around = (at[:, None] + steps).reshape(-1, 3)
        gaps = distances(shape.code, shape.theta, around).reshape(-1, 6)
        slopes = gaps[:, :3] - gaps[:, 3:]
        normals = slopes / np.maximum(np.linalg.norm(slopes, axis=1, keepdims=True), 1e-12)
        one[met] = np.column_stack([depth / DEPTH, normals / NORMAL])
    return found


def distances_apart(shapes: Sequence[FamilyShape]) -> FloatArray:
    """``(n, n)`` m, roughly: half the sum of the mean distances from each surface to each other one."""
    corners = np.concatenate([corners_of(shape) for shape in shapes])
    low, high = corners.min(axis=0) - CELL, corners.max(axis=0) + CELL
    cell = max(CELL, float((high - low).max()) / MOST_CELLS)
    counts: IntArray = np.ceil((high - low) / cell).astype(np.int64) + 1
    # By places, then shapes: those near one surface are rows.
    gaps = np.column_stack([grid_distances(shape, low, cell, counts).ravel() for shape in shapes])
    one_way = np.zeros((len(shapes), len(shapes)))
    for k in range(len(shapes)):
        near = gaps[np.abs(gaps[:, k]) < NEAR * cell]
        if len(near):
            one_way[k] = np.abs(near - near[:, k : k + 1]).mean(axis=0)
    return 0.5 * (one_way + one_way.T)


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
        if forward[2] > _STEEPEST:
            continue
        # Behind the place, the sensor off the support: a line that leads down ends earlier; one that leads
        # aside is raised, and meets the object higher up.
        lowest = LOWEST + half * float(np.hypot(forward[0], forward[1]))
        if forward[2] < -_DOWN:
            beyond = min(BEYOND, (lowest - point[2]) / forward[2])
            if beyond < _LEAST_BEYOND:
                continue
            end = point + beyond * forward
        else:
            end = point + BEYOND * forward
            end[2] = max(end[2], lowest)
        return transform(frame_facing(forward, turn), end)
    return None
