"""A contact on an object of known shape as it is believed to stand: where it tells most of the size."""

from collections.abc import Sequence
from functools import partial
from typing import Any

import numpy as np

from experiments.scale_estimation.model import ObjectModel
from experiments.scale_estimation.section import Scale
from experiments.scale_estimation.touch.fit import DISTANCE_SIGMA, UNKNOWNS, TouchProblem
from experiments.scale_estimation.touch.patch import Patch
from harness.basics.arrays import FloatArray
from harness.basics.errors import WrongUse
from harness.sim.gel.height_map import RasterMesh
from harness.skills.exploring.surroundings import Surroundings, rehearsed_strike
from harness.skills.planning import Itinerary
from harness.skills.press import ContactMotion
from harness.skills.sites import PressLimits, Site, plan_sites
from harness.skills.strike import planner
from harness.twin.bench import TwinBench
from harness.twin.bench_of import twin_of
from harness.twin.motion import PlannedContact, reachable
from harness.twin.rehearsal import rehearse

CANDIDATES = 6
"""Places drawn on the object as it is believed to stand; the most telling with a free way is taken."""

BEYOND = (0.04, 0.02, 0.008)
"""M that a search may go on beyond where the object is believed to be; the first with a free way."""

_WEAK_SIGMAS = np.array([0.6, np.inf, np.inf, np.pi, *[np.inf] * (UNKNOWNS - 4)])


def contact_on_object(
    here: Surroundings,
    model: ObjectModel,
    patches: Sequence[Patch],
    stand: FloatArray,
    random: np.random.Generator,
    strikes: bool,
) -> dict[str, Any]:
    """The parameters of a contact at the most telling place that has a free way.

    Args:
        here: where the arm moves.
        model: of the object.
        patches: that are known.
        stand: ``(4,)`` as the object is believed to stand.
        random: what the places are drawn from.
        strikes: whether the place is to be struck too.

    Raises:
        WrongUse: none has.
        MotionRefused: the rehearsal refused it.
    """
    size = model.nominal * float(np.exp(stand[0]))
    mesh, scene = model.mesh_at(size), model.scene_at(size, stand[1], stand[2], stand[3])
    lines = twin_of(scene, here.station, mesh)
    asked = here.scene.section(Scale)
    sites = plan_sites(
        RasterMesh(mesh),
        here.station.gel.sensor,
        lines.base_from_object,
        CANDIDATES,
        "spread",
        int(random.integers(2**31)),
        reachable=partial(reachable, lines, travels=here.travels),
        presses=PressLimits(tilt=asked.tilt, depth=asked.depth),
    )
    strike_planner = planner(scene, here.station, lines, here.travels) if strikes else None
    for site in _most_telling(sites, model, patches, stand):
        itinerary = Itinerary(lines, 0, strike_planner, int(strikes), here.joints, here.travels)
        if itinerary.visit(0, site.base_from_gel, patient=False):
            return _rehearsed(itinerary, lines, here, site)
    raise WrongUse("none of the most telling places has a free way")


def _rehearsed(itinerary: Itinerary, lines: TwinBench, here: Surroundings, site: Site) -> dict[str, Any]:
    contact = itinerary.contacts[0]
    rehearse(here.travels, contact.travels(0)).require()
    rehearse(lines, contact.lines(0)).require()
    beyond = _overtravel(here.nothing, contact, site.base_from_gel[:3, 2])
    made = ContactMotion.planned(contact, lines.flange_from_gel, site.press, beyond).to_parameters()
    for strike in itinerary.strikes:
        made["strike"] = rehearsed_strike(strike, here.travels, lines).to_parameters()
    return made


def _overtravel(nothing: TwinBench, contact: PlannedContact, axis: FloatArray) -> float:
    """M that a search may go on beyond where the object is believed to be, nothing else being met."""
    for beyond in BEYOND:
        if not rehearse(nothing, [contact.searched(0, beyond, axis)]).refusals:
            return beyond
    return 0.0


def _most_telling(
    sites: Sequence[Site], model: ObjectModel, patches: Sequence[Patch], stand: FloatArray
) -> list[Site]:
    """The sites by the standard deviation of the size that a contact there would leave, least first."""
    problem = TouchProblem(model.stand, patches, 3)
    known = problem.information(np.append(stand, np.zeros(UNKNOWNS - len(stand))))
    known = known + np.diag(1.0 / _WEAK_SIGMAS**2)
    middle = model.place + np.array([stand[1], stand[2], 0.0])

    def left(site: Site) -> float:
        normal = -site.base_from_gel[:3, 2]
        arm = site.base_from_gel[:3, 3] - middle
        turning = arm[0] * normal[1] - arm[1] * normal[0]
        tilting = [arm[1] * normal[2] - arm[2] * normal[1], arm[2] * normal[0] - arm[0] * normal[2]]
        slope = np.array([arm @ normal, normal[0], normal[1], turning, normal[2], *tilting, 1.0])
        slope = slope / DISTANCE_SIGMA
        return float(np.linalg.inv(known + np.outer(slope, slope))[0, 0])

    return sorted(sites, key=left)
