"""Plane outlines in millimetres: thick strokes with rounded corners, walked in even steps.

Every round object is drawn as the section it has in the half plane (radius, height).
"""

from itertools import pairwise

import numpy as np
from manifold3d import CrossSection, FillRule

from harness.basics.arrays import FloatArray

_ROUND = 96
_LARGEST_TURN = np.radians(22.0)


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
