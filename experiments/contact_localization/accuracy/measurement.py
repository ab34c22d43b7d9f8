"""Measure contact localization for tables, cost curves and budgets."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import cached_property, partial
from importlib.resources import as_file
from importlib.resources import files as package_files
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np

from experiments.contact_localization.accuracy.run import SILENT, ContactRun, run_of
from experiments.contact_localization.answer import ESTIMATOR, Models, solve
from experiments.contact_localization.build_model import model_of_scene
from experiments.contact_localization.cells import ContactCell
from experiments.contact_localization.model import Prior
from experiments.contact_localization.posterior.baselines import (
    MfccTable,
    mean_random_error,
    mfcc_filter,
    without_images,
)
from experiments.contact_localization.posterior.estimate import (
    METHOD,
    PARTICLES,
    SENSES,
    SPACING,
    needs_images,
)
from experiments.contact_localization.posterior.likelihood import noise_at
from experiments.contact_localization.posterior.policy import Readings
from experiments.contact_localization.posterior.search import Search
from experiments.contact_localization.section import Localization
from experiments.contact_localization.settings import (
    FINEST,
    accuracy_at,
    needs_sound,
    setting_name,
    settings,
    settings_by_count,
)
from experiments.contact_localization.settings import (
    HEARD as MODE_KNOBS,
)
from experiments.contact_localization.touch.touch import Contact
from harness.basics.arrays import FloatArray
from harness.basics.clock import now
from harness.basics.errors import DataRefused
from harness.basics.geometry import rotation_about
from harness.basics.symmetry import SymmetryGroup, find_symmetries
from harness.bench.scene import SceneFile
from harness.bench.station_file import Station
from harness.cost.curve import Curve
from harness.cost.file import load
from harness.effects.accuracy import Level, Setting
from harness.effects.catalogue import networks_of, scene_levels
from harness.effects.scene_object import named_file
from harness.effects.sound import EDGE, SHAPES
from harness.effects.touch import SHAPES as TOUCH
from harness.experiment.in_process import RunCell, open_run
from harness.experiment.measuring import MeasuredCondition, Measurement
from harness.recording.run_folder import RunFiles

SHIPPED = "data/cost.json"

METHODS = ("random", "geometry", "geometry + axis", "paper's touch filter", "touch")

HEARD = ("paper's MFCC filter", "audio", "both")
"""The methods that need strikes."""

PAPER: Setting = {METHOD.name: "particle", PARTICLES.name: 1000, SENSES.name: "touch"}

_SETTINGS: dict[str, Setting] = {
    "paper's touch filter": PAPER,
    **{senses: {SENSES.name: senses} for senses in SENSES.levels},
}

PAPER_CM = {
    "random": (6.74, 12.96, 4.28, 9.39, 14.53, 14.21),
    "audio, simulated": (1.88, 0.26, 0.65, 0.23, 0.14, 0.74),
    "audio, real": (1.79, 1.16, 4.67, 1.04),
    "touch, simulated": (0.04, 0.03, 0.18, 0.04, 0.04, 0.04),
    "touch, real": (1.26, 0.78, 1.30, 0.44, 0.91, 3.82),
    "audio and touch, simulated": (0.02, 0.04, 0.09, 0.04, 0.23, 0.30),
    "audio and touch, real": (0.59, 0.36, 0.51, 0.63),
}
"""ObjectFolder 2.0, table 4: mean error in cm over six objects of theirs, 5 to 7 contacts; the last two
objects were not struck in reality."""

_NO_OBJECTFILE = (
    "what accuracy costs was measured with networks of ObjectFiles alone, and this scene names none; name "
    "one, or measure without with `touchstone cost contact-localization`"
)


class ContactMeasurement(Measurement):
    """Measurement of contact localization; samples and modes are shared by all runs of one object."""

    conditions = (
        MeasuredCondition("spacing", ("close", "spread"), ("close", "spread")),
        MeasuredCondition("yaw", ("known", "unknown"), ("known",), ("known", "unknown")),
        MeasuredCondition("choose", ("planned", "active"), ("planned",), ("planned",)),
        MeasuredCondition("sense", ("touch", "both"), ("both",)),
    )
    counts = (2, 4, 6)
    methods = (*METHODS, *HEARD)
    regions = ("touch", "audio", "both")
    published = PAPER_CM
    estimator = ESTIMATOR
    finest = FINEST

    @cached_property
    def models(self) -> dict[str, Models]:
        """Models by object, of the runs measured so far."""
        return {}

    def cells(
        self, objects: Sequence[str], seeds: Sequence[int], chosen: Mapping[str, Sequence[str]]
    ) -> list[RunCell]:
        """List the runs, seed by seed; every contact is struck if a sense needs it."""
        varied = product(chosen["yaw"], chosen["gap"], chosen["spacing"], chosen["choose"], objects)
        sound = "both" in chosen["sense"]
        first = [
            ContactCell(o, gap, 0, spacing, yaw, sound, choose) for yaw, gap, spacing, choose, o in varied
        ]
        return [replace(cell, seed=seed) for seed in seeds for cell in first]

    def solver(self, files: RunFiles, cell: RunCell | None = None) -> ContactRun:
        """Return a run's contacts; runs of a table or a cost curve share the models of their object."""
        run = run_of(files)
        if cell is None:
            return run
        make = partial(model_of_scene, files.scene, files.station, files.mesh, files.calibration)
        models = self.models.setdefault(run.object, Models(make, scene_levels(files.scene)))
        rotation = run.prior.base_from_object
        prior = Prior(rotation, "known", files.station.errors.yaw)
        if cell.conditions["yaw"] == "unknown":
            # A random rotation, so that the unknown yaw falls between the grid's yaws, not on one of them.
            angle = float(np.random.default_rng((cell.seed, 11)).uniform(0.0, 2.0 * np.pi))
            prior = Prior(rotation_about(np.array([0.0, 0.0, 1.0]), angle) @ rotation, "unknown")
        return replace(run, models=models, prior=prior)

    def run_cell(
        self, cell: RunCell, scene: SceneFile, station: Station, recordings: Path | None = None
    ) -> dict[str, Any]:
        """Perform a run, or open it in ``recordings``, and answer it by every method.

        Raises:
            DataRefused: the true contacts are unknown.
        """
        own = cell.create_scene(scene)
        with open_run(self.experiment, cell, own, station, recordings) as files:
            run = self.solver(files, cell)
            readings, true = run.readings({}), run.true
            if true is None:
                raise DataRefused(f"the true contacts of {files.recording.folder.name} are unknown")
            symmetry = find_symmetries(readings.model.mesh)
            methods = self.methods if files.scene.sensors.sound else METHODS
            rows = {method: _scored(method, readings, true, symmetry) for method in methods}
            contacts = files.recording.committed
            return {"schema": 1, "cell": vars(cell), "contacts": contacts, "rows": rows}

    def list_answers(
        self,
        thorough: bool,
        chosen: Mapping[str, Sequence[str]],
        scenes: Mapping[str, SceneFile],
        counts: Sequence[int],
    ) -> list[tuple[int, Setting]]:
        """List the answers of a run: every setting from all contacts, some from fewer contacts."""
        sound = "both" in chosen["sense"]
        named = [scene for scene in scenes.values() if scene.object.objectfile is not None]
        networks = [networks_of(named_file(scene).description) for scene in named]
        shared = frozenset.intersection(*networks) if len(named) == len(scenes) else frozenset()
        whole, few = settings(thorough, sound, shared), settings_by_count(sound)
        return [(n, each) for n in counts for each in (whole if n == max(counts) else few)]

    def setting_name(self, setting: Setting) -> str:
        """Return the name of a setting, for the operator."""
        return setting_name(setting)

    def notes(self) -> tuple[str, ...]:
        """State the seconds of the modes per object, in a sentence for each choice of their knobs."""
        seconds: dict[str, list[float]] = {}
        for own in self.models.values():
            for levels, model in own.all().items():
                if model.modes is not None:
                    knobs = zip(MODE_KNOBS, levels, strict=False)
                    name = ", ".join(f"{knob.name} {level}" for knob, level in knobs)
                    seconds.setdefault(name, []).append(sum(model.modes.seconds.values()))
        return tuple(
            f"the modes at {name} took {min(each):.1f} to {max(each):.1f} s an object when they were found; "
            "no setting's seconds count them"
            for name, each in sorted(seconds.items())
        )

    def shipped_curve(self) -> Curve:
        """Return the curve that comes with the program, of another machine or older code."""
        with as_file(package_files("experiments.contact_localization").joinpath(SHIPPED)) as path:
            return load(Path(path))

    def condition(self, scene: SceneFile) -> Mapping[str, Level]:
        """Return the condition of a scene's runs in a curve, without the number of contacts."""
        section = scene.section(Localization)
        # A real bench has a gap, and a mocked one without a gap is only easier.
        return {"spacing": section.spacing, "gap": "default", "yaw": section.yaw}

    def explain_refusal(self, scene: SceneFile, setting: Setting) -> str | None:
        """State why a scene's runs cannot be answered at a setting; None if they can."""
        if needs_sound(setting) and not scene.sensors.sound:
            return SILENT
        networks = any(setting.get(knob.name, knob.default) != knob.default for knob in (SHAPES, TOUCH))
        return _NO_OBJECTFILE if networks and scene.object.objectfile is None else None

    def is_offered(self, setting: Setting) -> bool:
        """State whether a setting has the default elements of modes.

        Coarser elements are measured for their loss of accuracy; they save time once per object. Of
        settings with equal errors, a budget would select one by chance.
        """
        return setting.get(EDGE.name, EDGE.default) == EDGE.default


def _scored(method: str, readings: Readings, true: FloatArray, symmetry: SymmetryGroup) -> dict[str, Any]:
    start = now()
    if method == "random":
        error = mean_random_error(readings.model.mesh, true)
        return {"error_m": error, "error_symmetric_m": None, "seconds": 0.0}
    if method.startswith("geometry"):
        poses = [observation.base_from_gel for observation in readings.observations]
        axis = method.endswith("axis")
        point = without_images(poses, readings.model, readings.prior, SPACING.default, axis)
        return _errors(point, true, symmetry, now() - start)
    if method == "paper's MFCC filter":
        model, strikes = readings.model, [observation.strike for observation in readings.observations]
        assert model.modes is not None
        assert model.material is not None
        spacing, rate = SPACING.default, next(strike.rate for strike in strikes if strike is not None)
        table = MfccTable(model.gains(spacing), model.modes, model.material, rate)
        contacts = [Contact(observation.base_from_gel) for observation in readings.observations]
        search = Search(contacts, model, readings.prior, spacing, noise_at(model.errors))
        particles = mfcc_filter(search, table, strikes, accuracy_at(PAPER).of(PARTICLES), readings.seed)
        return _errors(particles.candidates().mean(axis=0), true, symmetry, now() - start)
    return _estimated(readings, _SETTINGS[method], true, symmetry)


def _estimated(
    readings: Readings, setting: Setting, true: FloatArray, symmetry: SymmetryGroup
) -> dict[str, Any]:
    solved = solve(readings, setting)
    seconds = solved.wall + (readings.shared[1] if needs_images(setting) else 0.0)
    if solved.found is None:
        # A refused fit of the right object is a failure, counted at the value of a random answer.
        error = mean_random_error(readings.model.mesh, true)
        return {
            "error_m": error,
            "error_symmetric_m": error,
            "seconds": seconds,
            "refused": solved.refusal,
            "in_region90": False,
        }
    found = solved.found
    return {
        **_errors(found.position_in_object, true, symmetry, seconds),
        "in_region90": found.region.contains(true),
        "region90_area_m2": found.region.area,
        "credible90_m": found.credible90,
        "modes": len(found.modes),
        "error_top10_m": float(np.linalg.norm(found.candidates - true, axis=1).mean()),
        "fits_nats": [gate.finite_fit for gate in found.gates],
    }


def _errors(point: FloatArray, true: FloatArray, symmetry: SymmetryGroup, seconds: float) -> dict[str, Any]:
    return {
        "error_m": float(np.linalg.norm(point - true)),
        "error_symmetric_m": symmetry.distance(point, true),
        "seconds": seconds,
    }
