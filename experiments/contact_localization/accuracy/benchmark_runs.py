"""Runs on the mocked bench, performed in process and kept in memory, to be answered at any setting."""

import gc
from collections.abc import Iterator, Mapping, MutableMapping, Sequence
from concurrent.futures import Executor, Future
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from experiments.contact_localization.accuracy.budget import Run
from experiments.contact_localization.accuracy.dials import SIMULATED, needs_images
from experiments.contact_localization.accuracy.solving import (
    Models,
    Readings,
    Setting,
    Solved,
    object_key,
    prepare,
    solve_loaded,
)
from experiments.contact_localization.accuracy.table_cell import (
    Cell,
    PerformedRun,
    believed,
    perform_cell,
    scene_of,
)
from experiments.contact_localization.build_model import model_of_scene
from experiments.contact_localization.observation import Observation
from experiments.contact_localization.posterior.baselines import mean_random_error
from harness.basics.arrays import FloatArray
from harness.basics.errors import TouchstoneError
from harness.basics.mesh import Mesh
from harness.bench.scene import SceneFile, scene_from_json
from harness.bench.station_file import Station
from harness.cost.curve import Sample
from harness.effects.scene_object import known_object
from harness.experiment.experiment import Say
from harness.recording.run_folder import station_calibration


@dataclass(frozen=True, eq=False)
class Case:
    """A performed run with its truth, to be answered at any setting."""

    cell: Cell
    run: Run
    true_points: FloatArray
    mesh: Mesh
    _read: dict[bool, Readings] = field(init=False, default_factory=dict, repr=False)
    _left: dict[int, float] = field(init=False, default_factory=dict, repr=False)

    @property
    def steps(self) -> int:
        """How many contacts were made."""
        return len(self.run.observations)

    def close(self) -> None:
        """Nothing: a case is in memory alone."""

    def readings(self, setting: Setting) -> Readings:
        """As a setting takes them; timed on their second reading, when kernels are loaded."""
        images = needs_images(setting)
        if images not in self._read:
            self.run.read(setting)
            self._read[images] = self.run.read(setting)
        return self._read[images].under(self.run.models.at(setting))

    def sample(self, setting: Setting, contacts: int) -> Sample:
        """One setting from the first contacts: the error of the last of them, and the seconds."""
        readings = self.readings(setting).first(contacts)
        prepare(readings.model, setting)
        with _uncollected():
            solved = solve_loaded(readings, setting)
        radius = None if solved.estimate is None else solved.estimate.credible90
        shared = readings.shared[0] if needs_images(setting) else 0.0
        error = self.error_of(solved, contacts)
        return Sample(
            self.cell.name,
            self.run.object,
            error,
            radius,
            shared,
            solved.cpu,
            solved.wall,
            self.places_left(contacts),
        )

    def places_left(self, contacts: int) -> float:
        """By the first contacts: how much there is to do."""
        if contacts not in self._left:
            run = replace(self.run, observations=self.run.observations[:contacts])
            self._left[contacts] = run.places_left({})
        return self._left[contacts]

    def error_of(self, solved: Solved, contacts: int) -> float:
        """m, of the last of the first contacts; a refused answer counts as a random one."""
        true = self.true_points[contacts - 1]
        if solved.estimate is None:
            return mean_random_error(self.mesh, true)
        return float(np.linalg.norm(solved.estimate.position_in_object - true))


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
    return _case(cell, _performed(cell, scene, station), scene, station, models)


_Recorded = tuple[tuple[Observation, ...], FloatArray, FloatArray]
"""The observations, ``base_from_object`` and the true points of a performed run."""


def _performed(cell: Cell, scene: SceneFile, station: Station) -> _Recorded:
    turned = scene_of(cell, scene)
    run = perform_cell(cell, turned, station, known_object(turned).mesh)
    return run.observations, run.base_from_object, run.true_points


def _elsewhere(cell: Cell, scene: dict[str, Any], station: Station) -> _Recorded:
    return _performed(cell, scene_from_json(scene, "the cost of accuracy"), station)


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
        name, Models(lambda accuracy: model_of_scene(turned, station, mesh, calibration, accuracy))
    )
    observations, base_from_object, true_points = recorded
    performed = PerformedRun(observations, own.at({}), base_from_object, true_points, cell.seed)
    asked = Run(observations, own, believed(performed, cell.yaw), cell.seed, name)
    return Case(cell, asked, true_points, mesh)


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
                dials = zip(SIMULATED, levels, strict=True)
                name = ", ".join(f"{knob.name} {level}" for knob, level in dials)
                took.setdefault(name, []).append(sum(model.modes.seconds.values()))
    return tuple(
        f"the modes at {name} took {min(each):.1f} to {max(each):.1f} s an object when they were found; "
        "no setting's seconds count them"
        for name, each in sorted(took.items())
    )
