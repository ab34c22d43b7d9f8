"""Pictures of the bench, of the contacts and of the posterior, with their labels."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from scipy.ndimage import gaussian_filter, map_coordinates

from harness.basics.arrays import FloatArray
from harness.basics.geometry import apply, rotation_about, transform, translation
from harness.basics.mesh import Mesh, closed_hull
from harness.bench.kinematics import arm_table, link_frames
from harness.bench.sensor import TactileSensor
from harness.picture.pinhole import Pinhole
from harness.report.figures.shading import BenchPart, Shot, look_at
from harness.report.figures.style import ANSWER, DPI, HEAT, INK, TOOL, TRUTH, blank
from harness.twin.link_hulls import link_hulls

_ELEVATION = np.radians(28.0)
_STEEPEST = np.radians(85.0)
_KERNEL = 2.5e-3
_PITCH = 1.25e-3
_LIFT = 3e-3
_BENCH_WIDTH = 1.1
"""Metres across the picture of the bench at its focus."""

ALUMINIUM, BLUE, FOAM = (0.80, 0.82, 0.84), (0.45, 0.60, 0.74), (0.46, 0.48, 0.54)
TABLE, HOUSING, GEL = (0.94, 0.92, 0.88), (0.30, 0.31, 0.34), (0.93, 0.74, 0.38)
MOUNT = (0.55, 0.56, 0.60)
CLAY = (0.93, 0.91, 0.87)

_Z = np.array([0.0, 0.0, 1.0])


@dataclass(frozen=True, eq=False)
class Posterior:
    """The posterior of a contact, as weighted points on the object."""

    points: FloatArray  #: ``(n, 3)`` metres, object frame.
    weights: FloatArray  #: ``(n,)``, not negative, any sum but zero.
    estimate: FloatArray  #: ``(3,)`` metres.
    modes: FloatArray  #: ``(k, 3)`` metres, separate likely positions, the likeliest first.
    mode_weights: FloatArray  #: ``(k,)`` fraction of the posterior at each position.
    credible90: float  #: radius in m around the estimate that contains 90 % of the posterior.


@dataclass(frozen=True, eq=False)
class Sides:
    """The object seen from the side of the answer and from the opposite one."""

    shots: tuple[Shot, Shot]  #: the two views.
    size: float  #: metres, diagonal of the object's box.


def object_sides(mesh: Mesh, towards: FloatArray, pixels: int) -> Sides:
    """Two views of the object, the first with ``(3,)`` point ``towards`` in front.

    Args:
        mesh: metres, object frame.
        towards: metres, a point of the object.
        pixels: rows and columns of each view.
    """
    offset = towards - mesh.bounds.mean(axis=0)
    bearing = float(np.arctan2(offset[1], offset[0])) if np.hypot(*offset[:2]) > 1e-4 else np.radians(-60.0)
    # Half a radian aside, so that a tool axis is seen as a line and not as a point.
    cameras = [_framing(mesh, bearing + turn, pixels) for turn in (0.5, 0.5 + np.pi)]
    part = (BenchPart(mesh, np.eye(4), CLAY),)
    return Sides((Shot(part, cameras[0]), Shot(part, cameras[1])), mesh.diagonal)


def close_up(mesh: Mesh, place: FloatArray, away: FloatArray, width: float, pixels: int) -> Shot:
    """A view of the object about a point of it.

    Args:
        mesh: metres, object frame.
        place: ``(3,)`` metres, in the middle.
        away: ``(3,)`` from the point to the eye, of any length but zero.
        width: metres across the picture at the point.
        pixels: rows and columns.
    """
    azimuth = float(np.arctan2(away[1], away[0]))
    elevation = float(np.arctan2(away[2], np.hypot(away[0], away[1])))
    # From straight above there would be no telling which way is up.
    camera = look_at(place, azimuth, np.clip(elevation, -_STEEPEST, _STEEPEST), width, pixels, pixels)
    return Shot((BenchPart(mesh, np.eye(4), CLAY),), camera)


def _framing(mesh: Mesh, azimuth: float, pixels: int) -> Pinhole:
    """A square view that the object fills but for a margin for the tool axes."""
    focus, width = mesh.bounds.mean(axis=0), mesh.diagonal
    camera = look_at(focus, azimuth, _ELEVATION, width, pixels, pixels)
    seen = camera.project(mesh.vertices)[0] / pixels
    low, high = seen.min(axis=0), seen.max(axis=0)
    aside = (0.5 * (low + high) - 0.5) * width
    focus = focus + aside @ camera.camera_from_object[:2, :3]
    return look_at(focus, azimuth, _ELEVATION, 1.22 * width * float((high - low).max()), pixels, pixels)


class Heat:
    """Colours a surface by the density of a posterior relative to its peak.

    The density is that of the weighted places, blurred by 2.5 mm on a grid about them.
    """

    def __init__(self, posterior: Posterior) -> None:
        weights = posterior.weights / posterior.weights.max()
        kept = weights > 1e-5
        places = posterior.points[kept]
        self._low = places.min(axis=0) - 4.0 * _KERNEL
        cells = np.ceil((places.max(axis=0) + 4.0 * _KERNEL - self._low) / _PITCH).astype(int) + 2
        self._grid = np.zeros(cells)
        at = (places - self._low) / _PITCH
        nearest = np.round(at).astype(int)
        np.add.at(self._grid, tuple(nearest.T), weights[kept])
        self._grid = gaussian_filter(self._grid, _KERNEL / _PITCH, mode="constant", truncate=3.5)
        self._peak = max(float(self._density(places).max()), 1e-300)

    def __call__(self, points: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Colours and opacities of ``(n, 3)`` points in metres, object frame."""
        level = np.sqrt(np.clip(self._density(points) / self._peak, 0.0, 1.0))
        return np.asarray(HEAT(level)[:, :3]), np.clip(4.0 * level, 0.0, 1.0)

    def _density(self, points: FloatArray) -> FloatArray:
        at = (points - self._low) / _PITCH
        return np.asarray(map_coordinates(self._grid, at.T, order=1, mode="constant"))


def bench_figure(parts: tuple[BenchPart, ...], base_from_gels: FloatArray, focus: FloatArray) -> Figure:
    """Render bench and object with the tool axis of every contact.

    Args:
        parts: bodies, including the object.
        base_from_gels: ``(n, 4, 4)`` gel poses of the contacts.
        focus: ``(3,)`` m in the base frame, the centre of the picture.
    """
    camera = look_at(focus, np.radians(-118.0), np.radians(22.0), _BENCH_WIDTH, 680, 1040)
    shot = Shot(parts, camera)
    figure = blank(camera.width / DPI, camera.height / DPI)
    axes = figure.add_axes((0.0, 0.0, 1.0, 1.0))
    axes.set_axis_off()
    picture = shot.picture()
    axes.imshow(picture)
    for base_from_gel in base_from_gels:
        _tool_axis(axes, shot, base_from_gel, "", 0.05, 7.5)
    _crop(figure, axes, picture)
    return figure


def contacts_figure(sides: Sides, object_from_gels: FloatArray, truths: FloatArray | None) -> Figure:
    """Render the object from two sides with the tool axis of every contact.

    Args:
        sides: views of the object.
        object_from_gels: ``(n, 4, 4)`` estimated gel poses.
        truths: ``(n, 3)`` m, true contacts in the object's frame; None if unknown.
    """
    figure, both = _row(2, 5.4)
    for axes, shot in zip(both, sides.shots, strict=True):
        axes.imshow(shot.picture())
        for number, pose in enumerate(object_from_gels, start=1):
            _tool_axis(axes, shot, pose, str(number), 0.14 * sides.size, 9.0)
            if truths is not None:
                mark(axes, shot, truths[number - 1], "*", TRUTH, 130.0)
    return figure


def posterior_strip(sides: Sides, posteriors: Mapping[int, Posterior], truths: FloatArray | None) -> Figure:
    """Render the posterior after each contact from both sides, one column per contact.

    Args:
        sides: views of the object.
        posteriors: one or more posteriors by the number of the contact, from 1.
        truths: ``(n, 3)`` m, true contacts in the object's frame; None if unknown.
    """
    figure = blank(2.0 * len(posteriors), 4.25)
    grid = np.asarray(figure.subplots(2, len(posteriors), squeeze=False))
    figure.subplots_adjust(0.0, 0.0, 1.0, 0.94, 0.02, 0.02)
    for (number, posterior), column in zip(posteriors.items(), grid.T, strict=True):
        column[0].set_title(f"after contact {number}", fontsize=10)
        heat = Heat(posterior)
        for axes, shot in zip(column, sides.shots, strict=True):
            _posterior_on(axes, shot, posterior, heat, None if truths is None else truths[number - 1], 34.0)
    return figure


def posterior_figure(sides: Sides, posterior: Posterior, truth: FloatArray | None) -> Figure:
    """Render the posterior of one contact, large; ``truth`` is ``(3,)`` metres, or None if unknown."""
    figure, both = _row(2, 5.4)
    heat = Heat(posterior)
    for axes, shot in zip(both, sides.shots, strict=True):
        _posterior_on(axes, shot, posterior, heat, truth, 150.0)
    return figure


def _posterior_on(
    axes: Axes, shot: Shot, posterior: Posterior, heat: Heat, truth: FloatArray | None, size: float
) -> None:
    axes.imshow(shot.picture(0, heat))
    axes.set_axis_off()
    for place in posterior.modes[1:]:
        mark(axes, shot, place, "o", INK, 0.45 * size, hollow=True)
    mark(axes, shot, posterior.estimate, "P", ANSWER, size)
    if truth is not None:
        mark(axes, shot, truth, "*", TRUTH, 1.3 * size)


def _tool_axis(
    axes: Axes, shot: Shot, world_from_gel: FloatArray, label: str, length: float, size: float
) -> None:
    """An arrow from the sensor to the contact; pale where the object hides it."""
    ends = apply(world_from_gel, np.array([[0.0, 0.0, 0.0], [0.0, 0.0, -length]]))
    pixels = shot.camera.project(ends)[0]
    hidden = bool(shot.hidden(ends[:1], 2.0 * _LIFT)[0])
    strength = 0.3 if hidden else 1.0
    axes.annotate(
        "",
        xy=tuple(pixels[0]),
        xytext=tuple(pixels[1]),
        arrowprops={
            "arrowstyle": "-|>",
            "color": TOOL,
            "lw": 1.3,
            "alpha": strength,
            "shrinkA": 0,
            "shrinkB": 0,
        },
    )
    if not label:
        return
    axes.text(
        float(pixels[1, 0]),
        float(pixels[1, 1]),
        label,
        fontsize=size,
        color="white",
        alpha=max(strength, 0.55),
        ha="center",
        va="center",
        bbox={
            "boxstyle": "circle,pad=0.22",
            "fc": TOOL,
            "ec": "white",
            "lw": 0.8,
            "alpha": max(strength, 0.45),
        },
    )


def mark(
    axes: Axes, shot: Shot, place: FloatArray, marker: str, colour: str, size: float, hollow: bool = False
) -> None:
    """A marker on the object; pale where it lies on the far side."""
    pixel = shot.camera.project(place[None])[0][0]
    strength = 0.25 if bool(shot.hidden(place[None], _LIFT)[0]) else 1.0
    fill = "none" if hollow else colour
    axes.scatter(
        float(pixel[0]),
        float(pixel[1]),
        s=size,
        marker=marker,
        c=fill,
        edgecolors=colour if hollow else "white",
        linewidths=1.1,
        alpha=strength,
        zorder=5,
    )


def _row(count: int, height: float) -> tuple[Figure, list[Axes]]:
    figure = blank(height * count, height)
    row = list(np.asarray(figure.subplots(1, count, squeeze=False))[0])
    figure.subplots_adjust(0.0, 0.0, 1.0, 1.0, 0.0, 0.0)
    for axes in row:
        axes.set_axis_off()
    return figure, row


def _crop(figure: Figure, axes: Axes, picture: FloatArray) -> None:
    """Show only the part of a picture that is not white, with a margin."""
    filled = np.any(picture < 0.995, axis=2)
    if not filled.any():
        return
    rows, columns = np.flatnonzero(np.any(filled, axis=1)), np.flatnonzero(np.any(filled, axis=0))
    left, right = max(columns[0] - 12, 0), min(columns[-1] + 12, filled.shape[1])
    top, bottom = max(rows[0] - 30, 0), min(rows[-1] + 12, filled.shape[0])
    axes.set_xlim(left, right)
    axes.set_ylim(bottom, top)
    figure.set_size_inches(8.4, 8.4 * (bottom - top) / (right - left))


def box(low: FloatArray, high: FloatArray) -> Mesh:
    """A box between two corners in metres."""
    corners = [[x, y, z] for x in (low[0], high[0]) for y in (low[1], high[1]) for z in (low[2], high[2])]
    return closed_hull(np.array(corners))


def cylinder(radius: float, low: float, high: float) -> Mesh:
    """An upright cylinder about z, in metres."""
    angle = 2.0 * np.pi * np.arange(64) / 64
    ring = radius * np.column_stack([np.cos(angle), np.sin(angle), np.zeros(64)])
    return closed_hull(np.vstack([ring + low * _Z, ring + high * _Z]))


def table_and_pedestal(
    base_from_object: FloatArray, bottom: float, radius: float = 0.03, table: float = 0.0
) -> tuple[BenchPart, BenchPart]:
    """The table about the object, and the foam under it.

    Args:
        base_from_object: ``(4, 4)``.
        bottom: metres, z of the object's lowest point in base.
        radius: metres, of the pedestal.
        table: metres, z of the table's top in base.
    """
    x, y = base_from_object[:2, 3]
    low, high = np.array([x - 0.3, y - 0.4, table - 0.02]), np.array([x + 0.75, y + 0.4, table])
    foot = BenchPart(cylinder(radius, table, bottom), translation(np.array([x, y, 0.0])), FOAM)
    return BenchPart(box(low, high), np.eye(4), TABLE, smooth=False), foot


def sensor_parts(
    sensor: TactileSensor, base_from_gel: FloatArray, gel_from_flange: FloatArray
) -> tuple[BenchPart, BenchPart, BenchPart]:
    """Gel, housing and mount of a tactile camera on a flange."""
    half, window = 0.5 * np.array(sensor.housing), 0.5 * np.array(sensor.window)
    face = -sensor.gel_thickness
    back = face - 0.045
    housing = box(np.array([*-half, back]), np.array([*half, face]))
    gel = box(np.array([*-window, face]), np.array([*window, 0.0]))
    ring = cylinder(0.03, -1e-3, 1e-3).vertices
    mount = np.vstack([apply(gel_from_flange, ring), 0.45 * ring + back * _Z])
    return (
        BenchPart(gel, base_from_gel, GEL, smooth=False),
        BenchPart(housing, base_from_gel, HOUSING, smooth=False),
        BenchPart(closed_hull(mount), base_from_gel, MOUNT),
    )


def arm_parts(model: str, joints: FloatArray) -> tuple[BenchPart, ...]:
    """The base and the six links of a UR arm at ``(6,)`` rad."""
    frames, table = link_frames(model, joints), arm_table(model)
    parts = []
    for index, hull in enumerate(link_hulls(model).values()):
        base_from_link = np.eye(4)
        if index > 0:
            turned = transform(rotation_about(_Z, float(joints[index - 1])), table.d[index - 1] * _Z)
            base_from_link = frames[index - 1] @ turned
        parts.append(BenchPart(closed_hull(hull), base_from_link, BLUE if index in (4, 5) else ALUMINIUM))
    return tuple(parts)
