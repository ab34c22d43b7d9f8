"""A run, planned and rehearsed before anything moves."""

from dataclasses import dataclass, field
from functools import partial
from typing import Any

import numpy as np

from experiments.contact_localization.experiment import ContactMotion
from experiments.contact_localization.sites import Presses, Site, plan_sites
from harness.arrays import FloatArray
from harness.errors import WrongUse
from harness.mesh import Mesh
from harness.scene import SceneFile
from harness.sim.height_map import RasterMesh
from harness.station_file import Station
from harness.twin.bench import TwinBench
from harness.twin.motion import PlannedContact, plan_contact, reachable
from harness.twin.rehearsal import RehearsalReport, Segment, rehearse
from harness.twin.ways import connect

HOME = np.radians([0.0, -90.0, 60.0, -60.0, -90.0, 0.0])
"""rad: the gel above and behind the object, pointing down; where the first travel starts."""

_SPARE = 3
"""Times as many sites as contacts are drawn before the object is called out of reach."""


@dataclass(frozen=True, eq=False)
class RunPlan:
    """Every motion of a run.

    Attributes:
        bench: the twin it was rehearsed in.
        sites: where the gel is to go.
        contacts: how it gets there.
        rehearsal: what the twin found.
        seconds: by stage of the planning.
    """

    bench: TwinBench
    sites: tuple[Site, ...]
    contacts: tuple[PlannedContact, ...]
    rehearsal: RehearsalReport
    seconds: dict[str, float] = field(default_factory=dict)

    def parameters(self) -> list[dict[str, Any]]:
        """The steps, as JSON values."""
        return [
            ContactMotion.planned(contact, self.bench.flange_from_gel, site.press).to_parameters()
            for contact, site in zip(self.contacts, self.sites, strict=True)
        ]

    def segments(self) -> list[Segment]:
        """Every motion in order."""
        return [segment for k, contact in enumerate(self.contacts) for segment in contact.segments(k)]


def twin_of(scene: SceneFile, station: Station, mesh: Mesh) -> TwinBench:
    """The bench as the scene and the station state it."""
    safety = station.arm.safety
    return TwinBench(
        station.arm.model,
        station.flange_from_gel,
        station.gel.sensor,
        mesh,
        scene.base_from_object(mesh),
        table_height=scene.table.height,
        pedestal_radius=0.5 * scene.support.width,
        joint_range=np.array([safety.joint_low, safety.joint_high]),
    )


def plan_run(scene: SceneFile, station: Station, mesh: Mesh, seed: int) -> RunPlan:
    """Choose the sites, plan the ways, rehearse the whole.

    Args:
        scene: says how many contacts, how far apart, how deep.
        station: whose arm it is for.
        mesh: of the object, in metres.
        seed: of the choice of sites.

    Raises:
        WrongUse: too few places that the arm can reach.
        MotionRefused: the rehearsal found a motion that must not be made.
    """
    bench = twin_of(scene, station, mesh)
    wanted = scene.localization
    sites = plan_sites(
        RasterMesh(mesh),
        station.gel.sensor,
        bench.base_from_object,
        wanted.contacts * (_SPARE if wanted.spacing == "spread" else 1),
        wanted.spacing,
        seed,
        reachable=partial(reachable, bench),
        presses=Presses(wanted.step, wanted.tilt, wanted.depth),
    )
    chosen, contacts = _ways(bench, sites, wanted.contacts, seed)
    plan = RunPlan(bench, chosen, contacts, RehearsalReport(0, (), (), ()))
    rehearsal = rehearse(bench, plan.segments()).require()
    return RunPlan(bench, chosen, contacts, rehearsal)


def way_between(bench: TwinBench, start: FloatArray, end: FloatArray) -> FloatArray:
    """``(n, 6)`` rad from where the arm is to where a step begins, hitting nothing.

    Raises:
        WrongUse: there is no such way.
    """
    way = connect(bench, start, end)
    if way is None:
        raise WrongUse(
            "no way was found from where the arm is to the first contact; move it by hand to a place above "
            "the object, clear of the table, and start again"
        )
    return way


def _ways(
    bench: TwinBench, sites: tuple[Site, ...], count: int, seed: int
) -> tuple[tuple[Site, ...], tuple[PlannedContact, ...]]:
    chosen: list[Site] = []
    contacts: list[PlannedContact] = []
    joints = HOME
    for site in sites:
        planned = plan_contact(bench, site.base_from_gel, joints, seed=seed)
        if planned is not None and len(contacts) < count:
            chosen.append(site)
            contacts.append(planned)
            joints = planned.stand_off_joints
    if len(contacts) < count:
        raise WrongUse(
            f"the arm has a free way to only {len(contacts)} of {count} contacts; ask for fewer contacts, "
            "another seed, or another pose of the object"
        )
    return tuple(chosen), tuple(contacts)
