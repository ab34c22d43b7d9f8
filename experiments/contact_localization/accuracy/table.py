"""Measuring localization: which runs, a table's rows by every method, and the settings that are timed."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from experiments.contact_localization.accuracy.benchmark_runs import (
    Cell,
    cells,
    perform,
    performed,
    preparations,
)
from experiments.contact_localization.answer import ESTIMATOR, solve
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
    Estimate,
    needs_images,
)
from experiments.contact_localization.posterior.likelihood import noise_at
from experiments.contact_localization.posterior.policy import Readings
from experiments.contact_localization.posterior.search import Search
from experiments.contact_localization.settings import (
    accuracy_at,
    setting_name,
    settings,
    settings_by_count,
)
from experiments.contact_localization.touch.touch import Contact
from harness.basics.arrays import FloatArray
from harness.basics.clock import now
from harness.basics.symmetry import SymmetryGroup, find_symmetries
from harness.bench.scene import SceneFile
from harness.bench.station_file import Station
from harness.effects.accuracy import Setting
from harness.effects.catalogue import networks_of
from harness.effects.scene_object import named_file
from harness.experiment.experiment import MeasuredCondition, Measurement

METHODS = ("random", "geometry", "geometry + axis", "paper's touch filter", "touch")


HEARD = ("paper's MFCC filter", "audio", "both")
"""The methods that need strikes."""


PAPER: Setting = {METHOD.name: "particle", PARTICLES.name: 1000, SENSES.name: "touch"}


_SETTINGS: dict[str, Setting] = {
    "paper's touch filter": PAPER,
    **{senses: {SENSES.name: senses} for senses in SENSES.levels},
}


def run_cell(
    cell: Cell, scene: SceneFile, station: Station, recordings: Path | None = None
) -> dict[str, Any]:
    """Perform and answer one run; the result as JSON values.

    Raises:
        NotImplementedError: recordings are to be kept.
    """
    if recordings is not None:
        raise NotImplementedError(
            "tables contact-localization --recordings: its runs are read as they are performed; leave it out"
        )
    case = perform(cell, scene, station, {})
    readings, true = case.run.read({}), np.asarray(case.true_points[-1])
    symmetry = find_symmetries(case.mesh)
    methods = (*METHODS, *HEARD) if cell.sound else METHODS
    rows = {method: _scored(method, readings, true, symmetry) for method in methods}
    return {"schema": 1, "cell": asdict(cell), "contacts": case.steps, "rows": rows}


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


def _cells(objects: Sequence[str], seeds: Sequence[int], chosen: Mapping[str, Sequence[str]]) -> list[Cell]:
    heard = _heard(chosen)
    return cells(objects, seeds, chosen["spacing"], chosen["gap"], chosen["yaw"], heard, chosen["choose"])


def _heard(chosen: Mapping[str, Sequence[str]]) -> bool:
    return "both" in chosen["sense"]


def _settings(
    thorough: bool, chosen: Mapping[str, Sequence[str]], scenes: Mapping[str, SceneFile]
) -> Sequence[Setting]:
    named = [scene for scene in scenes.values() if scene.object.objectfile is not None]
    networks = [networks_of(named_file(scene).description) for scene in named]
    shared = frozenset.intersection(*networks) if len(named) == len(scenes) else frozenset()
    return settings(thorough, _heard(chosen), shared)


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
    found: Estimate = solved.found
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


MEASUREMENT = Measurement(
    estimator=ESTIMATOR,
    conditions=(
        MeasuredCondition("spacing", ("close", "spread"), ("close", "spread")),
        MeasuredCondition("yaw", ("known", "unknown"), ("known",), ("known", "unknown")),
        MeasuredCondition("choose", ("planned", "active"), ("planned",), ("planned",)),
        MeasuredCondition("sense", ("touch", "both"), ("both",)),
    ),
    cells=_cells,
    run_cell=run_cell,
    methods=(*METHODS, *HEARD),
    performed=performed,
    settings=_settings,
    setting_name=setting_name,
    fewer=lambda chosen: settings_by_count(_heard(chosen)),
    counts=(2, 4, 6),
    regions=("touch", "audio", "both"),
    notes=preparations,
    published=PAPER_CM,
)
