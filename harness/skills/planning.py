"""A run, planned and rehearsed before anything moves."""

from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any, Literal

import numpy as np

from harness.basics.arrays import FloatArray
from harness.basics.mesh import Mesh
from harness.bench.scene import SceneFile
from harness.bench.station_file import Station
from harness.sim.gel.height_map import RasterMesh
from harness.skills.press import ContactMotion
from harness.skills.sites import PressLimits, Site, plan_sites
from harness.skills.strike import StrikeMotion, planner
from harness.twin.bench import TwinBench
from harness.twin.bench_of import twin_of
from harness.twin.motion import PlannedContact, PlannedStrike, StrikePlanner, plan_contact, reachable
from harness.twin.rehearsal import RehearsalReport, Segment, rehearse

HOME = np.radians([0.0, -90.0, 60.0, -60.0, -90.0, 0.0])
"""rad: the gel above and behind the object, pointing down; where the first travel starts."""

_IN_VAIN = 6
"""Searches for a way that may fail, each after seconds, before only the natural ways are tried."""


@dataclass(frozen=True, eq=False)
class RunPlan:
    """Every motion of a run."""

    bench: TwinBench  #: the twin it was rehearsed in.
    sites: tuple[Site, ...]  #: where the gel is to go.
    contacts: tuple[PlannedContact, ...]  #: how it gets there.
    strikes: tuple[PlannedStrike, ...]
    """how the hammer gets there after each of the first; empty where the arm makes none."""
    rehearsal: RehearsalReport  #: what the twin found.
    seconds: dict[str, float] = field(default_factory=dict)  #: by stage of the planning.

    def parameters(self) -> list[dict[str, Any]]:
        """The steps, as JSON values."""
        steps = [
            ContactMotion.planned(contact, self.bench.flange_from_gel, site.press).to_parameters()
            for contact, site in zip(self.contacts, self.sites, strict=True)
        ]
        for step, strike in zip(steps, self.strikes, strict=False):
            step["strike"] = StrikeMotion.planned(strike).to_parameters()
        return steps

    def segments(self) -> list[Segment]:
        """Every motion in order."""
        motions: list[Segment] = []
        for k, contact in enumerate(self.contacts):
            motions += contact.segments(k)
            motions += self.strikes[k].segments(k) if k < len(self.strikes) else ()
        return motions


@dataclass(frozen=True)
class ContactRequest:
    """The contacts that an experiment asks for."""

    contacts: int  #: how many.
    spacing: Literal["close", "spread"]
    """``"close"``, each within ``presses.step`` of the last; ``"spread"``, over the object."""
    presses: PressLimits  #: how far apart, how tilted, how deep.
    strikes: int | None = None
    """how many of the first places are struck too, where the scene is heard; None for all."""


def plan_run(scene: SceneFile, station: Station, mesh: Mesh, seed: int, wanted: ContactRequest) -> RunPlan:
    """Choose the sites, plan the ways, rehearse the whole.

    Args:
        scene: says where the object stands, and whether places are struck too.
        station: whose arm it is for.
        mesh: of the object, in metres.
        seed: of the choice of sites.
        wanted: how many contacts, how far apart, how deep.

    Raises:
        WrongUse: too few places that the arm can reach on a free way.
        MotionRefused: the rehearsal found a motion that must not be made.
    """
    bench = twin_of(scene, station, mesh)
    struck = wanted.contacts if wanted.strikes is None else wanted.strikes
    itinerary = Itinerary(bench, seed, planner(scene, station, bench), struck)
    sites = plan_sites(
        RasterMesh(mesh),
        station.gel.sensor,
        bench.base_from_object,
        wanted.contacts,
        wanted.spacing,
        seed,
        reachable=partial(reachable, bench),
        presses=wanted.presses,
        visit=itinerary.visit,
    )
    return itinerary.rehearsed(sites)


class Itinerary:
    """How the arm goes from site to site, made as the sites are chosen.

    Args:
        bench: the twin.
        seed: of the searches for ways.
        planner: of the strikes; None where the arm makes none.
        struck: how many of the first places are struck.
        start: ``(6,)`` rad, where the arm is before the first.
        travels: the twin that is travelled in, where it is another; see ``plan_contact``.
    """

    def __init__(
        self,
        bench: TwinBench,
        seed: int,
        planner: StrikePlanner | None = None,
        struck: int = 0,
        start: FloatArray = HOME,
        travels: TwinBench | None = None,
    ) -> None:
        self._start, self._travels = start, travels
        self.contacts: list[PlannedContact] = []
        self.strikes: list[PlannedStrike] = []
        self._bench = bench
        self._seed = seed
        self._planner = planner
        self._struck = struck
        self._in_vain = 0

    def visit(self, before: int, base_from_gel: FloatArray, patient: bool) -> bool:
        """Go on to there after the first ``before`` contacts, giving up the others; False where no way is."""
        del self.contacts[before:], self.strikes[before:]
        patient = patient and self._in_vain < _IN_VAIN
        if not self._visit(base_from_gel, 1 if patient else 0):
            self._in_vain += patient
            return False
        return True

    def rehearsed(self, sites: tuple[Site, ...]) -> RunPlan:
        """Its motions to all of these sites, each visited, gone through in the twin.

        Raises:
            MotionRefused: the rehearsal found a motion that must not be made.
        """
        contacts, strikes = tuple(self.contacts), tuple(self.strikes)
        plan = RunPlan(self._bench, sites, contacts, strikes, RehearsalReport(0, (), (), ()))
        return replace(plan, rehearsal=rehearse(self._bench, plan.segments()).require())

    def _visit(self, base_from_gel: FloatArray, searched: int) -> bool:
        contact = plan_contact(
            self._bench,
            base_from_gel,
            self._joints,
            seed=self._seed,
            searched=searched,
            travels=self._travels,
        )
        if contact is None:
            return False
        if self._planner is not None and len(self.contacts) < self._struck:
            strike = self._planner.plan(base_from_gel, contact.stand_off_joints, self._seed, searched)
            if strike is None:
                return False
            self.strikes.append(strike)
        self.contacts.append(contact)
        return True

    @property
    def _joints(self) -> FloatArray:
        if not self.contacts:
            return self._start
        struck = len(self.strikes) == len(self.contacts)
        return self.strikes[-1].stand_off_joints if struck else self.contacts[-1].stand_off_joints
