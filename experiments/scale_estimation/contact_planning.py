"""Plan one contact with an object of known shape, or a strike where a contact has met it.

With an estimated pose, the contact goes to the site that leaves the least uncertainty of the size. A flat
object that was not seen is approached from above, at every pose that the readings allow. Travels keep out of
the space that the object may take.
"""

from collections.abc import Sequence
from functools import partial
from itertools import product
from typing import Any

import numpy as np
from scipy.spatial import cKDTree

from experiments.scale_estimation.model import ObjectModel
from experiments.scale_estimation.section import Scale
from experiments.scale_estimation.touch.fit import DISTANCE_SIGMA, UNKNOWNS, FreeSpace, Patch, TouchProblem
from experiments.scale_estimation.vision.vision import SeenStand
from harness.basics.arrays import BoolArray, FloatArray
from harness.basics.errors import MotionRefused, WrongUse
from harness.basics.geometry import apply, transform
from harness.basics.mesh import Mesh, closed_hull, hull_of
from harness.sim.gel.height_map import RasterMesh
from harness.skills.exploring.lines import LINES, LOWEST, LineTarget, Surroundings, rehearsed_strike
from harness.skills.exploring.unknown_space import PLACES, around, margin_of
from harness.skills.planning import Itinerary
from harness.skills.press import ContactMotion
from harness.skills.sites import PressLimits, Site, plan_sites
from harness.skills.strike import StrikeMotion, planner
from harness.twin.bench import TwinBench
from harness.twin.bench_of import twin_of
from harness.twin.motion import reachable
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
    """Rehearse a contact and its strikes; the parameters of the step."""
    contact, axis = itinerary.contacts[0], site.base_from_gel[:3, 2]
    rehearse(here.travels, contact.travels(0)).require()
    rehearse(lines, contact.lines(0)).require()
    free = (by for by in BEYOND if not rehearse(here.nothing, [contact.searched(0, by, axis)]).refusals)
    made = ContactMotion.planned(contact, lines.flange_from_gel, site.press, next(free, 0.0)).to_parameters()
    for strike in itinerary.strikes:
        made["strike"] = rehearsed_strike(strike, here.travels, lines).to_parameters()
    return made


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


STANDS = 200
"""Sizes, places and turns that are drawn; of them those are likely that the readings so far leave."""

FLATTEST = 2.5e-3
"""M above the support where a line to the flattest object ends: with the support's height known to 1 mm the
gel stops above it."""

_ABOVE_END = 1.0e-3
"""M by which a place must be higher than a line from above ends, for the line to meet it."""

_REACH = 3.0e-3
"""M to a side within which the face of the gel meets what it comes down on."""

_LEAST_WEIGHT = 0.5
_NEAR = 8
_POINTS = 3
_ROUNDS = 4


def aims_unmet(
    model: ObjectModel, patches: Sequence[Patch], free: Sequence[FloatArray], random: np.random.Generator
) -> list[LineTarget]:
    """Lines from above onto a flat object, as it may stand by what was met and what was not.

    Lines to where its middle should be end above a small plate's well and pass beside a wrench. Those that
    are likely to meet it come first, by chance in part, so that they do not all lead to one place.

    Args:
        model: of the object.
        patches: of the contacts so far.
        free: ``(n, 3)`` m in base each, places along the ways that the gel has passed.
        random: what stands, places and their order are drawn from.
    """
    stands, chances = _stands(model, patches, free, random)
    lowest = lowest_end(model)
    places = []
    for index in random.choice(len(stands), LINES, p=chances):
        surface = placed(model, model.stand.points, stands[index])
        high = surface[surface[:, 2] > model.place[2] + lowest + _ABOVE_END]
        places.append(random.choice(high if len(high) else surface))
    ends = np.array(places)
    likely = _met(model, stands, ends[:, :2] - model.place[:2], lowest) @ chances
    order = np.argsort(-likely * random.uniform(_LEAST_WEIGHT, 1.0, LINES))
    return [LineTarget(ends[k], above=True, lowest=lowest) for k in order]


def _met(model: ObjectModel, stands: FloatArray, aims: FloatArray, lowest: float) -> BoolArray:
    """``(a, k)``: whether the gel, coming down on ``(a, 2)`` m off the place, meets objects that stand so."""
    scale = np.exp(stands[:, 0])
    cosine, sine = np.cos(stands[:, 3]), np.sin(stands[:, 3])
    x, y = np.moveaxis(aims[:, None] - stands[None, :, 1:3], -1, 0)
    standing = np.stack([cosine * x + sine * y, cosine * y - sine * x], axis=-1) / scale[:, None]
    apart, near = cKDTree(model.stand.points[:, :2]).query(standing, k=_NEAR)
    heights = np.where(apart * scale[:, None] < _REACH, model.stand.points[near, 2], -np.inf)
    return np.asarray(heights.max(axis=-1) * scale > lowest)


def lowest_end(model: ObjectModel) -> float:
    """M above the support where lines from above end: half as high as the smallest one, if that is less."""
    flattest = model.height * model.sizes.low / model.nominal
    return float(np.clip(0.5 * flattest, FLATTEST, LOWEST))


def _stands(
    model: ObjectModel, patches: Sequence[Patch], free: Sequence[FloatArray], random: np.random.Generator
) -> tuple[FloatArray, FloatArray]:
    """``(STANDS, UNKNOWNS)`` and ``(STANDS,)`` their probabilities."""
    drawn = np.zeros((STANDS, UNKNOWNS))
    low, high = np.log(np.array([model.sizes.low, model.sizes.high]) / model.nominal)
    drawn[:, 0] = random.uniform(low, high, STANDS)
    drawn[:, 1:3] = random.normal(0.0, model.place_error, (STANDS, 2))
    drawn[:, 3] = random.uniform(0.0, 2.0 * np.pi, STANDS)
    costs = np.zeros(STANDS)
    if patches:
        problem = TouchProblem(model.stand, patches, _POINTS)
        drawn, costs = problem.refined(drawn, _ROUNDS, fixed_size=True)
    costs = costs + FreeSpace(model.stand, free).cost(drawn)
    chances = np.exp(costs.min() - costs)
    return drawn, chances / chances.sum()


STEEPEST = float(np.radians(45.0))
"""Rad between the way of the gel and the surface's normal beyond which a tip would glance off."""

_SIDE = 8.0e-3
_THICK = 4.0e-3
_SEARCHED = 1


def strike_met(
    here: Surroundings, model: ObjectModel, patch: Patch, rotation: FloatArray
) -> StrikeMotion | None:
    """The motions of a strike at the crest of what a contact touched, the way that the gel came.

    The tip goes where the gel has been. What carries it goes beside that, where nobody has been: such a
    strike is to be made with a guard.

    Args:
        here: where the arm moves.
        model: says where the support is.
        patch: that the contact touched.
        rotation: ``(3, 3)`` of the gel in base.

    Returns:
        None where the surface is too steep for it, or no free way was found.
    """
    if float(-rotation[:, 2] @ patch.normal) < np.cos(STEEPEST):
        return None
    deepest = patch.points[int((patch.points @ rotation[:, 2]).argmin())]  # of a rim, where it is thickest
    crest, mark = transform(rotation, deepest), model.nowhere
    # The mark on the support, and a small plate whose face is where the surface was touched; in base.
    corners = np.array(list(product((-_SIDE, _SIDE), (-_SIDE, _SIDE), (0.0, _THICK))))
    plate = closed_hull(apply(crest, corners))
    vertices = np.concatenate([mark.vertices, plate.vertices])
    lines = model.twin_around(Mesh(vertices, np.concatenate([mark.faces, plate.faces + len(mark.vertices)])))
    plans = planner(here.scene, here.station, lines, here.travels)
    if plans is None:
        return None
    strike = plans.plan(crest, here.joints, searched=_SEARCHED)
    if strike is None:
        return None
    try:
        return rehearsed_strike(strike, here.travels, lines)
    except MotionRefused:
        return None


_YAWS = 24


def blind_envelope(model: ObjectModel) -> Mesh:
    """Where the object may be before anything is known: the largest one, any way round; in base."""
    size = model.sizes.high
    turns = np.arange(_YAWS) * 2.0 * np.pi / _YAWS
    stands = [np.array([np.log(size / model.nominal), 0.0, 0.0, yaw]) for yaw in turns]
    reach = float(np.linalg.norm(model.corners[:, :2], axis=1).max()) * size / model.nominal
    between = reach * (1.0 / np.cos(np.pi / _YAWS) - 1.0)
    return _envelope(model, stands, PLACES * model.place_error + between, margin_of(size))


def seen_envelope(model: ObjectModel, stands: Sequence[SeenStand]) -> Mesh:
    """Where it may be after a look, in every turn that was not ruled out; in base."""
    largest = model.nominal * float(np.exp(max(stand.unknowns[0] for stand in stands)))
    off = PLACES * max(stand.place_error for stand in stands)
    return _envelope(model, [stand.unknowns for stand in stands], off, margin_of(largest))


def _envelope(model: ObjectModel, stands: Sequence[FloatArray], off: float, margin: float) -> Mesh:
    """Return the convex hull in the base frame of an object at some poses, with a margin of ``off`` m.

    A pose is ``(4,)``: log of the relative size, x and y in m, yaw in rad; the hull is cut at z = 0.
    """
    corners = model.corners
    places = hull_of(np.concatenate([placed(model, corners, stand) for stand in stands]))
    return around(places, off, margin, float(model.place[2]))


def placed(model: ObjectModel, standing: FloatArray, stand: FloatArray) -> FloatArray:
    """``(n, 3)`` m in base: places of the nominal standing object, of that size, there and so turned."""
    cosine, sine = np.cos(stand[3]), np.sin(stand[3])
    turned = np.column_stack(
        [
            cosine * standing[:, 0] - sine * standing[:, 1],
            sine * standing[:, 0] + cosine * standing[:, 1],
            standing[:, 2],
        ]
    )
    return np.asarray(np.exp(stand[0]) * turned + model.place + np.array([stand[1], stand[2], 0.0]))
