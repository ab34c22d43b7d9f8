"""How far object, tool and arm may be from where they are stated to be, and what that does to a gel's pose.

A gel's pose in the object's frame is off by a small twist: ``(6,)``, the gel's displacement in metres and its
rotation in rad, in axes of the base. What contacts share is one normal vector of a run; the rest is each
contact's own.
"""

import numpy as np

from harness.basics.arrays import FloatArray
from harness.bench.gap import BenchErrors

SHARED = 13
"""Object's place (3), rotation (3) and size, gel's centre (3) and attitude (3), each over its sigma."""


POSITION = 0.5e-3
"""Standard deviation in m of the object's position along each axis of the base frame."""


def own_covariance(errors: BenchErrors) -> FloatArray:
    """Compute the ``(6, 6)`` covariance of the twists that differ between contacts."""
    return np.diag(np.repeat([errors.arm**2, errors.arm_tilt**2], 3))


def shared_twists(errors: BenchErrors, base_from_gel: FloatArray, anchor: FloatArray) -> FloatArray:
    """Compute the ``(6, 13)`` twists of a gel for one sigma of each shared error, to first order.

    Args:
        errors: standard deviations of the errors.
        base_from_gel: ``(4, 4)`` pose of the gel at the contact.
        anchor: ``(3,)`` m in the base frame, fixed point of the object's rotation and scaling.
    """
    rotation, arm = base_from_gel[:3, :3], base_from_gel[:3, 3] - anchor
    turns = np.array([errors.tilt, errors.tilt, errors.yaw])
    twists = np.zeros((6, SHARED))
    # An object that is off moves the gel the other way in the object's frame.
    twists[:3, 0:3] = -POSITION * np.eye(3)
    twists[:3, 3:6] = -np.cross(np.eye(3), arm).T * turns
    twists[3:, 3:6] = -np.diag(turns)
    twists[:3, 6] = -errors.scale * arm
    twists[:3, 7:10] = errors.gel_centre * rotation
    twists[3:, 10:13] = rotation * np.array([errors.gel_tilt, errors.gel_tilt, errors.gel_yaw])
    return twists


def twist_covariance(errors: BenchErrors, base_from_gel: FloatArray, anchor: FloatArray) -> FloatArray:
    """``(6, 6)``: of one contact by itself; the arguments are ``shared_twists``'."""
    shared = shared_twists(errors, base_from_gel, anchor)
    return np.asarray(shared @ shared.T + own_covariance(errors))
