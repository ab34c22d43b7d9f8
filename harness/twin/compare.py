"""The recording against the twin: how far arm and contacts were from where they should have been."""

from dataclasses import dataclass

import numpy as np

from harness.basics.arrays import FloatArray, read_only
from harness.basics.geometry import vector_from_rotation
from harness.bench import kinematics
from harness.twin.bench import TwinBench
from harness.twin.rehearsal import PredictedContact, contact_point


@dataclass(frozen=True, eq=False)
class ArmDeviation:
    """The controller's flange poses against the twin's, for the same joints."""

    distances: FloatArray  #: ``(n,)`` m.
    angles: FloatArray  #: ``(n,)`` rad.


@dataclass(frozen=True, eq=False)
class ContactDeviation:
    """One contact as performed, against the rehearsed one."""

    step: int  #: of the experiment.
    point_in_object: FloatArray  #: ``(3,)`` m, where the recorded pose meets the nominal object.
    distance: float  #: m between that and the rehearsed point.


def compare_arm(model: str, joints: FloatArray, base_from_flange: FloatArray) -> ArmDeviation:
    """Check a controller's kinematics against the twin's.

    Args:
        model: of the arm.
        joints: ``(n, 6)`` rad, recorded.
        base_from_flange: ``(n, 4, 4)``, recorded with them.
    """
    expected = kinematics.forward(model, joints)
    distances = np.linalg.norm(base_from_flange[:, :3, 3] - expected[:, :3, 3], axis=1)
    turns = np.swapaxes(expected[:, :3, :3], 1, 2) @ base_from_flange[:, :3, :3]
    angles = np.array([np.linalg.norm(vector_from_rotation(turn)) for turn in turns])
    return ArmDeviation(read_only(distances), read_only(angles))


def compare_contact(
    bench: TwinBench, rehearsed: PredictedContact, base_from_gel: FloatArray
) -> ContactDeviation:
    """Compare where a contact was made with where it was rehearsed.

    Args:
        bench: the twin the contact was rehearsed in.
        rehearsed: of that rehearsal's report.
        base_from_gel: ``(4, 4)``, recorded while the gel was pressed.
    """
    point = contact_point(bench, base_from_gel)
    distance = float(np.linalg.norm(point - rehearsed.point_in_object))
    return ContactDeviation(rehearsed.step, read_only(point), distance)
