"""Plan the steps of a run: a camera image, then presses chosen one by one or planned on the CAD model."""

import math
from collections.abc import Iterator
from dataclasses import replace
from functools import cached_property, partial
from typing import Any
from weakref import WeakKeyDictionary

import numpy as np

from experiments.shape_reconstruction.answer import ShapeReadings
from experiments.shape_reconstruction.evidence import ShapeEvidence
from experiments.shape_reconstruction.explore.choosing import CHOOSERS, aims_at_mask, lines_at_surface
from experiments.shape_reconstruction.family.search import CONTINUED
from experiments.shape_reconstruction.fits import ShapeEstimate
from experiments.shape_reconstruction.methods import QUICK, continued, estimated
from experiments.shape_reconstruction.section import Choice, ShapeRun
from harness.basics.arrays import FloatArray
from harness.basics.errors import DataRefused, FitRefused, WrongUse
from harness.basics.geometry import translation
from harness.basics.mesh import Mesh
from harness.bench.scene import SceneFile
from harness.bench.station_file import Station
from harness.experiment.experiment import ErrorBound, Helpers, Planned
from harness.picture.camera_errors import CameraErrors
from harness.picture.outline import SeenOutline, read_outline
from harness.recording.recording import Recording
from harness.recording.run_folder import RunFiles
from harness.skills.exploring.exploration import Exploration, kinds, press_into_unknown
from harness.skills.exploring.lines import LINES, Surroundings, contact_along, end_of, lines_to, nowhere
from harness.skills.exploring.unknown_space import (
    SeenThing,
    UnknownStand,
    aims_unseen,
    seen_thing,
    unknown_space,
)
from harness.skills.planning import HOME, ContactRequest, plan_run
from harness.skills.sites import PressLimits
from harness.twin.bench import TwinBench
from harness.twin.bench_of import twin_of, way_between
from harness.twin.rehearsal import rehearse

INFORMATIVE = "family, continued"
"""While the arm waits for a press that goes by which shapes are likely."""


class RunningShape:
    """The estimates of a run after each press.

    With ``INFORMATIVE`` each search starts at the hypotheses of the previous estimate and at a few random
    shapes, from the first press on, so that a resumed or replayed run repeats its presses. After a
    poor fit the hypotheses may all have a wrong form, and the search also starts from scratch.

    Args:
        method: ``INFORMATIVE``, or a key of ``METHODS``, whose estimates are independent.
    """

    def __init__(self, method: str) -> None:
        self._method = method
        self._estimates: dict[int, ShapeEstimate | None] = {}  # by the number of presses

    def after(self, evidence: ShapeEvidence) -> ShapeEstimate | None:
        """Return the cached estimate from all presses of some evidence; None if they are too few.

        Args:
            evidence: readings of the run up to a press.
        """
        presses = len(evidence.touches)
        for count in range(0 if self._method == INFORMATIVE else presses, presses + 1):
            if count not in self._estimates:
                part = replace(evidence, touches=evidence.touches[:count])
                self._estimates[count] = self._solve(part, self._estimates.get(count - 1))
        return self._estimates[presses]

    def _solve(self, evidence: ShapeEvidence, previous: ShapeEstimate | None) -> ShapeEstimate | None:
        try:
            if self._method != INFORMATIVE:
                return estimated(self._method, evidence)
            return continued(evidence, replace(CONTINUED, seed=len(evidence.touches)), previous)
        except FitRefused:
            return None


_OF_RUNS: WeakKeyDictionary[RunFiles, dict[str, RunningShape]] = WeakKeyDictionary()


def get_running_shape(run: RunFiles, method: str) -> RunningShape:
    """Return the estimates of a run, which its explorer and its report share."""
    return _OF_RUNS.setdefault(run, {}).setdefault(method, RunningShape(method))


MOST = 4
"""Presses up to which each has an estimate of its own; of more, those at powers of two and the last."""


def steps_of(scene: SceneFile) -> int:
    """How many steps a run of a scene has, if it is not surer before."""
    return int(scene.sensors.camera) + _presses(scene)


def _presses(scene: SceneFile) -> int:
    return scene.section(ShapeRun).presses if scene.sensors.touch else 0


def smallest_error(scene: SceneFile, _mesh: Mesh) -> ErrorBound:
    """Return the mean deviation that all readings would leave if they measured one and the same point."""
    section, count = scene.section(ShapeRun), steps_of(scene)
    readings = f"{_presses(scene)} presses" + (" and a picture" if scene.sensors.camera else "")
    return ErrorBound(
        section.contact_error / math.sqrt(max(count, 1)),
        f"the mean deviation that {readings} leave where each contact is known to "
        f"{1e3 * section.contact_error:g} mm",
        "or take more presses with --presses",
    )


def plan(scene: SceneFile, station: Station, mesh: Mesh, seed: int) -> Planned:
    """A look where there is a camera, then so many presses.

    Those planned on the drawing are rehearsed here; all others are planned and rehearsed one by one, once
    those before are read.

    Raises:
        WrongUse: nothing is to be read; the scene names networks or meshes that only a table uses; or it
            states the origin of the mesh file, which does not determine where an unknown object touches its
            support.
    """
    if steps_of(scene) == 0:
        raise WrongUse("nothing is to be read: ask for vision, for presses, or for both")
    if scene.object.pose.anchor != "bottom":
        raise WrongUse(
            'an unknown object stands where its bottom is: set object.pose.anchor = "bottom", and its '
            "position to where its middle should be on the support"
        )
    for key in ("library", "pcn"):
        if getattr(scene.section(ShapeRun), key) is not None:
            raise WrongUse(
                f"[shape] {key} is for rows of a table and is not used by a run; leave it out of the scene, "
                f"or measure with: touchstone tables shape-reconstruction --set {key}=FOLDER"
            )
    settings, looks = scene.section(ShapeRun), scene.sensors.camera
    if settings.choose != "planned" or _presses(scene) == 0:
        place = np.array(scene.object.pose.position)
        bench = twin_of(scene, station, nowhere(place), np.eye(4))
        return Planned(kinds(looks, _presses(scene)), rehearse(bench, []), bench, on_the_way=_presses(scene))
    wanted = ContactRequest(_presses(scene), "spread", PressLimits(tilt=settings.tilt, depth=settings.depth))
    made = plan_run(scene, station, mesh, seed, wanted)
    presses = [{"kind": "contact", **parameters} for parameters in made.parameters()]
    return Planned([*kinds(looks, 0), *presses], made.rehearsal, made.bench)


def performer(run: RunFiles, helpers: Helpers) -> Exploration:
    """Looks, then presses.

    Args:
        run: the folder.
        helpers: what a step may use beside the bench.
    """
    choose, enough = run.scene.section(ShapeRun).choose, "the shape is known as well as was asked"
    explorer = None if choose == "planned" else ShapeExplorer(run, live_method(choose))
    way = partial(way_between, helpers.twin) if explorer is None else explorer.way
    press = press_into_unknown(way, helpers.ask)
    return Exploration(explorer, press, helpers.ask, helpers.say, enough)


DRAWN = 160
"""Places drawn on the estimate's surface; of their lines the best ``LINES`` are tried."""

UP_TO = 0.06
"""M above the support, up to which lines end where nothing was seen."""


class ShapeExplorer:
    """Plans a run's presses one at a time."""

    def __init__(self, run: RunFiles, method: str) -> None:
        self._run, self._shape = run, get_running_shape(run, method)
        self._settings = run.scene.section(ShapeRun)
        self._readings = ShapeReadings(run)
        self._read = 0
        self._joints: FloatArray = HOME

    @cached_property
    def place(self) -> FloatArray:
        """``(3,)`` m in base: the frame ``stand``."""
        return np.array(self._run.scene.object.pose.position)

    @cached_property
    def stand(self) -> UnknownStand:
        """Where the object was put, and what looks at it."""
        settings = self._settings
        errors = CameraErrors(
            position=settings.camera_position_error,
            rotation=settings.camera_rotation_error,
            focal_length=settings.focal_length_error,
            support=settings.support_error,
            tilt=self._run.station.errors.tilt,
            place=settings.place_error,
        )
        return UnknownStand(self.place, errors, self._run.station.camera)

    @cached_property
    def outline(self) -> SeenOutline | None:
        """Of the silhouette; None where the object was not seen, or not whole. Read once all looks are."""
        look = self._readings.look
        try:
            return None if look is None else read_outline(look.mask, look.hidden)
        except DataRefused:
            return None

    @cached_property
    def thing(self) -> SeenThing | None:
        """Where the object is by the look; None where it was not seen."""
        return None if self.outline is None else seen_thing(self.stand, self.outline)

    @cached_property
    def travels(self) -> TwinBench:
        """The bench with all the space that the object may take in its place."""
        return self._twin(unknown_space(self.stand, self.outline, self._settings.largest))

    @cached_property
    def _nothing(self) -> TwinBench:
        return self._twin(nowhere(self.place), has_object=False)

    def _twin(self, mesh_in_base: Mesh, has_object: bool = True) -> TwinBench:
        return twin_of(self._run.scene, self._run.station, mesh_in_base, np.eye(4), has_object)

    def way(self, here: FloatArray, planned: FloatArray) -> FloatArray:
        """A way around all that the object may take, from where the arm is to the end of a travel."""
        return way_between(self.travels, here, planned)

    def is_sure(self, recording: Recording, index: int) -> bool:
        """Whether the steps before one tell the shape as well as the scene asks."""
        until = self._settings.until
        if until is None or index == 0:
            return False
        self._take_in(recording, index)
        found = self._shape.after(self._readings.evidence())
        return found is not None and not found.not_bounded and bool(found.deviation.mean() <= until)

    def plan(self, recording: Recording, index: int) -> dict[str, Any]:
        """The parameters of a press along the best of some lines that has a free way.

        Raises:
            WrongUse: no free way was found along any of them; nothing was moved.
        """
        self._take_in(recording, index)
        random = np.random.default_rng((recording.header.seed, index))
        evidence = self._readings.evidence()
        here = Surroundings(self._run.scene, self._run.station, self.travels, self._nothing, self._joints)
        estimate = None if self._settings.choose == "random" else self._shape.after(evidence)
        towards = np.zeros((0, 4, 4))
        if estimate is not None:
            towards = lines_at_surface(estimate, self._run.station.gel.sensor, DRAWN, random)
        lines = np.concatenate([towards, self._blind(here, random)])
        scores = CHOOSERS[self._settings.choose](evidence, estimate, lines)
        best = np.argsort(-scores, kind="stable")[:LINES]
        return contact_along(
            here, translation(self.place) @ lines[best], float(random.uniform(*self._settings.depth))
        )

    def _take_in(self, recording: Recording, index: int) -> None:
        for k in range(self._read, index):
            record = recording.step(k)
            self._readings.read(record)
            if record.step.kind == "press":
                self._joints = end_of(record.step.parameters)
        self._read = index

    def _blind(self, here: Surroundings, random: np.random.Generator) -> FloatArray:
        """``(n, 4, 4)`` in ``stand``: to what was seen, or to where the object should be."""
        look, thing = self._readings.look, self.thing
        if look is not None and thing is not None:
            aims = aims_at_mask(look, thing, self.place, LINES, random)
        else:
            first = not self._readings.touches
            aims = aims_unseen(self.place, self._settings.place_error, UP_TO, first, random)
        lines = lines_to(aims, here, float(self.place[2]), random)
        return np.asarray(translation(-self.place) @ np.array(list(lines)))


def live_method(choose: Choice) -> str:
    """By which method the shape is estimated while the arm waits for its next press."""
    return INFORMATIVE if choose == "active" else QUICK


def live_estimates(
    evidence: ShapeEvidence, running: RunningShape, last: ShapeEstimate | None = None
) -> Iterator[tuple[ShapeEvidence, ShapeEstimate | None]]:
    """Yield the readings up to some presses of a run, and their estimate; None if they are too few.

    Args:
        evidence: readings of the whole run.
        running: the estimates so far; missing ones are solved.
        last: the estimate from all presses, if the same method has computed it.
    """
    for count in counts_shown(len(evidence.touches)):
        part = replace(evidence, touches=evidence.touches[:count])
        is_last = count == len(evidence.touches) and last is not None
        yield part, last if is_last else running.after(part)


def counts_shown(presses: int) -> list[int]:
    """After which of so many presses."""
    if presses <= MOST:
        return list(range(1, presses + 1))
    powers = [2**k for k in range(presses.bit_length()) if 2**k < presses]
    return [*powers, presses]
