"""A strike where the gel has just met an object that nobody knows well: the contact's own place and axis."""

import numpy as np

from experiments.scale_estimation.model import ObjectModel
from experiments.scale_estimation.touch.patch import Patch
from harness.basics.arrays import FloatArray
from harness.basics.errors import MotionRefused
from harness.basics.geometry import apply, transform
from harness.basics.mesh import Mesh
from harness.basics.mesh_hull import closed_hull
from harness.skills.exploring.surroundings import Surroundings, rehearsed_strike
from harness.skills.strike import StrikeMotion, planner

STEEPEST = float(np.radians(45.0))
"""Rad between the way of the gel and the surface's normal beyond which a tip would glance off."""

_SIDE = 8.0e-3
_THICK = 4.0e-3
_SEARCHED = 1


def strike_met(
    here: Surroundings, model: ObjectModel, patch: Patch, rotation: FloatArray
) -> StrikeMotion | None:
    """The motions of a strike at the crest of what a contact touched, the way that the gel came.

    The tip goes where the gel has been. What carries it goes beside that, where nobody has been: such a
    strike is to be made with a guard.

    Args:
        here: where the arm moves.
        model: says where the support is.
        patch: that the contact touched.
        rotation: ``(3, 3)`` of the gel in base.

    Returns:
        None where the surface is too steep for it, or no free way was found.
    """
    if float(-rotation[:, 2] @ patch.normal) < np.cos(STEEPEST):
        return None
    lines = model.twin_around(_with_plate(model.nowhere, patch, rotation))
    plans = planner(here.scene, here.station, lines, here.travels)
    if plans is None:
        return None
    strike = plans.plan(transform(rotation, _crest(patch, rotation)), here.joints, searched=_SEARCHED)
    if strike is None:
        return None
    try:
        return rehearsed_strike(strike, here.travels, lines)
    except MotionRefused:
        return None


def _crest(patch: Patch, rotation: FloatArray) -> FloatArray:
    """``(3,)`` m in base: the place that reached deepest into the gel; of a rim, where it is thickest."""
    return np.asarray(patch.points[int((patch.points @ rotation[:, 2]).argmin())])


def _with_plate(mark: Mesh, patch: Patch, rotation: FloatArray) -> Mesh:
    """The mark on the support, and a small plate whose face is where the surface was touched; in base."""
    ends = np.array([[-_SIDE, -_SIDE, 0.0], [_SIDE, _SIDE, _THICK]])
    corners = np.array([[ends[i, 0], ends[j, 1], ends[k, 2]] for i in (0, 1) for j in (0, 1) for k in (0, 1)])
    plate = closed_hull(apply(transform(rotation, _crest(patch, rotation)), corners))
    vertices = np.concatenate([mark.vertices, plate.vertices])
    return Mesh(vertices, np.concatenate([mark.faces, plate.faces + len(mark.vertices)]))
