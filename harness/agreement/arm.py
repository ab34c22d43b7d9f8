"""The arm against the twin: its tables, and how deep the twin's object reaches into the gel at a contact."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.linalg import solve_triangular

from harness.agreement.agreement import Residual, SenseResiduals
from harness.agreement.place_noise import own_covariance, shared_twists
from harness.agreement.subject import PressedContact, Subject, refusal_notes
from harness.basics.arrays import FloatArray
from harness.basics.geometry import (
    rotation_from_quaternion,
    rotation_from_vector,
    transform,
    vector_from_rotation,
)
from harness.bench import kinematics
from harness.bench.gap import BenchErrors
from harness.recording.run_folder import RunFiles
from harness.recording.step_file import StepRecord
from harness.twin.bench import TwinBench
from harness.twin.bench_of import twin_of

TABLES = 1.0e-3
"""m, one sigma along each axis: a controller's own calibrated tables against the maker's printed ones."""

READ = 0.08e-3
"""m, one sigma of the deepest place of a gel as its picture shows it, beside ``GAIN`` of it."""

GAIN = 0.1
"""One sigma of how much deeper or shallower the gel is read than it is, of its depth."""

_STEPS = np.repeat([0.4e-3, np.radians(0.5)], 3)
"""m and rad over which a depth's slope is taken: as far as the noise reaches, not the mesh's own facets."""

_MOST_POSES = 100
_NOTHING = -20e-3
"""m of depth where the object is nowhere before the pad."""


@dataclass(frozen=True, eq=False)
class ContactDepth:
    """How deep a contact was, by the picture and by the twin."""

    step: int  #: of the run.
    read: float  #: m, the deepest place of the gel.
    expected: float  #: m that the twin's object reaches into the pad; 0 where it does not.
    shared: FloatArray  #: ``(13,)`` m for one sigma of each error that contacts share.
    own: float  #: m, one sigma of the contact's own.


def compare_with_twin(subject: Subject, contacts: Sequence[PressedContact]) -> SenseResiduals:
    """Compare joints and contacts of a run with the twin of its scene.

    Raises:
        WrongUse: the object cannot stand in the scene.
    """
    run = subject.run
    bench = twin_of(subject.scene, run.station, subject.mesh, subject.base_from_object)
    joints = [found for record in run.recording.steps() if (found := joint_residual(run, record)) is not None]
    read = [contact for contact in contacts if not contact.refusal]
    depths = [contact_depth(bench, subject.base_from_object, contact, run.station.errors) for contact in read]
    residuals = sorted((*joints, *depth_residuals(depths)), key=lambda residual: residual.step)
    why = "; ".join(refusal_notes(contacts)) or ("" if residuals else "no pose of the arm was recorded")
    return SenseResiduals("arm", "twin", tuple(residuals), why)


def joint_residual(run: RunFiles, record: StepRecord) -> Residual | None:
    """The controller's poses of the flange against the twin's, of the same joints; None without them."""
    readings = record.readings
    if "arm.joints" not in readings or "arm.base_from_flange" not in readings:
        return None
    joints, poses = readings["arm.joints"].values, readings["arm.base_from_flange"].values
    count = min(len(joints), len(poses))
    chosen = np.unique(np.linspace(0, count - 1, min(count, _MOST_POSES)).astype(np.int64))
    stated = np.array([transform(rotation_from_quaternion(p[3:]), p[:3]) for p in poses[chosen]])
    distances, angles = compare_arm(run.station.arm.model, joints[chosen], stated)
    apart = float(distances.max())
    numbers = {"apart_m": apart, "turned_rad": float(angles.max()), "sigma_m": TABLES}
    return Residual(record.step.index, "joints", (apart / TABLES) ** 2, 3.0, numbers)


def compare_arm(
    model: str, joints: FloatArray, base_from_flange: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Compare a controller's flange poses with the twin's for the same joints.

    Args:
        model: kinematic model of the arm.
        joints: ``(n, 6)`` rad, recorded joint angles.
        base_from_flange: ``(n, 4, 4)`` poses recorded with the joints.

    Returns:
        ``(n,)`` distances in m and ``(n,)`` angles in rad.
    """
    expected = kinematics.forward(model, joints)
    distances = np.linalg.norm(base_from_flange[:, :3, 3] - expected[:, :3, 3], axis=1)
    rotations = np.swapaxes(expected[:, :3, :3], 1, 2) @ base_from_flange[:, :3, :3]
    return distances, np.array([np.linalg.norm(vector_from_rotation(rotation)) for rotation in rotations])


def contact_depth(
    bench: TwinBench, base_from_object: FloatArray, contact: PressedContact, errors: BenchErrors
) -> ContactDepth:
    """One contact's depth, and how far each error moves it."""
    pose = contact.seen.base_from_gel
    changes = []
    for twist in np.diag(_STEPS):
        depths = (bench.pad_depth(twisted(pose, sign * twist)) for sign in (1.0, -1.0))
        ahead, behind = (max(_NOTHING, depth) for depth in depths)
        changes.append(ahead - behind)
    slope = np.asarray(np.array(changes) / (2.0 * _STEPS))
    read, expected = max(0.0, float(contact.heights.max())), max(0.0, bench.pad_depth(pose))
    shared = slope @ shared_twists(errors, pose, base_from_object[:3, 3])
    own = float(np.sqrt(slope @ own_covariance(errors) @ slope + READ**2 + (GAIN * read) ** 2))
    return ContactDepth(contact.step, read, expected, shared, own)


def depth_residuals(depths: Sequence[ContactDepth]) -> tuple[Residual, ...]:
    """Each contact's depth given those before it: independent, one degree of freedom each."""
    if not depths:
        return ()
    shared = np.array([depth.shared for depth in depths])
    covariance = shared @ shared.T + np.diag([depth.own**2 for depth in depths])
    gaps = np.array([depth.read - depth.expected for depth in depths])
    root = np.linalg.cholesky(covariance)
    innovations = solve_triangular(root, gaps, lower=True)
    return tuple(
        Residual(
            depth.step,
            "contact depth",
            float(innovation**2),
            1.0,
            {"read_m": depth.read, "expected_m": depth.expected, "sigma_m": float(sigma)},
        )
        for depth, innovation, sigma in zip(depths, innovations, np.diag(root), strict=True)
    )


def twisted(base_from_gel: FloatArray, twist: FloatArray) -> FloatArray:
    """A pose ``(4, 4)`` displaced and turned about its own place by ``(6,)`` m and rad, in base."""
    rotation = rotation_from_vector(twist[3:]) @ base_from_gel[:3, :3]
    return transform(rotation, base_from_gel[:3, 3] + twist[:3])
