"""The contacts of a localization chosen one by one: each where it should tell most of where the object is."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, partial
from typing import Any

import numpy as np

from experiments.contact_localization.answer import ContactAnswering
from experiments.contact_localization.model import Prior
from experiments.contact_localization.posterior.estimate import Estimate
from experiments.contact_localization.posterior.hypotheses import Hypotheses
from experiments.contact_localization.posterior.posterior import thinned
from experiments.contact_localization.section import Localization
from experiments.contact_localization.settings import KNOBS
from harness.basics.arrays import FloatArray, read_only
from harness.basics.errors import FitRefused, MotionRefused, WrongUse
from harness.basics.faces.ray_mesh import RayMesh
from harness.basics.geometry import apply, inverse
from harness.experiment.levels import chosen_levels
from harness.recording.recording import Recording
from harness.recording.run_folder import RunFiles
from harness.skills.exploring.bayes_risk import bayes_risk_after
from harness.skills.exploring.lines import end_of
from harness.skills.planning import Itinerary
from harness.skills.press import ContactMotion
from harness.skills.sites import PressLimits, Site, candidate_sites
from harness.skills.strike import planner
from harness.twin.bench import TwinBench
from harness.twin.motion import StrikePlanner, reachable

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


class ContactChooser:
    """Chooses the contacts of a run after the first.

    Args:
        run: folder of the run.
        bench: twin of the bench, with the object at its nominal pose.
        say: reports the error that is expected after each contact.
    """

    def __init__(self, run: RunFiles, bench: TwinBench, say: Callable[[str], None]) -> None:
        self._run, self._bench, self._say = run, bench, say
        self._asked = run.scene.section(Localization)
        self._before: list[Mapping[str, Any]] = []
        self._estimated: Estimate | None = None

    @cached_property
    def _strikes(self) -> StrikePlanner | None:
        return planner(self._run.scene, self._run.station, self._bench)

    @cached_property
    def _answering(self) -> ContactAnswering:
        return ContactAnswering(self._run, chosen_levels(KNOBS, (), self._run.network_levels))

    @cached_property
    def _rays(self) -> RayMesh:
        return RayMesh(self._answering.model.mesh)

    def is_sure(self, recording: Recording, index: int) -> bool:
        """Return whether the contacts before ``index`` determine the place as well as the scene asks."""
        until = self._asked.until
        if until is None or index == 0:
            return False
        estimate = self._estimate(recording, index)
        return estimate is not None and estimate.credible90 <= until

    def _estimate(self, recording: Recording, index: int) -> Estimate | None:
        """Estimate from the contacts before ``index``; None if they determine nothing yet."""
        if len(self._before) == index:
            return self._estimated
        for k in range(len(self._before), index):
            record = recording.step(k)
            self._answering.read(record)
            self._before.append(record.step.parameters)
        try:
            self._estimated = self._answering.so_far()
        except (FitRefused, WrongUse):
            self._estimated = None
        return self._estimated

    def plan(self, recording: Recording, index: int) -> dict[str, Any]:
        """Return the parameters of the most informative contact that the arm can make.

        Raises:
            WrongUse: none of the places sampled can be touched on a collision-free path.
        """
        estimate = self._estimate(recording, index)
        touched = np.array([self._touched(parameters) for parameters in self._before])
        sites = self._candidates(touched, (recording.header.seed, index))
        left = self._errors_left(sites, estimate)
        # How far each is from all contacts so far, beside the farthest.
        points = np.array([site.point_in_object for site in sites])
        gaps = np.linalg.norm(points[:, None] - touched, axis=2).min(axis=1)
        for k in np.argsort(left * (1.0 - FARTHER * (gaps / gaps.max())), kind="stable"):
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


GEL = read_only(
    1.0e-3 * np.array([[0, 0], [6, 0], [-6, 0], [0, 5], [0, -5], [5, 4], [-5, 4], [5, -4], [-5, -4]], float)
)
"""``(9, 2)`` m along x and y of the gel: places of its face; the first that meets something stops it."""


BEFORE = 40.0e-3
"""M before a place from where on the gel's way to it is followed."""


BEYOND = 30.0e-3
"""M behind a place up to which it is followed; what is met later is not met."""


STOPPED, STOPPED_PER_METRE = 1.0e-3, 8.0e-3
"""M by which the place where the gel is stopped is off, and of that for each m from the first contact."""


SHAPED, DEEPEST = 0.57e-3, 2.5e-3
"""M by which heights under the gel are off, with how much they go together, and how deep a gel sees."""


MOST = 9.0
"""Half squares that two readings differ by at most."""


HYPOTHESES = 80
"""That stand for the posterior, at most."""


@dataclass(frozen=True, eq=False)
class BelievedGels:
    """Where the gel was at the first contact, by some hypotheses."""

    gels: FloatArray  #: ``(n, 3)`` m, its centre in the object's frame.
    object_from_base: FloatArray  #: ``(n, 3, 3)`` rotations.
    weights: FloatArray  #: ``(n,)`` summing to 1.
    first_in_base: FloatArray  #: ``(3,)`` m: where the arm says that it was; only what is added to it counts.


def believed_gels(hypotheses: Hypotheses, prior: Prior, first_in_base: FloatArray) -> BelievedGels:
    """Few hypotheses that stand for a posterior.

    Args:
        hypotheses: all of it.
        prior: of the object's orientation.
        first_in_base: ``(3,)`` m, the gel's centre at the first contact.
    """
    places = np.column_stack([hypotheses.gels, hypotheses.yaws])
    few, weights = thinned(places, hypotheses.weights, HYPOTHESES)
    return BelievedGels(few[:, :3], prior.object_from_base(few[:, 3]), weights, first_in_base)


def errors_left(rays: RayMesh, at: BelievedGels, places: Sequence[FloatArray]) -> FloatArray:
    """``(n,)`` m: the error that is expected of a contact at each place once it is made.

    However large: that a posterior over a whole side shrinks to half of it is worth something.

    Args:
        rays: to the object's surface.
        at: what is believed.
        places: ``(4, 4)`` ``base_from_gel`` each, were the object where it should be.
    """
    errors = []
    for place in places:
        read, points = readings_at(rays, at, place)
        apart = np.linalg.norm(points[:, None] - points, axis=2)
        errors.append(bayes_risk_after(read, at.weights, apart, MOST))
    return np.array(errors)


def readings_at(rays: RayMesh, at: BelievedGels, base_from_gel: FloatArray) -> tuple[FloatArray, FloatArray]:
    """What a press reads under each hypothesis, and which place it touches.

    Args:
        rays: to the object's surface.
        at: what is believed.
        base_from_gel: ``(4, 4)`` of the press.

    Returns:
        ``(n, 10)`` in deviations of a reading, where the gel is stopped and the heights under it, infinite
        where it meets nothing; ``(n, 3)`` m in the object's frame, the middle of the gel there.
    """
    moved = base_from_gel[:3, 3] - at.first_in_base
    turns = at.object_from_base @ base_from_gel[:3, :3]
    centres, axes = at.gels + at.object_from_base @ moved, turns[:, :, 2]
    starts = centres[:, None] + GEL @ np.swapaxes(turns[:, :, :2], 1, 2) - BEFORE * axes[:, None]
    ways = np.repeat(axes, len(GEL), axis=0)
    met = rays.first_hits(starts.reshape(-1, 3), ways).distance.reshape(len(centres), -1) - BEFORE
    met = np.where(met < BEYOND, met, np.inf)
    stopped = met.min(axis=1)
    along = np.where(np.isfinite(stopped), stopped, 0.0)[:, None]
    heights = np.minimum(met - along, DEEPEST)
    off = np.hypot(STOPPED, STOPPED_PER_METRE * np.linalg.norm(moved))
    read = np.column_stack([stopped / off, heights / SHAPED])
    return read, centres + along * axes
