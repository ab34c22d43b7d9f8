"""The live readings beside what the model of the object says they should have been."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from experiments.contact_localization.answer import Answer
from harness.basics.arrays import ByteArray, FloatArray, read_only
from harness.basics.geometry import inverse, transform
from harness.basics.materials import MATERIALS
from harness.basics.store import Store, default_folder
from harness.effects.accuracy import Accuracy
from harness.effects.evaluate import Evaluation, evaluate
from harness.effects.explain import scene_plan
from harness.effects.plan import Plan
from harness.recording.run_folder import RunFiles
from harness.sim.optics.inverse import invert
from harness.sim.optics.lit_calibration import shadow_of


@dataclass(frozen=True, eq=False)
class Comparison:
    """Live against simulated, contact by contact.

    Attributes:
        live: ``(contacts, rows, columns, 3)`` uint8 RGB, the last frame of each press.
        simulated: the same, at the estimated contacts.
        live_height: ``(contacts, rows, columns)`` metres of indentation, from the live images.
        simulated_height: the same, of the simulated gel.
        object_from_gel: ``(contacts, 4, 4)``, where the estimate puts the gel.
        plan: which effects the scene called for.
        evaluation: which ran, how often and how long.
    """

    live: ByteArray
    simulated: ByteArray
    live_height: FloatArray
    simulated_height: FloatArray
    object_from_gel: FloatArray
    plan: Plan
    evaluation: Evaluation


def compare(found: Answer, run: RunFiles, accuracy: Accuracy) -> Comparison:
    """Simulate what the scene observes at the estimated contacts, and nothing else."""
    live = np.array([observation.images[-1] for observation in found.observations])
    live_height = invert(live, run.calibration).height
    object_from_gel = _gels(found, live_height)
    plan = scene_plan(run.scene, run.station.gel.sensor, accuracy)
    sources: dict[str, Any] = {
        "object.mesh": run.mesh,
        "object.wall": run.scene.object.wall,
        "object.material": MATERIALS[run.scene.object.material],
        "contact.gel_from_object": inverse(object_from_gel),
        "sensor": run.station.gel.sensor,
        "sensor.calibration": run.calibration,
        "seed": run.recording.header.seed,
    }
    shadow = shadow_of(run.calibration)
    if shadow is not None:
        sources["sensor.shadow_table"] = shadow
    if "object.file" in plan.sources:
        sources["object.file"] = run.objectfile
    evaluation = evaluate(plan, sources, Store(default_folder()))
    return Comparison(
        read_only(live),
        evaluation["touch.image"],
        live_height,
        evaluation["touch.gel"],
        read_only(object_from_gel),
        plan,
        evaluation,
    )


def _gels(found: Answer, live_height: FloatArray) -> FloatArray:
    """``(contacts, 4, 4)``: each gel as deep behind its estimated contact as its own image says."""
    object_from_base = found.prior.object_from_base(np.array([found.last.yaw]))[0]
    poses = []
    for observation, point, height in zip(found.observations, found.last.contacts, live_height, strict=True):
        rotation = object_from_base @ observation.base_from_gel[:3, :3]
        poses.append(transform(rotation, point + _at_centre(height) * rotation[:, 2]))
    return np.array(poses)


def _at_centre(height: FloatArray) -> float:
    rows, columns = height.shape
    middle = height[(rows - 1) // 2 : rows // 2 + 1, (columns - 1) // 2 : columns // 2 + 1]
    return float(middle.mean())
