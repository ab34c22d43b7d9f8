"""Plans of close contacts: each has a free way from the one before, also where a first choice had none."""

import itertools
from pathlib import Path

import numpy as np
import pytest

from experiments.contact_localization.plan import plan_contacts
from experiments.contact_localization.section import Localization
from harness.basics.errors import WrongUse
from harness.basics.geometry import apply
from harness.bench import kinematics
from harness.bench.scene import SceneFile, scene_from_json, scene_from_options
from harness.bench.station_file import Station, load_station, station_from_json, station_path
from harness.effects.scene_object import known_object
from harness.skills import sites
from harness.skills.planning import HOME, Itinerary, RunPlan
from harness.skills.sites import SHORTEST_STEP
from harness.twin.rehearsal import rehearse

STATION = load_station(station_path("mock"))


@pytest.fixture(scope="module")
def mug_plan() -> RunPlan:
    """Of seed 4; read only."""
    return planned(scene_from_options("builtin:mug"), 4)


def planned(scene: SceneFile, seed: int) -> RunPlan:
    return plan_contacts(scene, STATION, known_object(scene).mesh, seed)


def turned(scene: SceneFile, yaw: str) -> SceneFile:
    tree = scene.model_dump(mode="json", by_alias=True)
    tree["object"]["pose"]["yaw"] = yaw
    return scene_from_json(tree, "the test")


def assert_good(plan: RunPlan, scene: SceneFile) -> None:
    wanted = scene.section(Localization)
    assert len(plan.sites) == len(plan.contacts) == wanted.contacts
    starts = [HOME, *(contact.stand_off_joints for contact in plan.contacts)]
    for contact, start in zip(plan.contacts, starts[:-1], strict=True):
        assert np.array_equal(contact.start, start)
    points = np.array([site.point_in_object for site in plan.sites])
    steps = np.linalg.norm(np.diff(points, axis=0), axis=1)
    assert steps.max() <= wanted.step
    assert steps.min() >= SHORTEST_STEP
    for site, contact in zip(plan.sites, plan.contacts, strict=True):
        pressed = contact.base_from_pressed @ plan.bench.flange_from_gel
        assert pressed == pytest.approx(site.base_from_gel, abs=1e-12)
    assert plan.rehearsal.refusals == ()
    assert len(plan.rehearsal.contacts) == wanted.contacts


def test_a_wineglass_whose_first_choice_had_no_way_is_planned_all_the_same(shared_data: Path) -> None:
    file = str(shared_data / "meshes/contactdb_objects/wineglass.stl")
    scene = scene_from_options(file, "glass", "m")
    assert_good(planned(scene, 2), scene)


def test_turned_about_too(shared_data: Path) -> None:
    file = str(shared_data / "meshes/contactdb_objects/wineglass.stl")
    scene = turned(scene_from_options(file, "glass", "m"), "225 deg")
    assert_good(planned(scene, 0), scene)


def test_the_same_seed_gives_the_same_plan(mug_plan: RunPlan) -> None:
    assert planned(scene_from_options("builtin:mug"), 4).parameters() == mug_plan.parameters()


def test_an_itinerary_cut_back_goes_on_from_there(mug_plan: RunPlan) -> None:
    """What was planned after the site that stays is forgotten, with its motions."""
    plan = mug_plan
    itinerary = Itinerary(plan.bench, 4)
    for k in (0, 1, 2):
        assert itinerary.visit(k, plan.sites[k].base_from_gel, patient=False)
    assert itinerary.visit(1, plan.sites[2].base_from_gel, patient=True)
    first, second = itinerary.contacts
    assert np.array_equal(second.start, first.stand_off_joints)
    assert np.array_equal(second.base_from_pressed, plan.contacts[2].base_from_pressed)


def test_a_place_without_a_way_is_no_site_and_leaves_the_itinerary(mug_plan: RunPlan) -> None:
    plan = mug_plan
    itinerary = Itinerary(plan.bench, 4)
    assert itinerary.visit(0, plan.sites[0].base_from_gel, patient=False)
    through_the_table = plan.sites[1].base_from_gel.copy()
    through_the_table[2, 3] = -0.1
    assert not itinerary.visit(1, through_the_table, patient=False)
    assert len(itinerary.contacts) == 1


def test_an_object_out_of_the_arms_reach_is_refused_with_numbers(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sites, "_PATIENCE", 256)
    tree = scene_from_options("builtin:mug").model_dump(mode="json", by_alias=True)
    tree["object"]["pose"]["position"] = ["2.5 m", "0 m", "0.25 m"]
    scene = scene_from_json(tree, "the test")
    with pytest.raises(
        WrongUse,
        match=r"\b0 of 6 contacts",
    ):
        planned(scene, 1)


def highest(plan: RunPlan, station: Station) -> float:
    """m above the base of the highest point of the tool on any way."""
    tops = []
    for contact in plan.contacts:
        stations = np.vstack([contact.start, contact.travel])
        for start, end in itertools.pairwise(stations):
            way = start + np.linspace(0.0, 1.0, 50)[:, None] * (end - start)
            poses = kinematics.forward(station.arm.model, way)
            tops += [float(apply(pose, station.tool_points)[:, 2].max()) for pose in poses]
    return max(tops)


def lowered(height: str) -> Station:
    """The mocked station with a lower ceiling."""
    tree = STATION.model_dump(mode="json", by_alias=True)
    tree["arm"]["safety"]["workspace_high"][2] = height
    return station_from_json(tree, "the test")


def test_ways_stay_in_the_stations_workspace() -> None:
    """The driver would refuse to leave it, in the middle of a run."""
    scene = scene_from_options("builtin:mug")
    free = planned(scene, 1)
    ceiling = highest(free, STATION) - 0.01
    station = lowered(f"{1e3 * ceiling:.1f} mm")
    plan = plan_contacts(scene, station, known_object(scene).mesh, 1)
    assert highest(plan, station) < ceiling
    refused = rehearse(plan.bench, free.segments()).refusals
    assert refused
    assert refused[0].bodies == (("tool", "limit_of_the_workspace"),)
    assert "the tool would run into the limit of the workspace" in str(refused[0])
