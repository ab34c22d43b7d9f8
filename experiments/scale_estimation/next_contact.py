"""Where the next contact of a scale estimation goes: where it tells most of the size, on a free way.

The arm travels around all the space that the object may take, and enters it on straight lines only, slowly,
stopping at a touch. Lines are chosen on the object as it is believed to stand; where nothing is known yet
they lead to the middle of where it should be.
"""

from collections.abc import Iterator, Sequence
from contextlib import suppress
from functools import partial
from typing import Any

import numpy as np

from experiments.scale_estimation.answer import ScaleAnswering
from experiments.scale_estimation.dials import KNOBS
from experiments.scale_estimation.envelope import blind_envelope, seen_envelope
from experiments.scale_estimation.model import ObjectModel
from experiments.scale_estimation.section import Scale
from experiments.scale_estimation.touch.fit import DISTANCE_SIGMA, UNKNOWNS, FreeSpace, TouchProblem
from experiments.scale_estimation.touch.touch import by_touch
from experiments.scale_estimation.vision.vision import SeenStand
from harness.basics.arrays import FloatArray
from harness.basics.errors import FitRefused, MotionRefused, WrongUse
from harness.basics.geometry import frame_facing, transform
from harness.effects.accuracy import Accuracy
from harness.recording.recording import Recording
from harness.recording.run_folder import RunFiles
from harness.sim.gel.height_map import RasterMesh
from harness.skills.planning import HOME, Itinerary
from harness.skills.press import ContactMotion
from harness.skills.sites import PressLimits, Site, plan_sites
from harness.skills.strike import POSE, StrikeMotion, planner
from harness.twin.bench import TwinBench
from harness.twin.bench_of import twin_of, way_between
from harness.twin.motion import PlannedContact, plan_contact, reachable
from harness.twin.rehearsal import rehearse

CANDIDATES = 6
"""Places drawn on the object as it is believed to stand; the most telling with a free way is taken."""

BELIEVED_AFTER = 2
"""Contacts without a look after which the object is believed to stand where they say."""

BEYOND = (0.04, 0.02, 0.008)
"""M that a search may go on beyond where the object is believed to be; the first with a free way."""

ALONG_SIGHT = (0.0, 1.0, -1.0, 2.0, -2.0)
"""Standard deviations of its place along the line of sight at which a seen object is thought of."""

SURE_OF_SIZE = 0.1
"""Of the size's logarithm: where contacts fit a seen object farther off than that, it is by chance."""

STRUCK_AFTER = 2
"""Contacts that met the object before the first strike: a tip then meets it where it is believed to be."""

SLANTS = (0.0, 0.0, 0.45, 0.9, 1.3)
"""Rad from straight down, of lines into the unknown: a flat thing is met from above alone."""

_RAYS = 40
_WEAK_SIGMAS = np.array([0.6, np.inf, np.inf, np.pi, *[np.inf] * (UNKNOWNS - 4)])


class Explorer:
    """Plans a run's contacts one at a time.

    Args:
        run: the folder.
    """

    def __init__(self, run: RunFiles) -> None:
        self._run = run
        self._answering = ScaleAnswering(run, Accuracy.default(KNOBS))
        self._model: ObjectModel = self._answering.model
        self._read = 0
        self._joints: FloatArray = HOME
        self._struck = 0
        self._touches = 0
        self._travels: TwinBench | None = None
        self._nothing: TwinBench | None = None
        self._seen: tuple[SeenStand, ...] = ()

    def way(self, here: FloatArray, planned: FloatArray) -> FloatArray:
        """A way around all that the object may take, from where the arm is to the end of a travel."""
        assert self._travels is not None
        return way_between(self._travels, here, planned)

    def is_sure(self, recording: Recording, index: int) -> bool:
        """Whether the steps before one tell the size as well as the scene asks."""
        until = self._run.scene.section(Scale).until
        if until is None or index == 0:
            return False
        self._take_in(recording, index)
        low, high = self._answering.answer().fused.interval
        return bool(0.5 * (high - low) <= until)

    def plan(self, recording: Recording, index: int) -> dict[str, Any]:
        """The parameters of a contact.

        Args:
            recording: that holds all steps before it.
            index: of its step.

        Raises:
            WrongUse: no free way was found to any place.
            MotionRefused: the rehearsal refused it; nothing was moved.
        """
        self._take_in(recording, index)
        travels = self._travels_around()
        random = np.random.default_rng((recording.header.seed, index))
        stand = self._believed()
        if stand is not None:
            with suppress(WrongUse, MotionRefused):
                return self._on_object(travels, stand, random)
        return self._blind(travels, random)

    def _take_in(self, recording: Recording, index: int) -> None:
        for k in range(self._read, index):
            record = recording.step(k)
            self._answering.read(record)
            if record.step.kind == "press":
                self._touches += 1
                struck = POSE in record.readings
                self._joints = _end_of(record.step.parameters, struck)
                self._struck += struck
        self._read = index
        if not self._seen and self._answering.outline is not None:
            self._seen = self._answering.stands_seen()

    def _travels_around(self) -> TwinBench:
        if self._travels is None:
            model = self._model
            around = seen_envelope(model, self._seen) if self._seen else blind_envelope(model)
            self._travels = model.twin_around(around)
        return self._travels

    def _without_object(self) -> TwinBench:
        if self._nothing is None:
            self._nothing = self._model.twin_around(self._model.nowhere, has_object=False)
        return self._nothing

    def _believed(self) -> FloatArray | None:
        """``(4,)`` of the hypothesis that fits all contacts best; None where there is none yet."""
        if self._seen:
            return self._believed_of_seen()
        model, patches = self._model, self._answering.patches
        if len(patches) < BELIEVED_AFTER:
            return None
        try:
            found = by_touch(model.stand, patches, model.nominal, model.sizes, free=self._answering.free)
        except FitRefused:
            return None
        return np.asarray(found.unknowns[:4])

    def _believed_of_seen(self) -> FloatArray:
        """Of every turn that was seen, and places along the line of sight: what the contacts fit best."""
        model, patches = self._model, self._answering.patches
        away = np.array(ALONG_SIGHT)
        starts = np.zeros((len(self._seen) * len(away), UNKNOWNS))
        for row, (stand, far) in enumerate((stand, far) for stand in self._seen for far in away):
            starts[row, :4] = stand.unknowns
            starts[row, 1:3] += far * stand.farthest
        costs = 0.5 * np.tile(away, len(self._seen)) ** 2
        problem = TouchProblem(model.stand, patches, len(patches[0].points) if patches else 1)
        found = starts
        if patches:
            found, misfits = problem.refined(starts, 8, fixed_size=False)
            costs = costs + misfits
        best = int((costs + FreeSpace(model.stand, self._answering.free).cost(found)).argmin())
        # A few contacts can be fitted by another size: what was seen of it holds.
        kept = found if abs(found[best, 0] - starts[best, 0]) < SURE_OF_SIZE else starts
        return np.asarray(kept[best, :4])

    def _on_object(
        self, travels: TwinBench, stand: FloatArray, random: np.random.Generator
    ) -> dict[str, Any]:
        """The most telling place that has a free way.

        Raises:
            WrongUse: none has.
        """
        model, asked = self._model, self._run.scene.section(Scale)
        size = model.nominal * float(np.exp(stand[0]))
        mesh, scene = model.mesh_at(size), model.scene_at(size, stand[1], stand[2], stand[3])
        lines = twin_of(scene, self._run.station, mesh)
        limits = PressLimits(tilt=asked.tilt, depth=asked.depth)
        sites = plan_sites(
            RasterMesh(mesh),
            self._run.station.gel.sensor,
            lines.base_from_object,
            CANDIDATES,
            "spread",
            int(random.integers(2**31)),
            reachable=partial(reachable, lines, travels=travels),
            presses=limits,
        )
        strikes = self._strikes_left() > 0
        strike_planner = planner(scene, self._run.station, lines, travels) if strikes else None
        for site in self._most_telling(sites, stand):
            itinerary = Itinerary(lines, 0, strike_planner, int(strikes), self._joints, travels)
            if itinerary.visit(0, site.base_from_gel, patient=False):
                return self._rehearsed(itinerary, lines, travels, site)
        raise WrongUse("none of the most telling places has a free way")

    def _strikes_left(self) -> int:
        if not self._run.scene.sensors.sound or len(self._answering.patches) < STRUCK_AFTER:
            return 0
        return self._run.scene.section(Scale).strikes - self._struck

    def _rehearsed(
        self, itinerary: Itinerary, lines: TwinBench, travels: TwinBench, site: Site
    ) -> dict[str, Any]:
        contact, strikes = itinerary.contacts[0], itinerary.strikes
        rehearse(travels, contact.travels(0)).require()
        rehearse(lines, contact.lines(0)).require()
        beyond = self._overtravel(contact, site.base_from_gel[:3, 2])
        motion = ContactMotion.planned(contact, lines.flange_from_gel, site.press, beyond)
        made = motion.to_parameters()
        for strike in strikes:
            rehearse(travels, strike.travels(0)).require()
            rehearse(lines, strike.lines(0)).require()
            made["strike"] = StrikeMotion.planned(strike).to_parameters()
        return made

    def _overtravel(self, contact: PlannedContact, axis: FloatArray) -> float:
        """M that a search may go on beyond where the object is believed to be, nothing else being met."""
        for beyond in BEYOND:
            if not rehearse(self._without_object(), [contact.searched(0, beyond, axis)]).refusals:
                return beyond
        return 0.0

    def _most_telling(self, sites: Sequence[Site], stand: FloatArray) -> list[Site]:
        """The sites by the standard deviation of the size that a contact there would leave, least first."""
        problem = TouchProblem(self._model.stand, self._answering.patches, 3)
        known = problem.information(np.append(stand, np.zeros(UNKNOWNS - len(stand))))
        known = known + np.diag(1.0 / _WEAK_SIGMAS**2)
        middle = self._model.place + np.array([stand[1], stand[2], 0.0])

        def left(site: Site) -> float:
            normal = -site.base_from_gel[:3, 2]
            arm = site.base_from_gel[:3, 3] - middle
            turning = arm[0] * normal[1] - arm[1] * normal[0]
            tilting = [arm[1] * normal[2] - arm[2] * normal[1], arm[2] * normal[0] - arm[0] * normal[2]]
            slope = np.array([arm @ normal, normal[0], normal[1], turning, normal[2], *tilting, 1.0])
            slope = slope / DISTANCE_SIGMA
            return float(np.linalg.inv(known + np.outer(slope, slope))[0, 0])

        return sorted(sites, key=left)

    def _blind(self, travels: TwinBench, random: np.random.Generator) -> dict[str, Any]:
        """A line to the middle of where the object should be."""
        model = self._model
        lines = self._without_object()
        for base_from_gel in self._rays(random):
            contact = plan_contact(lines, base_from_gel, self._joints, searched=1, travels=travels)
            if contact is None:
                continue
            try:
                rehearse(travels, contact.travels(0)).require()
                rehearse(lines, contact.lines(0, press=False)).require()
            except MotionRefused:
                continue
            press = float(np.mean(self._run.scene.section(Scale).depth))
            return ContactMotion.planned(contact, lines.flange_from_gel, press, 0.0).to_parameters()
        raise WrongUse(
            f"no free way was found on any of {_RAYS} lines to the middle of where the object should be, "
            f"around one of up to {1e2 * model.sizes.high:.0f} cm; give a smaller range, or another place"
        )

    def _rays(self, random: np.random.Generator) -> Iterator[FloatArray]:
        """``(4, 4)`` where the gel would end were nothing there; from above first."""
        model = self._model
        half = 0.5 * max(self._run.station.gel.sensor.housing)
        height = float(model.stand.points[:, 2].max()) * model.sizes.low / model.nominal
        centre = (
            model.place if not self._seen else model.place + np.array([*self._seen[0].unknowns[1:3], 0.0])
        )
        for k in range(_RAYS):
            slant = 0.0 if k == 0 and self._touches == 0 else random.choice(SLANTS)
            way = random.uniform(-np.pi, np.pi)
            inward = -np.array([np.sin(slant) * np.cos(way), np.sin(slant) * np.sin(way), np.cos(slant)])
            low = 6.0e-3 + half * np.sin(slant)
            aside = random.normal(0.0, model.place_error, 2) if k or self._touches else np.zeros(2)
            end = centre + np.array([*aside, max(low, random.uniform(0.0, 0.8) * height)])
            yield transform(frame_facing(inward, random.uniform(0.0, 2.0 * np.pi)), end)


def _end_of(parameters: Any, struck: bool) -> FloatArray:
    """``(6,)`` rad: where a contact leaves the arm."""
    last = parameters["strike"] if struck and "strike" in parameters else parameters
    travel = np.asarray(last["travel_rad"], dtype=np.float64).reshape(-1, 6)
    return travel[-1] if len(travel) else np.asarray(last["start_rad"], dtype=np.float64)
