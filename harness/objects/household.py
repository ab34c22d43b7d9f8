"""Six household objects, modelled here: closed, hollow where the real thing is, upright on z = 0."""

from collections.abc import Callable
from functools import lru_cache
from itertools import pairwise
from types import MappingProxyType

import numpy as np
from manifold3d import CrossSection, FillRule, triangulate
from scipy.interpolate import CubicSpline, PchipInterpolator

from harness.basics.arrays import FloatArray, IntArray
from harness.basics.errors import WrongUse
from harness.basics.mesh import Mesh
from harness.objects.builtin import HOUSEHOLD
from harness.objects.solid import from_manifold, lathe, outward, to_manifold, tube, union

_MM = 1e-3
_FINEST_EDGE, _COARSEST_EDGE = 0.3e-3, 10e-3

_ROUND = 96
_LARGEST_TURN = np.radians(22.0)
_STEPS_ROUND = 4


@lru_cache(maxsize=64)
def build(name: str, edge: float = 3e-3) -> Mesh:
    """Build a household object in metres, watertight; see ``harness.objects.builtin.build``.

    A mesh that was built before is returned from a cache.

    The shape does not depend on ``edge``, the distance of neighbouring vertices where the surface is curved
    (across a quadrangle half as much again), beyond the flat faces' distance from the curve that they
    approximate; no two values of it share vertices.
    """
    if name not in _BUILDERS:
        raise WrongUse(f"no built-in object {name!r}; there are {', '.join(_BUILDERS)}")
    if not _FINEST_EDGE <= edge <= _COARSEST_EDGE:
        raise WrongUse(f"an edge of {edge * 1e3:g} mm is outside 0.3 to 10 mm; 3 mm suits most uses")
    in_mm = _BUILDERS[name](edge / _MM)
    lowest = np.array([0.0, 0.0, in_mm.vertices[:, 2].min()])
    return outward(Mesh((in_mm.vertices - lowest) * _MM, in_mm.faces))


def _phase(edge: float) -> float:
    """A share of a vertex spacing that differs from one edge length to the next."""
    return float(np.mod(edge * 7.318281828, 1.0))


def _mug(edge: float) -> Mesh:
    wall = stroke(np.array([[38.4, 5.0], [38.0, 93.0]]), np.array([4.4, 3.6]))
    base = polygon([(0.0, 3.5), (30.0, 3.5), (30.0, 0.0), (34.0, 0.0), (40.2, 4.0), (40.2, 8.5), (0.0, 8.5)])
    body = _turned(wall + base, 1.4, 3.5, edge)
    handle = _handle(
        points=[
            (38.6, 75.0),
            (52.0, 77.5),
            (66.0, 70.0),
            (70.0, 52.0),
            (64.0, 33.0),
            (51.0, 24.5),
            (38.6, 24.5),
        ],
        halves=[(6.0, 8.5), (4.4, 6.5), (4.0, 6.0), (4.0, 6.0), (4.0, 6.0), (4.4, 6.5), (6.0, 8.5)],
        edge=edge,
    )
    return union([body, handle])


def _bowl(edge: float) -> Mesh:
    centre = _curve([(0, 9.0), (20, 9.3), (38, 13.5), (55, 25.5), (67, 41.0), (73, 53.0), (76, 62.0)])
    thickness = np.interp(np.linspace(0, 1, len(centre)), [0, 0.4, 1], [6.0, 4.6, 3.2])
    foot = polygon([(28.0, 0.0), (33.5, 0.0), (35.0, 12.0), (29.0, 9.0)])
    return _turned(stroke(centre, thickness) + foot, 1.2, 2.5, edge)


def _plate(edge: float) -> Mesh:
    centre = _curve([(0, 6.0), (40, 6.0), (62, 6.6), (74, 10.5), (83, 15.0), (96, 18.4), (108, 21.5)])
    thickness = np.interp(np.linspace(0, 1, len(centre)), [0, 0.6, 1], [5.0, 4.8, 3.4])
    foot = polygon([(53.0, 0.0), (57.5, 0.0), (61.0, 6.5), (51.5, 6.0)])
    return _turned(stroke(centre, thickness) + foot, 1.2, 2.5, edge)


def _pitcher(edge: float) -> Mesh:
    outline = [(53.0, 4.0), (59, 20), (62.5, 55), (61, 100), (55, 150), (49.5, 190), (49.5, 215), (54, 236)]
    side = _curve(outline, rounder=True)
    wall = stroke(side, np.full(len(side), 3.2))
    base = polygon([(0.0, 3.0), (47.0, 3.0), (48.0, 0.0), (52.0, 0.0), (55.0, 4.0), (54.5, 6.5), (0.0, 6.5)])
    body = _turned(wall + base, 1.0, 4.0, edge)
    handle = _handle(
        points=[
            (50.4, 205.0),
            (66.0, 209.0),
            (87.0, 200.0),
            (96.0, 170.0),
            (92.0, 125.0),
            (80.0, 92.0),
            (61.6, 78.0),
        ],
        halves=[(7.5, 12.0), (6.0, 10.0), (5.5, 9.0), (5.5, 9.0), (5.5, 9.0), (6.0, 9.5), (8.5, 11.0)],
        edge=edge,
    )
    # The upper wall drawn out and narrowed opposite the handle, keeping its thickness.
    x, y, z = body.vertices.T
    aside = np.arctan2(y, -x)
    rise = np.clip((z - 188.0) / 48.0, 0.0, 1.3)
    out = 17.0 * rise**2 * np.exp(-((aside / 0.33) ** 2))
    radius = np.maximum(np.hypot(x, y), 1e-9)
    grown = 1.0 + out * (radius > 30.0) / radius
    return union([Mesh(np.column_stack([x * grown, y * grown, z + 0.25 * out]), body.faces), handle])


def _tray(edge: float) -> Mesh:
    floor = polygon([(0.0, 0.0), (86.0, 0.0), (86.0, 6.0), (0.0, 6.0)])
    wall = stroke(np.array([[86.0, 4.0], [91.5, 29.0]]), np.array([7.5, 7.0]))
    profile = half_profile(
        (floor + wall) ^ CrossSection.square((400.0, 400.0)).translate((0.0, 0.0)), 1.8, 5.0
    )
    return lathe(walked(profile, edge), edge, _phase(edge), ring=_rounded_square)


def _wrench(edge: float) -> Mesh:
    open_end = CrossSection.circle(20.5, 128) + CrossSection.circle(17.0, 128).translate((7.0, 5.0))
    nut = _hexagon(19.0)
    throat = CrossSection.square((40.0, 19.0)).translate((0.0, -9.5))
    jaw = open_end - (nut + throat).rotate(15.0)
    ring = (CrossSection.circle(16.5, 128) - _hexagon(19.0).rotate(15.0)).translate((-162.0, 0.0))
    shaft = polygon([(-152.0, -7.0), (-14.0, -9.5), (-14.0, 9.5), (-152.0, 7.0)])
    head = slab(rounded(jaw, 2.6, 0.8), 10.0, 1.2, edge)
    eye = slab(rounded(ring, 2.0, 0.8), 10.0, 1.2, edge)
    bar = slab(rounded(shaft, 3.0, 0.5), 6.4, 2.2, edge)
    whole = to_manifold(union([head, eye, bar], smallest=0.03)).refine_to_length(edge)
    middle = 0.5 * (whole.bounding_box()[0] + whole.bounding_box()[3])
    return from_manifold(whole.translate((-middle, 0.0, 0.0)))


def _turned(area: CrossSection, outer: float, inner: float, edge: float) -> Mesh:
    return lathe(walked(half_profile(area, outer, inner), edge), edge, _phase(edge))


def _curve(points: list[tuple[float, float]], rounder: bool = False) -> FloatArray:
    """``(n, 2)`` places on a line through a few points in mm: without overshoot, or rounder and with."""
    through = np.array(points, dtype=np.float64)
    at = np.r_[0.0, np.cumsum(np.linalg.norm(np.diff(through, axis=0), axis=1))]
    line = CubicSpline(at, through) if rounder else PchipInterpolator(at, through)
    smooth: FloatArray = line(np.linspace(0.0, at[-1], 61))
    return smooth


def _handle(points: list[tuple[float, float]], halves: list[tuple[float, float]], edge: float) -> Mesh:
    """A handle through (x, z) points in mm, with half axes (in its plane, across) at each.

    It leaves and meets the wall level, so that its flat ends lie within the wall's thickness.
    """
    both = np.column_stack([np.array(points), np.array(halves)])
    at = np.r_[0.0, np.cumsum(np.linalg.norm(np.diff(both[:, :2], axis=0), axis=1))]
    count = int(np.ceil(at[-1] / edge)) + 1
    level = np.array([1.0, 0.0, 0.0, 0.0])
    path = CubicSpline(at, both, bc_type=((1, level), (1, -level)))
    smooth = path(np.linspace(0.0, at[-1], count))
    return tube(smooth[:, :2], smooth[:, 2:], edge)


def _rounded_square(distance: float, share: FloatArray) -> FloatArray:
    """A square of half side ``distance`` whose corner radius grows with it, from 12 mm at 80 mm."""
    corner = 12.0 + distance - 80.0 if distance > 80.0 else 12.0 * distance / 80.0
    flat = distance - corner
    quarter = 2.0 * flat + 0.5 * np.pi * corner
    turn, along = np.divmod(np.mod(share, 1.0) * 4.0 * quarter, quarter)
    angle = np.clip((along - flat) / corner, 0.0, 0.5 * np.pi)
    x = np.where(along < flat, distance, flat + corner * np.cos(angle))
    y = np.where(along < flat, along, flat + corner * np.sin(angle))
    beyond = along > flat + 0.5 * np.pi * corner
    x, y = np.where(beyond, 2.0 * flat + 0.5 * np.pi * corner - along, x), np.where(beyond, distance, y)
    cos, sin = np.cos(0.5 * np.pi * turn), np.sin(0.5 * np.pi * turn)
    return np.column_stack([x * cos - y * sin, x * sin + y * cos])


def _hexagon(across_flats: float) -> CrossSection:
    corner = across_flats / np.sqrt(3.0)
    angles = np.radians(60.0 * np.arange(6))
    return polygon([(float(corner * np.cos(a)), float(corner * np.sin(a))) for a in angles])


_BUILDERS: MappingProxyType[str, Callable[[float], Mesh]] = MappingProxyType(
    {
        "mug": _mug,
        "bowl": _bowl,
        "plate": _plate,
        "pitcher": _pitcher,
        "tray": _tray,
        "wrench": _wrench,
    }
)

MATERIALS = HOUSEHOLD
"""Material of each object unless the scene names another."""


def stroke(centre_line: FloatArray, thickness: FloatArray) -> CrossSection:
    """The area a round brush covers, drawn along ``(n, 2)`` points with ``(n,)`` diameters in mm."""
    discs = [
        CrossSection.circle(d / 2.0, _ROUND).translate((x, y))
        for (x, y), d in zip(centre_line, thickness, strict=True)
    ]
    hulls = [CrossSection.batch_hull([a, b]) for a, b in pairwise(discs)]
    total = hulls[0]
    for hull in hulls[1:]:
        total = total + hull
    return total


def polygon(points: list[tuple[float, float]]) -> CrossSection:
    """The area inside a polygon whose corners go counter-clockwise, in mm."""
    return CrossSection([np.array(points)], FillRule.Positive)


def rounded(area: CrossSection, outer: float, inner: float) -> CrossSection:
    """The area with convex corners rounded to radius ``outer`` and concave ones to ``inner``, in mm."""
    opened = area.offset(-outer, circular_segments=_ROUND).offset(outer, circular_segments=_ROUND)
    return opened.offset(inner, circular_segments=_ROUND).offset(-inner, circular_segments=_ROUND)


def half_profile(area: CrossSection, outer: float, inner: float) -> FloatArray:
    """The outline, right of the axis, of an area drawn there and rounded with its mirror image.

    Args:
        area: drawn at radius >= 0, in mm.
        outer: mm, radius of convex corners.
        inner: mm, radius of concave corners.

    Returns:
        ``(n, 2)`` mm (radius, height), from the lowest point on the axis round to the highest.

    Raises:
        ValueError: the area is not one piece that touches the axis.
    """
    whole = rounded(area + area.mirror((1.0, 0.0)), outer, inner)
    _, least_y, most_x, most_y = whole.bounds()
    right = CrossSection.square((most_x + 1.0, most_y - least_y + 2.0)).translate((0.0, least_y - 1.0))
    contours = (whole ^ right).to_polygons()
    if len(contours) != 1:
        raise ValueError(f"a profile is one piece that touches the axis; this one has {len(contours)}")
    points: FloatArray = np.asarray(contours[0], dtype=np.float64)
    on_axis = np.flatnonzero(points[:, 0] < 1e-9)
    if len(on_axis) < 2:
        raise ValueError("a profile begins and ends on the axis; this one does not reach it")
    start = int(on_axis[np.argmin(points[on_axis, 1])])
    ordered = np.roll(points, -start, axis=0)
    return ordered[: int(np.flatnonzero(ordered[:, 0] < 1e-9)[-1]) + 1]


def walked(points: FloatArray, step: float, closed: bool = False) -> FloatArray:
    """Points along a line at most ``step`` apart, closer where it bends.

    Args:
        points: ``(n, 2)`` corners of the line.
        step: longest distance between two neighbours, in the unit of the points.
        closed: whether the last point is joined to the first.

    Returns:
        ``(m, 2)``, with both ends of an open line kept.
    """
    line = np.vstack([points, points[:1]]) if closed else points
    line = line[np.r_[True, np.linalg.norm(np.diff(line, axis=0), axis=1) > 1e-9]]
    legs = np.diff(line, axis=0)
    lengths = np.linalg.norm(legs, axis=1)
    headings = np.unwrap(np.arctan2(legs[:, 1], legs[:, 0]))
    # A corner's turn is spent over the legs beside it; each unit of "effort" earns one point.
    turns = np.abs(np.diff(headings, append=headings[-1:]))
    effort = np.maximum(lengths / step, 0.0) + 0.5 * (turns + np.r_[0.0, turns[:-1]]) / _LARGEST_TURN
    done = np.r_[0.0, np.cumsum(effort)]
    count = max(2, int(np.ceil(done[-1])))
    at = np.linspace(0.0, done[-1], count + 1)
    spread = np.column_stack([np.interp(at, done, line[:, i]) for i in range(2)])
    return spread[:-1] if closed else spread


def slab(area: CrossSection, thickness: float, rounding: float, edge: float) -> Mesh:
    """A plate with the outline of ``area``, centred on z = 0.

    Args:
        area: outline, with holes; its convex corners have a radius above ``rounding``.
        thickness: mm.
        rounding: mm, radius of the edges between faces and sides.
        edge: mm between vertices along the outline.

    Returns:
        A watertight mesh, outward; its two flat faces have no vertices inside.
    """
    # Inset from the outline and height of every layer of vertices, bottom to top.
    angle = np.linspace(0.0, 0.5 * np.pi, _STEPS_ROUND + 1)
    inset = rounding * (1.0 - np.sin(angle))
    height = -0.5 * thickness + rounding * (1.0 - np.cos(angle))
    straight = np.linspace(height[-1], -height[-1], max(2, int(np.ceil(2.0 * -height[-1] / edge)) + 1))
    insets = np.concatenate([inset, np.zeros(len(straight) - 2), inset[::-1]])
    heights = np.concatenate([height[:-1], straight, -height[:-1][::-1]])
    loops = [walked(np.asarray(contour), edge, closed=True) for contour in area.to_polygons()]
    normals = [_outward_normals(loop) for loop in loops]
    sizes = [len(loop) for loop in loops]
    total, starts = sum(sizes), np.cumsum([0, *sizes[:-1]]).tolist()
    runs = list(zip(starts, sizes, strict=True))
    layers = [
        np.column_stack([np.vstack(loops) - inset * np.vstack(normals), np.full(total, height)])
        for inset, height in zip(insets, heights, strict=True)
    ]
    cap = np.asarray(triangulate([layers[0][start : start + size, :2] for start, size in runs]), np.int64)
    sides = [_strip(start + k * total, size, total) for start, size in runs for k in range(len(layers) - 1)]
    faces = np.vstack([cap[:, ::-1], cap + total * (len(layers) - 1), *sides])
    return outward(Mesh(np.vstack(layers), faces))


def _outward_normals(loop: FloatArray) -> FloatArray:
    """Unit normals to the right of a closed line: away from the material of outlines and holes alike."""
    tangent = np.roll(loop, -1, axis=0) - np.roll(loop, 1, axis=0)
    tangent /= np.linalg.norm(tangent, axis=1)[:, None]
    return np.column_stack([tangent[:, 1], -tangent[:, 0]])


def _strip(start: int, size: int, stride: int) -> IntArray:
    """Faces between a loop of one layer and the same loop of the next."""
    here = start + np.arange(size)
    following = start + np.roll(np.arange(size), -1)
    return np.vstack(
        [
            np.column_stack([here, following, following + stride]),
            np.column_stack([here, following + stride, here + stride]),
        ]
    )
