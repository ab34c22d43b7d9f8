"""How far object, tool and arm may be from where they are stated to be, and what that does to a gel's pose.

A gel's pose in the object's frame is off by a small twist: ``(6,)``, the gel's displacement in metres and its
rotation in rad, in axes of the base. What contacts share is one normal vector of a run; the rest is each
contact's own.
"""

from dataclasses import dataclass

import numpy as np

from harness.basics.arrays import FloatArray
from harness.bench.gap import USUAL, BenchErrors

SHARED = 13
"""Object's place (3), rotation (3) and size, gel's centre (3) and attitude (3), each over its sigma."""


@dataclass(frozen=True)
class PlaceNoise:
    """One sigma of everything that may be off at a bench that was set up with care."""

    position: float = 0.5e-3  #: m, of the object along each axis of the base.
    yaw: float = USUAL.yaw  #: rad, of the object.
    tilt: float = USUAL.tilt  #: rad, of the object about base x and y each.
    scale: float = USUAL.scale  #: of the object's size over its model's, less 1.
    gel_centre: float = USUAL.gel_centre  #: m, along each axis of the gel's frame.
    gel_tilt: float = USUAL.gel_tilt  #: rad, of the gel about its x and y each.
    gel_yaw: float = USUAL.gel_yaw  #: rad, of its image about its z.
    arm: float = USUAL.arm
    """m, of each contact along each axis: the arm's pose, and the surface's shape there."""
    arm_tilt: float = USUAL.arm_tilt  #: rad, of each contact about each axis.

    @classmethod
    def at(cls, errors: BenchErrors) -> "PlaceNoise":
        """Of a bench, as its station states its errors."""
        return cls(
            yaw=errors.yaw,
            tilt=errors.tilt,
            scale=errors.scale,
            gel_centre=errors.gel_centre,
            gel_tilt=errors.gel_tilt,
            gel_yaw=errors.gel_yaw,
            arm=errors.arm,
            arm_tilt=errors.arm_tilt,
        )

    @property
    def own(self) -> FloatArray:
        """``(6, 6)``: covariance of each contact's own twist."""
        return np.diag(np.repeat([self.arm**2, self.arm_tilt**2], 3))


def shared_twists(noise: PlaceNoise, base_from_gel: FloatArray, anchor: FloatArray) -> FloatArray:
    """``(6, 13)``: the twist of a gel for one sigma of each shared error, to first order.

    Args:
        noise: the sigmas.
        base_from_gel: ``(4, 4)``, at the contact.
        anchor: ``(3,)`` m in base, about which the object may be turned and larger.
    """
    rotation, arm = base_from_gel[:3, :3], base_from_gel[:3, 3] - anchor
    turns = np.array([noise.tilt, noise.tilt, noise.yaw])
    twists = np.zeros((6, SHARED))
    # An object that is off moves the gel the other way in the object's frame.
    twists[:3, 0:3] = -noise.position * np.eye(3)
    twists[:3, 3:6] = -np.cross(np.eye(3), arm).T * turns
    twists[3:, 3:6] = -np.diag(turns)
    twists[:3, 6] = -noise.scale * arm
    twists[:3, 7:10] = noise.gel_centre * rotation
    twists[3:, 10:13] = rotation * np.array([noise.gel_tilt, noise.gel_tilt, noise.gel_yaw])
    return twists


def twist_covariance(noise: PlaceNoise, base_from_gel: FloatArray, anchor: FloatArray) -> FloatArray:
    """``(6, 6)``: of one contact by itself; the arguments are ``shared_twists``'."""
    shared = shared_twists(noise, base_from_gel, anchor)
    return np.asarray(shared @ shared.T + noise.own)
