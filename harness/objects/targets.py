"""Things that are pressed to calibrate a sensor: their size is known, and nobody asks what they are."""

from collections.abc import Callable
from types import MappingProxyType

import numpy as np

from harness.basics.mesh import Mesh
from harness.objects.solid import lathe, outward

BALL_RADIUS = 2e-3
"""Metres, of ``"builtin:ball"`` at scale 1: ObjectFolder pressed one of 4 mm across."""

_STEM = 0.65
"""Of the ball's radius: the stem that it stands on, thin enough to stay behind the ball in the gel."""

_HEIGHT = 10.0
"""Ball radii from the foot to the top: the housing beside the gel stays clear of what holds the foot."""

_FINER = 1.0 / 40.0
"""Of the edge asked for: that of a household object would leave a ball a cube."""


def ball(edge: float = 3e-3) -> Mesh:
    """Build a ball of radius ``BALL_RADIUS`` on a stem, standing on z = 0 about the z axis, in metres.

    The ball's top is ``_HEIGHT`` radii above the foot. Edges have a fortieth of the usual length, so that the
    facets stay within a micrometre of the sphere. The mesh is watertight.
    """
    fine = edge * _FINER
    centre = (_HEIGHT - 1.0) * BALL_RADIUS
    from_below = np.arcsin(_STEM)
    steps = int(np.ceil((np.pi - from_below) * BALL_RADIUS / fine))
    turned = np.linspace(from_below, np.pi, steps + 1)
    arc = np.column_stack([BALL_RADIUS * np.sin(turned), centre - BALL_RADIUS * np.cos(turned)])
    arc[-1, 0] = 0.0
    foot = np.array([[0.0, 0.0], [_STEM * BALL_RADIUS, 0.0]])
    return outward(lathe(np.vstack([foot, arc]), fine, np.mod(7.318281828 * fine / BALL_RADIUS, 1.0)))


BUILDERS: MappingProxyType[str, Callable[[float], Mesh]] = MappingProxyType({"ball": ball})
"""By the names of ``harness.objects.builtin.TARGETS``."""
