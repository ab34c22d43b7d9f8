"""Runs on the mocked bench, performed in process and kept in memory, to be answered at any setting."""

import gc
import itertools
import json
from collections.abc import Iterator, Mapping, MutableMapping, Sequence
from concurrent.futures import Executor, Future
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from experiments.contact_localization.accuracy.budget import Run
from experiments.contact_localization.answer import (
    PROGRAM,
    Models,
    observe,
    prepare,
    solve,
)
from experiments.contact_localization.build_model import model_of_scene
from experiments.contact_localization.model import Prior
from experiments.contact_localization.plan import plan_contacts
from experiments.contact_localization.posterior.baselines import mean_random_error
from experiments.contact_localization.posterior.estimate import Estimate, needs_images
from experiments.contact_localization.posterior.policy import Readings
from experiments.contact_localization.settings import HEARD
from harness.basics.arrays import FloatArray
from harness.basics.errors import TouchstoneError
from harness.basics.geometry import rotation_about
from harness.basics.mesh import Mesh
from harness.bench.scene import SceneFile, scene_from_json
from harness.bench.station import RunContext
from harness.bench.station_file import Station
from harness.cost.curve import Sample
from harness.effects.accuracy import Setting
from harness.effects.catalogue import scene_levels
from harness.effects.scene_object import known_object
from harness.experiment import in_process
from harness.experiment.experiment import Say
from harness.experiment.lookup import named
from harness.experiment.solving import Solved
from harness.experiment.subjects import object_key
from harness.picture.square_pixels import aspect_stated
from harness.recording.observation import Observation, in_time, observe_step
from harness.recording.run_folder import RunFiles, station_acquisition, station_calibration
from harness.recording.step_file import Step, StepRecord
from harness.sim.optics.inverse import GelReader
from harness.skills.press import PressPerformer
from harness.twin.bench_of import way_between
from mocks.in_process.bench import in_process_bench


@dataclass(frozen=True)
class Cell:
    """Which run."""

    object: str  #: its name in the table.
    spacing: str  #: ``"close"`` or ``"spread"``.
    gap: str  #: ``"default"`` or ``"none"``.
    yaw: str  #: ``"known"`` to the estimator or ``"unknown"``.
    seed: int  #: of the sites, the world and the draws.
    sound: bool = False  #: whether every place is struck too.
    choose: str = "planned"  #: ``"planned"`` contacts, or ``"active"`` ones, chosen one by one.

    @property
    def conditions(self) -> dict[str, str]:
        """What was varied."""
        return {"spacing": self.spacing, "gap": self.gap, "yaw": self.yaw, "choose": self.choose}

    @property
    def name(self) -> str:
        """Of the cell's file; a gap may be a path."""
        gap = self.gap.replace("/", "_")
        plain = f"{self.object}-{self.spacing}-{gap}-{self.yaw}-{self.seed}"
        heard = f"{plain}-sound" if self.sound else plain
        return heard if self.choose == "planned" else f"{heard}-{self.choose}"


def scene_of(cell: Cell, scene: SceneFile) -> SceneFile:
    """The scene of a run: the object turned by an angle of the run's own."""
    turned = np.random.default_rng((cell.seed, 7)).uniform(0.0, 360.0)
    tree = scene.model_dump(mode="json", by_alias=True)
    tree.setdefault("localization", {}).update(spacing=cell.spacing, choose=cell.choose)
    tree["object"]["pose"]["yaw"] = f"{turned:.3f} deg"
    tree["sensors"]["sound"] = cell.sound
    return scene_from_json(tree, "the table")


def cells(
    objects: Sequence[str],
    seeds: Sequence[int],
    spacings: Sequence[str],
    gaps: Sequence[str],
    yaws: Sequence[str],
    sound: bool = False,
    choices: Sequence[str] = ("planned",),
) -> list[Cell]:
    """Every run of a table, one seed of every object before the next: a table that is stopped is even."""
    varied = itertools.product(yaws, gaps, spacings, choices, objects)
    first = [Cell(o, spacing, gap, yaw, 0, sound, choose) for yaw, gap, spacing, choose, o in varied]
    return [replace(cell, seed=seed) for seed in seeds for cell in first]


@dataclass(frozen=True, eq=False)
class Case:
    """A performed run with its truth, to be answered at any setting."""

    cell: Cell
    run: Run
    true_points: FloatArray
    mesh: Mesh
    _left: dict[int, float] = field(init=False, default_factory=dict, repr=False)

    @property
    def steps(self) -> int:
        """How many contacts were made."""
        return len(self.run.observations)

    def close(self) -> None:
        """Nothing: a case is in memory alone."""

    def readings(self, setting: Setting) -> Readings:
        """Return the readings of the run at a setting."""
        return self.run.read(setting)

    def sample(self, setting: Setting, contacts: int) -> Sample:
        """One setting from the first contacts: the error of the last of them, and the seconds."""
        readings = self.readings(setting).first(contacts)
        prepare(readings.model, setting)
        with _uncollected():
            solved = solve(readings, setting)
        shared = readings.shared[0] if needs_images(setting) else 0.0
        error = self.error_of(solved, contacts)
        return Sample(
            self.cell.name,
            self.run.object,
            error,
            solved.radius,
            shared,
            solved.cpu,
            solved.wall,
            self.work(contacts),
        )

    def work(self, contacts: int) -> float:
        """By the first contacts: how much there is to do."""
        if contacts not in self._left:
            run = replace(self.run, observations=self.run.observations[:contacts])
            self._left[contacts] = run.work({})
        return self._left[contacts]

    def error_of(self, solved: Solved[Estimate], contacts: int) -> float:
        """m, of the last of the first contacts; a refused answer counts as a random one."""
        true = self.true_points[contacts - 1]
        if solved.found is None:
            return mean_random_error(self.mesh, true)
        return float(np.linalg.norm(solved.found.position_in_object - true))


@contextmanager
def _uncollected() -> Iterator[None]:
    """No garbage is collected meanwhile, as the standard library's ``timeit`` has it.

    In a process that holds dozens of runs a collection takes 0.1 s and more; in a run's own it does not.
    """
    collected = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if collected:
            gc.enable()


def perform(cell: Cell, scene: SceneFile, station: Station, models: MutableMapping[str, Models]) -> Case:
    """Plan and perform a run on the mocked bench in process.

    Args:
        cell: which run.
        scene: of the object.
        station: a mocked one.
        models: by object, taken from and added to: an object's samples are made once for all its runs.
    """
    return _case(cell, _recorded(cell, scene, station), scene, station, models)


_Recorded = tuple[tuple[Observation, ...], FloatArray]
"""The observations and the true points of a performed run."""


def _recorded(cell: Cell, scene: SceneFile, station: Station) -> _Recorded:
    scene = scene_of(cell, scene)
    if cell.choose == "planned":
        return _planned(cell, scene, station)
    # Contacts chosen one by one are chosen on what is recorded of those before.
    with TemporaryDirectory(prefix="touchstone-table-") as folder:
        recording = in_process.performed(named(PROGRAM), cell, scene, station, Path(folder) / "run")
        contacts = json.loads(recording.truth_path.read_text(encoding="utf-8"))["contacts"]
        seen = observe(RunFiles(recording))
    return seen, np.array([contact["point_in_object_m"] for contact in contacts])


def _planned(cell: Cell, scene: SceneFile, station: Station) -> _Recorded:
    """In memory alone: a recording keeps times to the nanosecond, and these are whole."""
    mesh = known_object(scene).mesh
    plan, acquisition = plan_contacts(scene, station, mesh, cell.seed), station_acquisition(scene, station)
    aspect = aspect_stated(station_calibration(station).header.made_from)
    performer = PressPerformer(partial(way_between, plan.bench))
    with TemporaryDirectory(prefix="touchstone-table-") as folder:
        context = RunContext(Path(folder) / "truth.json", mesh, cell.seed, cell.gap)
        bench = in_process_bench(scene, station, context)
        observations = []
        for index, parameters in enumerate(plan.parameters()):
            step = Step(index, "press", parameters)
            readings = {r.channel.name: r for r in performer.perform(step, bench)}
            record = StepRecord(step, readings, 0.0)
            observations.append(observe_step(record, station.flange_from_gel, acquisition, aspect))
        contacts = json.loads(context.truth.read_text(encoding="utf-8"))["contacts"]
    return in_time(observations), np.array([contact["point_in_object_m"] for contact in contacts])


def _elsewhere(cell: Cell, scene: dict[str, Any], station: Station) -> _Recorded:
    return _recorded(cell, scene_from_json(scene, "the cost of accuracy"), station)


def _case(
    cell: Cell,
    recorded: _Recorded,
    scene: SceneFile,
    station: Station,
    models: MutableMapping[str, Models],
) -> Case:
    turned = scene_of(cell, scene)
    mesh = known_object(turned).mesh
    name = object_key(cell.object, mesh)
    calibration = station_calibration(station)
    own = models.setdefault(
        name,
        Models(
            lambda accuracy: model_of_scene(turned, station, mesh, calibration, accuracy),
            scene_levels(turned),
        ),
    )
    observations, true_points = recorded
    base_from_object = turned.base_from_object(mesh)[:3, :3]
    if cell.yaw == "known":
        prior = Prior(base_from_object, "known", station.errors.yaw)
    else:
        # Turned by chance, so that the unknown yaw falls between the grid's yaws, not on one of them.
        angle = float(np.random.default_rng((cell.seed, 11)).uniform(0.0, 2.0 * np.pi))
        prior = Prior(rotation_about(np.array([0.0, 0.0, 1.0]), angle) @ base_from_object, "unknown")
    run = Run(observations, GelReader(calibration), own, prior, cell.seed, name)
    return Case(cell, run, true_points, mesh)


def performed(
    cells: Sequence[Cell],
    scenes: Mapping[str, SceneFile],
    station: Station,
    pool: Executor | None,
    models: MutableMapping[str, Models],
    say: Say,
) -> dict[Cell, Case]:
    """Perform runs, side by side where there is a pool; returns when all are done."""
    begun: dict[Cell, Future[_Recorded]] = {}
    if pool is not None:
        trees = {name: scene.model_dump(mode="json", by_alias=True) for name, scene in scenes.items()}
        begun = {cell: pool.submit(_elsewhere, cell, trees[cell.object], station) for cell in cells}
    cases = {}
    for cell in cells:
        scene = scenes[cell.object]
        try:
            if pool is None:
                cases[cell] = perform(cell, scene, station, models)
            else:
                cases[cell] = _case(cell, begun[cell].result(), scene, station, models)
        except TouchstoneError as error:
            say(f"{cell.name} was not performed: {error}")
    return cases


def preparations(models: Mapping[str, Models]) -> tuple[str, ...]:
    """What the simulation's levels cost once an object, in a sentence each; nothing for touch alone."""
    took: dict[str, list[float]] = {}
    for own in models.values():
        for levels, model in own.all().items():
            if model.modes is not None:
                dials = zip(HEARD, levels, strict=False)
                name = ", ".join(f"{knob.name} {level}" for knob, level in dials)
                took.setdefault(name, []).append(sum(model.modes.seconds.values()))
    return tuple(
        f"the modes at {name} took {min(each):.1f} to {max(each):.1f} s an object when they were found; "
        "no setting's seconds count them"
        for name, each in sorted(took.items())
    )
