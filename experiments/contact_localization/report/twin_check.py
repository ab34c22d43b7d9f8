"""The recorded arm and contacts against the twin's, for the report."""

import numpy as np

from experiments.contact_localization.answer import Answer
from harness.basics.arrays import FloatArray
from harness.basics.geometry import rotation_from_quaternion, transform, translation
from harness.recording.run_folder import RunFiles
from harness.report.data import TwinDeviation
from harness.skills.press import ContactMotion
from harness.twin.bench_of import twin_of
from harness.twin.compare import compare_arm, compare_contact
from harness.twin.rehearsal import predict_contact

_MOST_POSES = 200


def _pressed(run: RunFiles, index: int) -> FloatArray:
    """``(4, 4)`` ``base_from_gel`` of a contact that was chosen on the way, fully pressed, as planned."""
    motion = ContactMotion.from_parameters(run.recording.step(index).step.parameters)
    along = translation((motion.search + motion.press) * motion.axis)
    return np.asarray(along @ motion.base_from_stand_off @ run.station.flange_from_gel)


def deviations(run: RunFiles, found: Answer) -> tuple[TwinDeviation, ...]:
    """By step: the controller's poses against the twin's, and the contact against the rehearsed one."""
    bench = twin_of(run.scene, run.station, run.mesh)
    planned = run.recording.header.plan.get("pressed", [])
    rows = []
    for index, observation in enumerate(found.observations):
        readings = run.recording.step(index).readings
        joints, poses = readings["arm.joints"].values, readings["arm.base_from_flange"].values
        count = min(len(joints), len(poses))
        chosen = np.unique(np.linspace(0, count - 1, min(count, _MOST_POSES)).astype(np.int64))
        matrices = np.array([transform(rotation_from_quaternion(p[3:]), p[:3]) for p in poses[chosen]])
        arm = compare_arm(run.station.arm.model, joints[chosen], matrices)
        pressed = np.array(planned[index]) if index < len(planned) else _pressed(run, index)
        rehearsed = predict_contact(bench, index, pressed)
        contact = compare_contact(bench, rehearsed, observation.base_from_gel).distance
        rows.append(
            TwinDeviation(
                f"step {index + 1}",
                float(arm.distances.mean()),
                float(arm.distances.max()),
                float(arm.angles.max()),
                contact,
            )
        )
    return tuple(rows)
