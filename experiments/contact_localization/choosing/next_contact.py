"""The contacts of a localization chosen one by one: each where it should tell most of where the object is."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import cached_property, partial
from typing import Any

import numpy as np

from experiments.contact_localization.accuracy.dials import KNOBS
from experiments.contact_localization.answer import ContactAnswering
from experiments.contact_localization.choosing.telling import believed_gels, errors_left
from experiments.contact_localization.posterior.estimate import Estimate
from experiments.contact_localization.section import Localization
from harness.basics.arrays import FloatArray
from harness.basics.errors import FitRefused, MotionRefused, WrongUse
from harness.basics.faces.ray_mesh import RayMesh
from harness.basics.geometry import apply, inverse
from harness.bench.reading import Reading
from harness.bench.station import Bench
from harness.experiment.levels import chosen_levels
from harness.recording.recording import Recording
from harness.recording.run_folder import RunFiles
from harness.recording.step_file import Step
from harness.skills.exploring.surroundings import end_of
from harness.skills.planning import Itinerary
from harness.skills.press import ContactMotion, PressPerformer
from harness.skills.sites import PressLimits, Site, candidate_sites
from harness.skills.strike import planner
from harness.twin.bench import TwinBench
from harness.twin.motion import reachable
from harness.twin.strike_motion import StrikePlanner

CANDIDATES = 24
"""Places drawn for each contact; of those with a free way the one that leaves least error is taken."""

FARTHER = 0.3
"""Share of the expected error by which the farthest place from all contacts so far seems better: one contact
is looked ahead, and on a flat side no place near by tells much, while a walk that goes on comes to an edge.
Errors after three and five contacts of 32 development runs, beyond 20 mm alike: 2.7 and 1.5 mm with, 3.4 and
2.1 without (errors then capped), 4.1 and 2.2 by planned contacts."""

EXPECTED = "expected_error_m"
"""Of a step's parameters: the error that was expected to be left after it; not there where nothing told."""

PLACEHOLDER: Mapping[str, Any] = {"choose": "active"}
"""What ``run.json`` keeps of a contact that is planned once those before it are read."""


class ChosenContacts:
    """Performs contacts of which all but the first are planned between them.

    Args:
        run: the folder.
        bench: the twin, with the object where it should be.
        press: makes each contact.
        say: tells where a contact goes, and why no more are made.
    """

    def __init__(
        self, run: RunFiles, bench: TwinBench, press: PressPerformer, say: Callable[[str], None]
    ) -> None:
        self._run, self._bench, self._press, self._say = run, bench, press, say
        self._asked = run.scene.section(Localization)
        self._before: list[Mapping[str, Any]] = []

    @cached_property
    def _strikes(self) -> StrikePlanner | None:
        return planner(self._run.scene, self._run.station, self._bench)

    @cached_property
    def _answering(self) -> ContactAnswering:
        return ContactAnswering(self._run, chosen_levels(KNOBS, (), self._run.network_levels))

    @cached_property
    def _rays(self) -> RayMesh:
        return RayMesh(self._answering.model.mesh)

    def steps(self, recording: Recording) -> Iterator[Step]:
        """The contacts that are not yet on the disk; each is planned, and rehearsed, when it is asked for."""
        planned = recording.planned(self._press.plan_key)
        for index in range(recording.committed, len(planned)):
            if index == 0:
                yield Step(index, "press", planned[index])
                continue
            estimate = self._estimate(recording, index)
            if self._is_sure(estimate):
                self._say("the contact's place is known as well as was asked; no more contacts are made")
                return
            try:
                yield Step(index, "press", self._next(recording, index, estimate))
            except WrongUse as refusal:
                self._say(f"no more contacts are made than {index}: {refusal}")
                return

    def perform(self, step: Step, bench: Bench) -> Sequence[Reading]:
        """One contact."""
        return self._press.perform(step, bench)

    def _is_sure(self, estimate: Estimate | None) -> bool:
        until = self._asked.until
        return until is not None and estimate is not None and estimate.credible90 <= until

    def _estimate(self, recording: Recording, index: int) -> Estimate | None:
        """By the contacts before one; None where they say nothing yet."""
        for k in range(len(self._before), index):
            record = recording.step(k)
            self._answering.read(record)
            self._before.append(record.step.parameters)
        try:
            return self._answering.so_far()
        except (FitRefused, WrongUse):
            return None

    def _next(self, recording: Recording, index: int, estimate: Estimate | None) -> dict[str, Any]:
        """The parameters of the most telling contact that the arm can make.

        Raises:
            WrongUse: none of many places drawn can be touched on a free way.
        """
        touched = np.array([self._touched(parameters) for parameters in self._before])
        sites = self._candidates(touched, (recording.header.seed, index))
        left = self._errors_left(sites, estimate)
        for k in np.argsort(left * (1.0 - FARTHER * _far(sites, touched)), kind="stable"):
            planned = self._planned(sites[k], index)
            if planned is None:
                continue
            if estimate is None:
                return planned
            self._say(f"contact {index + 1}: {1e3 * left[k]:.1f} mm of error are expected after it")
            return {**planned, EXPECTED: float(left[k])}
        raise WrongUse(
            f"the arm has no free way to any of {len(sites)} places where the next contact may be; ask for "
            "fewer contacts, longer steps, or another pose of the object"
        )

    def _candidates(self, touched: FloatArray, seed: tuple[int, int]) -> tuple[Site, ...]:
        asked, bench = self._asked, self._bench
        return candidate_sites(
            self._answering.model.raster,
            self._run.station.gel.sensor,
            bench.base_from_object,
            CANDIDATES,
            asked.spacing,
            seed,
            list(touched),
            partial(reachable, bench),
            PressLimits(asked.step, asked.tilt, asked.depth),
        )

    def _touched(self, parameters: Mapping[str, Any]) -> FloatArray:
        """``(3,)`` m in the object, were it where it should be: where a contact was to begin."""
        motion = ContactMotion.from_parameters(parameters)
        gel = (motion.base_from_stand_off @ self._bench.flange_from_gel)[:3, 3] + motion.search * motion.axis
        return np.asarray(apply(inverse(self._bench.base_from_object), gel[None])[0])

    def _errors_left(self, sites: Sequence[Site], estimate: Estimate | None) -> FloatArray:
        """``(n,)`` m; all alike where nothing is known yet: their order is that of the draws."""
        if estimate is None:
            return np.zeros(len(sites))
        readings = self._answering.readings
        first = readings.observations[0].base_from_gel[:3, 3]
        at = believed_gels(estimate.hypotheses, readings.prior, first)
        return errors_left(self._rays, at, [site.base_from_gel for site in sites])

    def _planned(self, site: Site, index: int) -> dict[str, Any] | None:
        """The parameters of a contact there, rehearsed; None where there is no free way."""
        last = self._before[-1]
        itinerary = Itinerary(self._bench, index, self._strikes, 1, end_of(last.get("strike", last)))
        if not itinerary.visit(0, site.base_from_gel, patient=False):
            return None
        try:
            return itinerary.rehearsed((site,)).parameters()[0]
        except MotionRefused:
            return None


def _far(sites: Sequence[Site], touched: FloatArray) -> FloatArray:
    """``(n,)`` from 0 to 1: how far each is from all contacts so far, beside the farthest."""
    points = np.array([site.point_in_object for site in sites])
    gaps = np.linalg.norm(points[:, None] - touched, axis=2).min(axis=1)
    return np.asarray(gaps / gaps.max())
