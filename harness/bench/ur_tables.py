"""Universal Robots' published numbers for the UR3e, UR5e and UR10e.

Lengths, masses and centres of mass: Universal Robots, "DH parameters for calculations of
kinematics and dynamics". Inertia tensors and joint limits: Universal_Robots_ROS2_Description
(UR3e and UR5e: values measured by the maker, 2025; UR10e: from CAD). The twist angles are
(pi/2, 0, 0, pi/2, -pi/2, 0) on all of them.
"""

from dataclasses import dataclass
from typing import Final

import numpy as np

from harness.basics.arrays import FloatArray, read_only
from harness.basics.errors import WrongUse

TWIST_SINES: Final = (1.0, 0.0, 0.0, 1.0, -1.0, 0.0)
"""Sines of the twist angles alpha_i; exact, where sin(pi/2) in floating point is not."""

TWIST_COSINES: Final = (0.0, 1.0, 1.0, 0.0, 0.0, 1.0)

LINKS: Final = ("base", "shoulder", "upper_arm", "forearm", "wrist_1", "wrist_2", "wrist_3")
"""Names of the bodies; link ``i`` moves with joint ``i``, counted from 1."""


@dataclass(frozen=True, eq=False)
class ArmTable:
    """One arm model."""

    d: tuple[float, float, float, float, float, float]  #: m, the offset along each joint's axis.
    a: tuple[float, float, float, float, float, float]  #: m, the length from each joint's axis to the next.
    masses: FloatArray  #: ``(6,)`` kg of the moving links.
    centres: FloatArray  #: ``(6, 3)`` m, centre of mass of each link in its Denavit-Hartenberg frame.
    inertias: FloatArray  #: ``(6, 3, 3)`` kg m^2 about the centre of mass, along the Denavit-Hartenberg axes.
    joint_range: FloatArray  #: ``(2, 6)`` rad, least and greatest; the elbow cannot do a whole turn.
    joint_speeds: FloatArray  #: ``(6,)`` rad/s.
    joint_torques: FloatArray  #: ``(6,)`` N m.


def arm_table(model: str) -> ArmTable:
    """The numbers of an arm model.

    Raises:
        WrongUse: the model is not one of those here.
    """
    if model not in ARM_TABLES:
        raise WrongUse(f"arm model '{model}' is not known; known: {', '.join(sorted(ARM_TABLES))}")
    return ARM_TABLES[model]


def _table(
    d: tuple[float, float, float, float],
    a: tuple[float, float],
    masses: list[float],
    centres: list[tuple[float, float, float]],
    inertias: list[tuple[float, float, float, float, float, float]],
    speeds_deg: list[float],
    torques: list[float],
) -> ArmTable:
    """A table of the numbers that are not the same on every arm: d1, d4, d5, d6 and a2, a3."""
    d1, d4, d5, d6 = d
    tensors = [[[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]] for xx, xy, xz, yy, yz, zz in inertias]
    turns = 2 * np.pi * np.array([1.0, 1.0, 0.5, 1.0, 1.0, 1.0])
    return ArmTable(
        d=(d1, 0.0, 0.0, d4, d5, d6),
        a=(0.0, a[0], a[1], 0.0, 0.0, 0.0),
        masses=read_only(np.array(masses)),
        centres=read_only(np.array(centres)),
        inertias=read_only(np.array(tensors)),
        joint_range=read_only(np.stack([-turns, turns])),
        joint_speeds=read_only(np.deg2rad(speeds_deg)),
        joint_torques=read_only(np.array(torques)),
    )


ARM_TABLES: Final[dict[str, ArmTable]] = {
    "ur3e": _table(
        (0.15185, 0.13105, 0.08535, 0.0921),
        (-0.24355, -0.2132),
        [1.98, 3.4445, 1.437, 0.871, 0.805, 0.261],
        [(0, -0.02, 0), (0.13, 0, 0.1157), (0.05, 0, 0.0238), (0, 0, 0.01), (0, 0, 0.01), (0, 0, -0.02)],
        [
            (0.0027657, 0.0000096, -0.0000149, 0.0021501, 0.0001873, 0.0025626),
            (0.0042623, -0.0000409, -0.0014960, 0.0460284, -0.0000129, 0.0448947),
            (0.0010511, 0.0, -0.0000331, 0.0113396, 0.0000022, 0.0110895),
            (0.0008174, -0.0000005, 0.0000021, 0.0006844, 0.0000617, 0.0005497),
            (0.0006059, -0.0000006, -0.0000006, 0.0005837, -0.0000271, 0.0003831),
            (0.0001080, -0.0000001, -0.0000001, 0.0001086, -0.0000002, 0.0001371),
        ],
        [180, 180, 180, 360, 360, 360],
        [54, 54, 28, 9, 9, 9],
    ),
    "ur5e": _table(
        (0.1625, 0.1333, 0.0997, 0.0996),
        (-0.425, -0.3922),
        [3.761, 8.058, 2.846, 1.37, 1.3, 0.365],
        [
            (0, -0.02561, 0.00193),
            (0.2125, 0, 0.11336),
            (0.15, 0, 0.0265),
            (0, -0.0018, 0.01634),
            (0, 0.0018, 0.01634),
            (0, 0, -0.001159),
        ],
        [
            (0.00700210, 0.00000073, -0.00001053, 0.00648091, 0.00049994, 0.00657286),
            (0.01505885, -0.00005400, 0.00000563, 0.33388086, -0.00000181, 0.33247207),
            (0.00399632, -0.00001365, 0.00137272, 0.07879254, -0.00000660, 0.07848510),
            (0.00165491, -0.00000282, -0.00000438, 0.00135962, 0.00010157, 0.00126279),
            (0.00135617, -0.00000274, 0.00000444, 0.00127827, -0.00005048, 0.00096614),
            (0.00018694, 0.00000006, -0.00000017, 0.00018908, -0.00000092, 0.00025756),
        ],
        [180, 180, 180, 180, 180, 180],
        [150, 150, 150, 28, 28, 28],
    ),
    "ur10e": _table(
        (0.1807, 0.17415, 0.11985, 0.11655),
        (-0.6127, -0.57155),
        [7.369, 13.051, 3.989, 2.1, 1.98, 0.615],
        [
            (0.021, 0, 0.027),
            (0.38, 0, 0.158),
            (0.24, 0, 0.068),
            (0, 0.007, 0.018),
            (0, 0.007, 0.018),
            (0, 0, -0.026),
        ],
        [
            (0.03408, 0.00002, -0.00425, 0.03529, 0.00008, 0.02156),
            (0.02814, 0.00005, -0.01561, 0.77068, 0.00002, 0.76943),
            (0.01014, 0.00008, 0.00916, 0.30928, 0.0, 0.30646),
            (0.00296, -0.00001, 0.0, 0.00222, -0.00024, 0.00258),
            (0.00296, -0.00001, 0.0, 0.00222, -0.00024, 0.00258),
            (0.00040, 0.0, 0.0, 0.00041, 0.0, 0.00034),
        ],
        [120, 120, 180, 180, 180, 180],
        [330, 330, 150, 54, 54, 54],
    ),
}
