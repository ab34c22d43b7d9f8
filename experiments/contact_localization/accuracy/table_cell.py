"""One cell's run of the localization table: a mocked run in process, answered by every method.

The bench is the mocked one without sockets (``mocks.in_process.bench``), planned and rehearsed as any
run is; at least one run per object goes over the wires elsewhere and must read the same.
"""

import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from experiments.contact_localization.answer import in_time, observe_step
from experiments.contact_localization.build_model import model_of_scene
from experiments.contact_localization.model import Model, Prior
from experiments.contact_localization.observation import Observation
from experiments.contact_localization.plan import plan_contacts
from experiments.contact_localization.posterior.baselines import (
    geometry_and_axis,
    geometry_only,
    mean_random_error,
)
from experiments.contact_localization.posterior.estimate import Estimate, estimate
from experiments.contact_localization.posterior.hypotheses import Contact, Noise
from experiments.contact_localization.posterior.levels import Levels
from experiments.contact_localization.posterior.search import Search
from experiments.contact_localization.report.result import fit_of
from experiments.contact_localization.sound.mfcc import MfccTable, mfcc_filter
from harness.basics.arrays import FloatArray
from harness.basics.clock import now
from harness.basics.errors import FitRefused
from harness.basics.geometry import rotation_about
from harness.basics.mesh import Mesh
from harness.basics.symmetry import SymmetryGroup, find_symmetries
from harness.bench.scene import SceneFile, scene_from_json
from harness.bench.station import RunContext
from harness.bench.station_file import Station
from harness.effects.scene_object import known_object
from harness.picture.square_pixels import aspect_stated
from harness.recording.run_folder import station_acquisition, station_calibration
from harness.recording.step_file import Step, StepRecord
from harness.skills.press import PressPerformer
from harness.twin.bench_of import way_between
from mocks.in_process.bench import in_process_bench

METHODS = ("random", "geometry", "geometry + axis", "paper's touch filter", "touch")
HEARD = ("paper's MFCC filter", "audio", "both")
"""The methods that need strikes."""

PAPER = Levels(method="particle", particles=1000, senses="touch")
_LEVELS = {"paper's touch filter": PAPER, **{s: Levels(senses=s) for s in ("touch", "audio", "both")}}


@dataclass(frozen=True)
class Cell:
    """Which run.

    Attributes:
        object: its name in the table.
        spacing: ``"close"`` or ``"spread"``.
        gap: ``"default"`` or ``"none"``.
        yaw: ``"known"`` to the estimator or ``"unknown"``.
        seed: of the sites, the world and the draws.
        sound: whether every place is struck too.
    """

    object: str
    spacing: str
    gap: str
    yaw: str
    seed: int
    sound: bool = False

    @property
    def conditions(self) -> dict[str, str]:
        """What was varied."""
        return {"spacing": self.spacing, "gap": self.gap, "yaw": self.yaw}

    @property
    def name(self) -> str:
        """Of the cell's file; a gap may be a path."""
        gap = self.gap.replace("/", "_")
        plain = f"{self.object}-{self.spacing}-{gap}-{self.yaw}-{self.seed}"
        return f"{plain}-sound" if self.sound else plain


@dataclass(frozen=True, eq=False)
class PerformedRun:
    """A performed run, as an estimator may see it, and its truth."""

    observations: tuple[Observation, ...]
    model: Model
    base_from_object: FloatArray
    true_points: FloatArray
    seed: int

    @property
    def true(self) -> FloatArray:
        """``(3,)`` metres: the last contact."""
        return np.asarray(self.true_points[-1])


def scene_of(cell: Cell, scene: SceneFile) -> SceneFile:
    """The scene of a run: the object turned by an angle of the run's own."""
    turned = np.random.default_rng((cell.seed, 7)).uniform(0.0, 360.0)
    tree = scene.model_dump(mode="json", by_alias=True)
    tree.setdefault("localization", {})["spacing"] = cell.spacing
    tree["object"]["pose"]["yaw"] = f"{turned:.3f} deg"
    tree["sensors"]["sound"] = cell.sound
    return scene_from_json(tree, "the table")


def run_cell(cell: Cell, scene: SceneFile, station: Station) -> dict[str, Any]:
    """Perform and answer one run; the result as JSON values."""
    scene = scene_of(cell, scene)
    mesh = known_object(scene).mesh
    run = perform_cell(cell, scene, station, mesh)
    symmetry = find_symmetries(mesh)
    prior = believed(run, cell.yaw)
    methods = (*METHODS, *HEARD) if cell.sound else METHODS
    rows = {method: _scored(method, run, prior, symmetry) for method in methods}
    return {"schema": 1, "cell": asdict(cell), "contacts": len(run.observations), "rows": rows}


def perform_cell(cell: Cell, scene: SceneFile, station: Station, mesh: Mesh) -> PerformedRun:
    """Plan and perform one run on the bench in process, without answering it."""
    plan, acquisition = plan_contacts(scene, station, mesh, cell.seed), station_acquisition(scene, station)
    calibration = station_calibration(station)
    aspect = aspect_stated(calibration.header.made_from)
    experiment = PressPerformer(lambda here, planned: way_between(plan.bench, here, planned))
    with TemporaryDirectory(prefix="touchstone-table-") as folder:
        context = RunContext(Path(folder) / "truth.json", mesh, cell.seed, cell.gap)
        bench = in_process_bench(scene, station, context)
        observations = []
        for index, parameters in enumerate(plan.parameters()):
            step = Step(index, "press", parameters)
            readings = {r.channel.name: r for r in experiment.perform(step, bench)}
            record = StepRecord(step, readings, 0.0)
            observations.append(observe_step(record, station.flange_from_gel, acquisition, aspect))
        true = _truth(context.truth)
    model = model_of_scene(scene, station, mesh, calibration)
    return PerformedRun(in_time(observations), model, scene.base_from_object(mesh), true, cell.seed)


def _truth(path: Path) -> FloatArray:
    """``(contacts, 3)`` metres, in the object's frame."""
    contacts = json.loads(path.read_text(encoding="utf-8"))["contacts"]
    return np.array([contact["point_in_object_m"] for contact in contacts])


def believed(run: PerformedRun, yaw: str) -> Prior:
    """What an estimator is told of the object's orientation, its yaw ``"known"`` or ``"unknown"``."""
    rotation = run.base_from_object[:3, :3]
    if yaw == "known":
        return Prior(rotation, "known")
    # Turned by chance, so that the unknown yaw falls between the grid's yaws, not on one of them.
    angle = float(np.random.default_rng((run.seed, 11)).uniform(0.0, 2.0 * np.pi))
    return Prior(rotation_about(np.array([0.0, 0.0, 1.0]), angle) @ rotation, "unknown")


def _scored(method: str, run: PerformedRun, prior: Prior, symmetry: SymmetryGroup) -> dict[str, Any]:
    start = now()
    if method == "random":
        error = mean_random_error(run.model.mesh, run.true)
        return {"error_m": error, "error_symmetric_m": None, "seconds": 0.0}
    if method.startswith("geometry"):
        method_of = geometry_and_axis if method.endswith("axis") else geometry_only
        poses = [observation.base_from_gel for observation in run.observations]
        point = method_of(poses, run.model, prior, Levels().spacing).position_in_object
        return _errors(point, run.true, symmetry, now() - start)
    if method == "paper's MFCC filter":
        return _errors(_by_mfcc(run, prior), run.true, symmetry, now() - start)
    return _estimated(run, prior, _LEVELS[method], symmetry, start)


def _by_mfcc(run: PerformedRun, prior: Prior) -> FloatArray:
    """``(3,)`` metres: the mean of the paper's filter's most probable distinct particles."""
    model, strikes = run.model, [observation.strike for observation in run.observations]
    assert model.modes is not None
    assert model.material is not None
    spacing, rate = PAPER.spacing, next(strike.rate for strike in strikes if strike is not None)
    table = MfccTable(model.gains(spacing), model.modes, model.material, rate)
    contacts = [Contact(observation.base_from_gel) for observation in run.observations]
    search = Search(contacts, model, prior, spacing, Noise())
    particles = mfcc_filter(search, table, strikes, PAPER.particles, run.seed)
    return np.asarray(particles.candidates().mean(axis=0))


def _estimated(
    run: PerformedRun, prior: Prior, levels: Levels, symmetry: SymmetryGroup, start: float
) -> dict[str, Any]:
    try:
        found = estimate(run.observations, run.model, prior, levels, seed=run.seed)
    except FitRefused as refusal:
        # A refused fit of the right object is a failure, counted at the value of a random answer.
        error = mean_random_error(run.model.mesh, run.true)
        seconds = now() - start
        return {
            "error_m": error,
            "error_symmetric_m": error,
            "seconds": seconds,
            "refused": str(refusal),
            "in_region90": False,
        }
    scored = _errors(found.position_in_object, run.true, symmetry, now() - start)
    return {**scored, **_sureness(found, run.true)}


def _sureness(found: Estimate, true: FloatArray) -> dict[str, Any]:
    return {
        "in_region90": found.region.contains(true),
        "region90_area_m2": found.region.area,
        "credible90_m": found.credible90,
        "modes": len(found.modes),
        "error_top10_m": float(np.linalg.norm(found.candidates - true, axis=1).mean()),
        "fits_nats": [fit_of(gate) for gate in found.gates],
    }


def _errors(point: FloatArray, true: FloatArray, symmetry: SymmetryGroup, seconds: float) -> dict[str, Any]:
    return {
        "error_m": float(np.linalg.norm(point - true)),
        "error_symmetric_m": symmetry.distance(point, true),
        "seconds": seconds,
    }


def cells(
    objects: Sequence[str],
    seeds: Sequence[int],
    spacings: Sequence[str],
    gaps: Sequence[str],
    yaws: Sequence[str],
    sound: bool = False,
) -> list[Cell]:
    """Every run of a table, one seed of every object before the next: a table that is stopped is even."""
    first = [Cell(o, s, g, y, 0, sound) for y in yaws for g in gaps for s in spacings for o in objects]
    return [replace(cell, seed=seed) for seed in seeds for cell in first]
