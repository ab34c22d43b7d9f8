"""What a scene observes, simulated at the answer; what a run can give is checked before it begins."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from harness.agreement.agreement import Agreement
from harness.basics.arrays import AnyArray
from harness.basics.errors import MeshRefused, OutOfDomain, WrongUse
from harness.basics.files.json_file import JsonObject
from harness.basics.materials import MATERIALS
from harness.basics.mesh import Mesh
from harness.basics.store import Store, default_folder
from harness.bench.scene import SceneFile
from harness.bench.scene_camera import scene_lamps, scene_pinhole
from harness.bench.station_file import Station
from harness.effects.accuracy import Accuracy
from harness.effects.catalogue import EFFECTS, NETWORK, scene_levels
from harness.effects.evaluate import Evaluation, evaluate
from harness.effects.explain import scene_plan, without_sound
from harness.effects.plan import Plan, default_accuracy
from harness.effects.quantities import Quantities
from harness.effects.touch import SHAPES as TOUCH
from harness.experiment.experiment import AnyExperiment, AnyScored
from harness.objectfile.vision.render import Rendered
from harness.picture.pinhole import DirectionalLight
from harness.recording.run_folder import RunFiles
from harness.sim.light.direct_image import DirectImage
from harness.sim.optics.lit_calibration import shadow_of
from harness.sim.optics.tactile_calibration import TactileCalibration

CARRIED = ("object.mesh", "object.wall", "object.material", "sensor", "sensor.calibration", "seed")
"""Sources that every run's folder carries; ``require_sources`` adds a camera's."""


@dataclass(frozen=True, eq=False)
class Comparison:
    """What the scene observes, as it should have been read."""

    plan: Plan  #: which effects the scene called for.
    evaluation: Evaluation  #: which ran, how often and how long; their values by name.
    notes: tuple[str, ...] = ()  #: what a reader must know of how it was simulated.
    agreement: Agreement | None = None
    """of the readings with a model of the object at the stated pose; None where not compared."""

    def observed(self) -> dict[str, JsonObject]:
        """Every wanted quantity in JSON: shape and range of an array, parts of a mapping or a picture."""
        return {name: _described(self.evaluation[name]) for name in self.plan.wanted}

    def arrays(self) -> dict[str, AnyArray]:
        """Every wanted quantity that is an array, a mapping of them or a picture, by name."""
        found: dict[str, AnyArray] = {}
        for name in self.plan.wanted:
            value = self.evaluation[name]
            parts = _parts(value)
            for part, array in [("", value)] if parts is None else parts.items():
                if isinstance(array, np.ndarray):
                    found[f"{name}.{part}" if part else name] = array
        return found


def require_sources(
    experiment: AnyExperiment, scene: SceneFile, station: Station, calibration: TactileCalibration
) -> None:
    """Refuse a scene that observes what no run of this experiment can simulate.

    Raises:
        WrongUse: naming what is missing and which observed quantity needs it; or ``observe`` names something
            that nothing computes, that the scene rules out or that is not built; or a picture under
            coloured lamps.
    """
    levels = default_accuracy(EFFECTS).with_(scene_levels(scene))
    plan = scene_plan(scene, station.gel.sensor, levels)
    given = {*CARRIED, *experiment.gives}
    if station.camera is not None and scene.sensors.camera:
        given |= {"camera", "camera.lights"}
        # Rays need the object's colours, which a run knows of a built-in object alone.
        if scene.object.builtin is not None:
            given.add("object.appearance")
    if shadow_of(calibration) is not None:
        given.add("sensor.shadow_table")
    if scene.object.objectfile is not None:
        given.add("object.file")
    if "camera.lights" in plan.sources:
        for number, lamp in enumerate(scene.lights, start=1):
            if max(lamp.colour) - min(lamp.colour) > _GREY * max(lamp.colour):
                raise WrongUse(
                    f"lamp {number} of the scene has the colour {list(lamp.colour)}, and a run's picture is "
                    "simulated under white lamps; give its red, green and blue one number, or leave "
                    "camera.image out of observe"
                )
    missing = [name for name in plan.sources if name not in given]
    if missing:
        raise WrongUse(
            f"observe = {list(scene.observe)}: a run of {experiment.name} has no {', '.join(missing)} to "
            f"simulate it from; it has {', '.join(sorted(given))}: observe what follows from these"
        )


def compare(scored: AnyScored, given: Quantities) -> Comparison:
    """Simulate what the scene observes at the answer, and nothing else.

    Args:
        scored: the answer.
        given: what it gives the simulation, the quantities of the experiment's ``gives``.
    """
    scene = scored.run.scene
    try:
        return _drawn_at(scored, scene, given)
    except MeshRefused as refusal:
        if not scene.sensors.sound:
            raise
        silent = _drawn_at(scored, without_sound(scene), given)
        return replace(silent, notes=(*silent.notes, f"the object's sound is not simulated: {refusal}"))


def _drawn_at(scored: AnyScored, scene: SceneFile, given: Quantities) -> Comparison:
    accuracy = scored.accuracy
    try:
        return _simulated(scored, scene, given, accuracy)
    except OutOfDomain as refusal:
        if accuracy.get(TOUCH.name) != NETWORK:
            raise
        # A gel may stand where no network was made for it; the readings are compared all the same.
        instead = _simulated(scored, scene, given, accuracy.with_({TOUCH.name: TOUCH.default}))
        note = f"the readings are drawn with {TOUCH.name} = {TOUCH.default}: {refusal}"
        return replace(instead, notes=(note,))


def _simulated(scored: AnyScored, scene: SceneFile, given: Quantities, accuracy: Accuracy) -> Comparison:
    run = scored.run
    plan = scene_plan(scene, run.station.gel.sensor, accuracy)
    sources: Quantities = {**_carried(run, plan), **given}
    return Comparison(plan, evaluate(plan, sources, Store(default_folder())))


def _carried(run: RunFiles, plan: Plan) -> Quantities:
    sources: Quantities = {
        "object_mesh": run.mesh,
        "object_wall": run.scene.object.wall,
        "object_material": MATERIALS[run.scene.object.material],
        "sensor": run.station.gel.sensor,
        "sensor_calibration": run.calibration,
        "seed": run.recording.header.seed,
    }
    shadow = shadow_of(run.calibration)
    if shadow is not None:
        sources["sensor_shadow_table"] = shadow
    if "object.file" in plan.sources:
        sources["object_file"] = run.objectfile
    return {**sources, **camera_sources(run.scene, run.station, run.mesh, plan.sources)}


def _parts(value: object) -> Mapping[str, object] | None:
    """Of a mapping, and of a picture: linear light and coverage; None of what is one thing."""
    if isinstance(value, DirectImage | Rendered):
        return {"colour": value.image.colour, "coverage": value.image.alpha}
    return value if isinstance(value, Mapping) else None


def _described(value: object) -> JsonObject:
    parts = _parts(value)
    if parts is not None:
        return {"parts": {str(name): _described(part) for name, part in parts.items()}}
    if not isinstance(value, np.ndarray):
        return {"kind": type(value).__name__}
    said: dict[str, object] = {"shape": list(value.shape), "dtype": str(value.dtype)}
    if value.size and np.issubdtype(value.dtype, np.number) and not np.iscomplexobj(value):
        finite = value[np.isfinite(value)]
        if finite.size:
            said |= {"least": float(finite.min()), "mean": float(finite.mean()), "most": float(finite.max())}
    return said


_GREY = 1e-6
"""Relative, by which the parts of a lamp's colour may differ and still be one number."""


def camera_sources(scene: SceneFile, station: Station, mesh: Mesh, wanted: Sequence[str]) -> Quantities:
    """The sources of a picture that are wanted, in the object's frame at its nominal pose.

    Args:
        scene: with a camera and white lamps.
        station: whose camera it is.
        mesh: of the object, in metres.
        wanted: names of sources; others than a camera's are left to others.

    Raises:
        WrongUse: the station has no camera.
    """
    sources: Quantities = {}
    if "camera" in wanted:
        sources["camera"] = scene_pinhole(station, scene, mesh)
    if "camera.lights" in wanted:
        # The light of a white lamp is as strong as its colour says.
        sources["camera_lights"] = tuple(
            DirectionalLight(lamp.light.direction, lamp.light.irradiance * float(lamp.colour[0]))
            for lamp in scene_lamps(scene, mesh)
        )
    if "object.appearance" in wanted and scene.object.builtin is not None:
        # Loaded by those alone who follow rays on the mesh.
        from harness.sim.light.appearance_source import builtin_appearance

        sources["object_appearance"] = builtin_appearance(scene.object.builtin, scene.object.drawn_scale)
    return sources
