"""Room inside a round body: where the sensor came down into it is free all around its axis."""

from dataclasses import dataclass, replace

import numpy as np
from scipy import ndimage

from experiments.shape_reconstruction.estimators.contact_samples import ContactSamples
from experiments.shape_reconstruction.estimators.free_space import sensor_depth
from experiments.shape_reconstruction.estimators.revolution import Revolution
from experiments.shape_reconstruction.evidence import GuardedTouch, ShapeEvidence
from harness.basics.arrays import FloatArray

SLACK = 4.0e-3
"""M inside turned room that the body may seem to be: errors of the axis, bodies that are not quite round."""

BELOW = 15.0e-3
"""M below the highest contact, from which on a touch went down into the body or beside its upper part."""

PITCH, ANGLES = 4.0e-3, 24
_DOWNWARD = 0.8
_MARGIN = 20.0e-3


@dataclass(frozen=True, eq=False)
class TurnedRoom:
    """What is free about an axis, over the distance from it and the height.

    Attributes:
        centre: ``(2,)`` m, of the axis in ``stand``.
        depth: ``(radii, heights)`` m, ``PITCH`` apart from zero, that a place is deep in it; below 0 beside.
    """

    centre: FloatArray
    depth: FloatArray

    def at(self, points: FloatArray) -> FloatArray:
        """``(n,)`` m that ``(n, 3)`` m are deep in it; below 0 beside it."""
        radius = np.linalg.norm(points[:, :2] - self.centre, axis=1)
        at = np.stack([radius, points[:, 2]]) / PITCH
        return np.asarray(ndimage.map_coordinates(self.depth, at, order=1, mode="nearest"))


def turned_room(axis: Revolution, samples: ContactSamples, evidence: ShapeEvidence) -> TurnedRoom | None:
    """The union of what all downward touches cleared, those that met nothing too; None where none went down.

    A touch whose room, turned, would hold a place that was met says that the body is not round there, and
    is left out: it came down beside a handle, or on one.
    """
    top = float(samples.points[:, 2].max())
    found = None
    for touch in evidence.touches:
        if _is_downward(touch) and touch.stand_from_gel[2, 3] < top - BELOW:
            room = _room_of(touch, axis, samples, evidence)
            if room.at(samples.points).max() <= SLACK:
                found = room if found is None else replace(found, depth=np.maximum(found.depth, room.depth))
    return found


def _is_downward(touch: GuardedTouch) -> bool:
    return bool(touch.stand_from_gel[2, 2] < -_DOWNWARD)


def _room_of(
    touch: GuardedTouch, axis: Revolution, samples: ContactSamples, evidence: ShapeEvidence
) -> TurnedRoom:
    out = np.linalg.norm(samples.points[:, :2] - axis.centre, axis=1).max()
    radii = np.arange(0.0, out + _MARGIN, PITCH)
    heights = np.arange(0.0, samples.points[:, 2].max() + _MARGIN, PITCH)
    angles = 2.0 * np.pi * np.arange(ANGLES) / ANGLES
    r, z, turn = np.meshgrid(radii, heights, angles, indexing="ij")
    places = np.stack([axis.centre[0] + r * np.cos(turn), axis.centre[1] + r * np.sin(turn), z], axis=-1)
    deep = sensor_depth(replace(evidence, touches=(touch,)), places.reshape(-1, 3))
    return TurnedRoom(axis.centre, np.asarray(deep.reshape(r.shape).max(axis=2)))
