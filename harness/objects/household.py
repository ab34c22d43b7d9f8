"""Six household objects, modelled here: closed, hollow where the real thing is, upright on z = 0."""

from collections.abc import Callable
from types import MappingProxyType

import numpy as np
from manifold3d import CrossSection
from scipy.interpolate import CubicSpline, PchipInterpolator

from harness.basics.arrays import FloatArray
from harness.basics.errors import WrongUse
from harness.basics.mesh import Mesh
from harness.objects.builtin import HOUSEHOLD
from harness.objects.outline import half_profile, polygon, rounded, stroke, walked
from harness.objects.slab import slab
from harness.objects.solid import from_manifold, lathe, outward, to_manifold, tube, union

_MM = 1e-3
_FINEST_EDGE, _COARSEST_EDGE = 0.3e-3, 10e-3


def build(name: str, edge: float = 3e-3) -> Mesh:
    """One of our own objects, in metres.

    The shape does not depend on ``edge`` beyond the flat faces' distance from the curve
    they stand for; no two values of it share vertices.

    Args:
        name: a key of ``MATERIALS``.
        edge: metres between neighbouring vertices where the surface is curved (across a
            quadrangle half as much again); 0.3 to 10 mm.

    Returns:
        A watertight mesh, outward, standing on z = 0 about the z axis.

    Raises:
        WrongUse: no such object, or an edge out of range.
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
    return union([_with_spout(body), handle])


def _tray(edge: float) -> Mesh:
    floor = polygon([(0.0, 0.0), (86.0, 0.0), (86.0, 6.0), (0.0, 6.0)])
    wall = stroke(np.array([[86.0, 4.0], [91.5, 29.0]]), np.array([7.5, 7.0]))
    profile = half_profile(floor + wall ^ _above(0.0), 1.8, 5.0)
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


def _with_spout(body: Mesh) -> Mesh:
    """The upper wall drawn out and narrowed opposite the handle, keeping its thickness."""
    x, y, z = body.vertices.T
    aside = np.arctan2(y, -x)
    rise = np.clip((z - 188.0) / 48.0, 0.0, 1.3)
    out = 17.0 * rise**2 * np.exp(-((aside / 0.33) ** 2))
    radius = np.maximum(np.hypot(x, y), 1e-9)
    grown = 1.0 + out * (radius > 30.0) / radius
    return Mesh(np.column_stack([x * grown, y * grown, z + 0.25 * out]), body.faces)


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


def _above(height: float) -> CrossSection:
    return CrossSection.square((400.0, 400.0)).translate((0.0, height))


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
