"""A plan that must not be performed is refused, and the refusal names the step and the bodies."""

import csv
import itertools
from pathlib import Path

import numpy as np
import pytest

from harness.agreement.arm import compare_arm
from harness.basics.arrays import FloatArray
from harness.basics.errors import MotionRefused
from harness.basics.geometry import (
    apply,
    frame_facing,
    rotation_about,
    rotation_from_vector,
    transform,
    translation,
)
from harness.basics.mesh import Mesh
from harness.bench import kinematics
from harness.bench.sensor import GELSIGHT_R15
from harness.objects.household import build
from harness.twin.bench import TwinBench
from harness.twin.motion import PlannedContact, plan_contact, reachable
from harness.twin.rehearsal import Segment, contact_point, rehearse
from harness.twin.ways import LONGEST_MOVE, connect, search, sweep

TOOL = translation(np.array([0.0, 0.0, 0.12]))
BASE_FROM_OBJECT = translation(np.array([-0.42, 0.0, 0.25]))
HOME = np.radians([0.0, -90.0, 90.0, -90.0, -90.0, 0.0])
MUG = build("mug", 6e-3)
DOWN = np.diag([1.0, -1.0, -1.0])


@pytest.fixture(scope="module")
def bench() -> TwinBench:
    return TwinBench("ur5e", TOOL, GELSIGHT_R15, MUG, BASE_FROM_OBJECT)


def block(size: tuple[float, float, float], step: float) -> Mesh:
    """A block standing on z = 0 with a groove: its half x > 0 is lower by ``step``."""
    x, y, z = 0.5 * size[0], 0.5 * size[1], size[2]
    outline = [(-x, 0.0), (x, 0.0), (x, z - step), (1e-9, z - step), (0.0, z), (-x, z)]
    corners = np.array([[u, side * y, v] for side in (-1, 1) for u, v in outline])
    faces = []
    for i in range(6):
        a, b = i, (i + 1) % 6
        faces += [[a, b, 6 + b], [a, 6 + b, 6 + a]]
    return Mesh(corners, np.array(faces))


def on_the_wall(
    bench: TwinBench, bearing: float, height: float, press: float, tilt: float = 0.0
) -> FloatArray:
    """The gel pressed into the mug's outer wall from a horizontal bearing, found by a line."""
    direction = np.array([np.cos(bearing), np.sin(bearing), 0.0])
    start = np.array([0.0, 0.0, height]) + 0.3 * direction
    point = start - bench.solid.first_hit(start, -direction) * direction
    axis = rotation_about(np.array([0.0, 0.0, 1.0]), tilt) @ -direction
    centre = apply(BASE_FROM_OBJECT, (point + press * axis)[None])[0]
    return transform(frame_facing(axis, 0.0), centre)


def planned(bench: TwinBench, start: FloatArray, base_from_gel: FloatArray) -> PlannedContact:
    contact = plan_contact(bench, base_from_gel, start)
    assert contact is not None
    return contact


@pytest.fixture(scope="module")
def seven(bench: TwinBench) -> list[PlannedContact]:
    contacts, joints = [], HOME
    # The handle is at bearing 0.
    for bearing in (0.9, -0.9, 1.5, -1.5, 1.1, 0.7, -1.2):
        contact = planned(bench, joints, on_the_wall(bench, bearing, 0.055, 1e-3))
        contacts.append(contact)
        joints = contact.stand_off_joints
    return contacts


def test_a_plan_of_seven_contacts_is_free_and_says_where_they_will_be(
    bench: TwinBench, seven: list[PlannedContact]
) -> None:
    segments = [s for step, contact in enumerate(seven) for s in contact.segments(step)]
    report = rehearse(bench, segments).require()
    assert report.refusals == ()
    assert [contact.step for contact in report.contacts] == list(range(7))
    for contact in report.contacts:
        assert contact.centre_depth == pytest.approx(1e-3, abs=1e-6)
        assert contact.pad_depth >= contact.centre_depth
        assert np.linalg.norm(bench.solid.nearest(contact.point_in_object) - contact.point_in_object) < 1e-12


def test_travel_ends_where_the_press_begins_and_never_turns_too_far_at_once(
    bench: TwinBench, seven: list[PlannedContact]
) -> None:
    for contact in seven:
        stations = [contact.start, *contact.travel]
        for a, b in itertools.pairwise(stations):
            assert np.abs(b - a).max() <= LONGEST_MOVE + 1e-12
            assert sweep(bench, a, b) is None
        reached = kinematics.forward("ur5e", contact.stand_off_joints)
        assert np.abs(reached - contact.base_from_stand_off).max() < 1e-9
        reached = kinematics.forward("ur5e", contact.pressed_joints)
        assert np.abs(reached - contact.base_from_pressed).max() < 1e-9


def test_the_same_question_gets_the_same_plan(bench: TwinBench, seven: list[PlannedContact]) -> None:
    base_from_gel = seven[1].base_from_pressed @ TOOL
    again = planned(bench, seven[0].stand_off_joints, base_from_gel)
    assert np.array_equal(again.travel, seven[1].travel)


def refusal_of(bench: TwinBench, *segments: Segment) -> str:
    with pytest.raises(MotionRefused) as refused:
        rehearse(bench, segments).require()
    return str(refused.value)


def test_into_the_table(bench: TwinBench) -> None:
    aside = HOME + np.array([1.2, 0.0, 0.0, 0.0, 0.0, 0.0])
    low = aside + np.array([0.0, 0.9, 0.0, 0.0, 0.0, 0.0])
    text = refusal_of(bench, Segment(3, "travel", "joint", aside, low))
    assert "step 4 (travel)" in text
    assert "housing" in text
    assert "table" in text


def test_into_the_object_and_its_pedestal(bench: TwinBench) -> None:
    beside = on_the_wall(bench, 1.2, 0.05, -0.03)
    joints = plan_contact(bench, on_the_wall(bench, 1.2, 0.05, 5e-4), HOME)
    assert joints is not None
    there = joints.stand_off_joints
    across = translation(np.array([0.0, -0.12, 0.0])) @ beside @ bench.gel_from_flange
    report = rehearse(bench, [Segment(1, "travel", "line", there, across)])
    assert report.refusals[0].step == 1
    assert {"object"} == {second for _, second in report.refusals[0].bodies}
    lower = translation(np.array([0.0, -0.02, -0.12])) @ across
    report = rehearse(bench, [Segment(2, "travel", "line", there, lower)])
    assert "pedestal" in str(report.refusals[0]) or "object" in str(report.refusals[0])


def test_into_itself(bench: TwinBench) -> None:
    aside = HOME + np.array([1.2, 0.0, 0.0, 0.0, 0.0, 0.0])
    folded = aside + np.array([0.0, 0.0, 1.3, 0.0, 0.0, 0.0])
    report = rehearse(bench, [Segment(0, "travel", "joint", aside, folded)])
    assert report.refusals[0].bodies == (("wrist_3", "upper_arm"),)
    assert "97 %" in str(report.refusals[0])


def test_past_a_joint_limit(bench: TwinBench) -> None:
    wound = HOME + np.array([0.0, 0.0, 0.0, 0.0, 0.0, 6.5])
    text = refusal_of(bench, Segment(0, "travel", "joint", HOME, wound))
    assert "joint 6 at 6.500 rad" in text


def test_out_of_reach(bench: TwinBench) -> None:
    far = translation(np.array([-0.6, 0.0, 0.0])) @ kinematics.forward("ur5e", HOME)
    text = refusal_of(bench, Segment(5, "press", "line", HOME, far))
    assert "step 6 (press)" in text
    assert "cannot reach" in text


def test_through_a_singular_wrist(bench: TwinBench) -> None:
    joints = HOME.copy()
    joints[4] = 0.03
    up = translation(np.array([0.0, 0.0, 0.02])) @ kinematics.forward("ur5e", joints)
    text = refusal_of(bench, Segment(0, "retreat", "line", joints, up))
    assert "singular" in text
    assert "limit 0.04" in text


def test_a_start_that_is_not_where_the_arm_is(bench: TwinBench) -> None:
    there = HOME + np.array([0.1, 0, 0, 0, 0, 0])
    elsewhere = HOME + np.array([0.1, 0.01, 0, 0, 0, 0])
    text = refusal_of(
        bench, Segment(0, "travel", "joint", HOME, there), Segment(1, "travel", "joint", elsewhere, HOME)
    )
    assert "step 2" in text
    assert "0.0100 rad at joint 2" in text


def press_down(bench: TwinBench, x: float, depth: float) -> Segment:
    """A press from straight above at ``x`` of a block 60 mm high."""
    gel = transform(DOWN, apply(bench.base_from_object, np.array([[x, 0.0, 0.06 - depth]]))[0])
    before = gel @ translation(np.array([0.0, 0.0, -0.03]))
    joints = kinematics.nearest_branch("ur5e", before @ bench.gel_from_flange, HOME, bench.joint_range)
    assert joints is not None
    return Segment(0, "press", "line", joints, gel @ bench.gel_from_flange, touches=True, press=True)


def test_too_deep_and_not_at_all() -> None:
    flat = TwinBench("ur5e", TOOL, GELSIGHT_R15, block((0.1, 0.1, 0.06), 0.0), BASE_FROM_OBJECT)
    assert rehearse(flat, [press_down(flat, -0.02, 2.0e-3)]).refusals == ()
    text = refusal_of(flat, press_down(flat, -0.02, 3.0e-3))
    assert "3.0 mm" in text
    assert "2.5 mm" in text
    assert "1.0 mm" in refusal_of(flat, press_down(flat, -0.02, -1.0e-3))


def test_another_part_of_the_pad_too_deep() -> None:
    # The gel's centre is over the lower half, its edge over the other, 3 mm higher.
    stepped = TwinBench("ur5e", TOOL, GELSIGHT_R15, block((0.1, 0.1, 0.06), 3e-3), BASE_FROM_OBJECT)
    text = refusal_of(stepped, press_down(stepped, 0.005, 3.0e-3 + 0.5e-3))
    assert "3.5 mm" in text
    assert "centre 0.5 mm" in text


def test_the_housing_beside_the_gel() -> None:
    # 14 mm from the step: out of the pad's sight, under the housing's face.
    stepped = TwinBench("ur5e", TOOL, GELSIGHT_R15, block((0.1, 0.1, 0.06), 6e-3), BASE_FROM_OBJECT)
    report = rehearse(stepped, [press_down(stepped, 0.014, 6e-3 + 1e-3)])
    assert ("housing", "object") in report.refusals[0].bodies


def test_reach_agrees_with_planning_and_nothing_reaches_from_below(
    bench: TwinBench, seven: list[PlannedContact]
) -> None:
    base_from_gel = seven[0].base_from_pressed @ TOOL
    assert reachable(bench, base_from_gel)
    gel = bench.base_from_gel(seven[0].pressed_joints)
    assert np.abs(gel - base_from_gel).max() < 1e-9
    assert bench.hits(seven[0].stand_off_joints) == ()
    from_below = transform(np.eye(3), apply(BASE_FROM_OBJECT, np.array([[0.0, 0.0, 4.5e-3]]))[0])
    assert not reachable(bench, from_below)
    assert plan_contact(bench, from_below, HOME) is None


def test_where_the_object_is_in_the_way_the_way_leads_around_it(bench: TwinBench) -> None:
    one = planned(bench, HOME, on_the_wall(bench, 1.8, 0.05, 5e-4)).stand_off_joints
    other = planned(bench, one, on_the_wall(bench, -0.9, 0.05, 5e-4)).stand_off_joints
    assert sweep(bench, one, other) is not None
    way = connect(bench, one, other)
    assert way is not None
    stations = [one, *way]
    assert np.array_equal(stations[-1], other)
    assert all(sweep(bench, a, b) is None for a, b in itertools.pairwise(stations))


def test_the_search_finds_a_way_where_the_straight_one_is_blocked(bench: TwinBench) -> None:
    one = planned(bench, HOME, on_the_wall(bench, 1.8, 0.05, 5e-4)).stand_off_joints
    other = planned(bench, one, on_the_wall(bench, -0.9, 0.05, 5e-4)).stand_off_joints
    way = search(bench, one, other, np.random.default_rng(3))
    assert way is not None
    assert np.array_equal(way[[0, -1]], [one, other])
    assert all(sweep(bench, a, b) is None for a, b in itertools.pairwise(way))
    assert np.array_equal(way, search(bench, one, other, np.random.default_rng(3)))  # type: ignore[arg-type]


def test_a_contact_performed_elsewhere_is_reported_as_far_as_it_was(
    bench: TwinBench, seven: list[PlannedContact]
) -> None:
    report = rehearse(bench, seven[0].segments(0))
    rehearsed = report.contacts[0]
    same = contact_point(bench, rehearsed.base_from_gel)
    assert np.linalg.norm(same - rehearsed.point_in_object) < 1e-12
    moved = translation(np.array([0.0, 0.0, 1.5e-3])) @ rehearsed.base_from_gel
    distance = np.linalg.norm(contact_point(bench, moved) - rehearsed.point_in_object)
    assert distance == pytest.approx(1.5e-3, rel=0.1)  # along a wall that is nearly upright


def test_where_the_line_misses_the_contact_is_the_nearest_surface(bench: TwinBench) -> None:
    beside = transform(DOWN, np.array([-0.42 + 0.2, 0.0, 0.3]))
    point = contact_point(bench, beside)
    assert np.linalg.norm(bench.solid.nearest(point) - point) < 1e-12
    assert np.linalg.norm(apply(BASE_FROM_OBJECT, point[None])[0] - beside[:3, 3]) > 0.1


def test_a_real_arm_differs_from_its_table_by_one_constant(shared_data: Path) -> None:
    with (shared_data / "robot" / "rtde_recording" / "ur5e_real_robot_data.csv").open() as file:
        rows = list(csv.DictReader(file, delimiter=" "))
    joints = np.array([[float(row[f"target_q_{i}"]) for i in range(6)] for row in rows])
    tcp = np.array([[float(row[f"target_TCP_pose_{i}"]) for i in range(6)] for row in rows])
    poses = np.stack([transform(rotation_from_vector(row[3:]), row[:3]) for row in tcp])
    distances, angles = compare_arm("ur5e", joints, poses)
    # Factory calibration: the maker's tables are the nominal arm's.
    assert np.median(distances) == pytest.approx(1.57e-3, abs=2e-5)
    assert np.degrees(np.median(angles)) == pytest.approx(0.27, abs=0.01)
    assert np.ptp(distances) < 1e-5


def test_a_controllers_kinematics_are_compared_pose_by_pose() -> None:
    joints = np.random.default_rng(0).uniform(-1, 1, (5, 6))
    poses = kinematics.forward("ur5e", joints)
    poses[2] = translation(np.array([0.0, 3e-4, 0.0])) @ poses[2]
    poses[4, :3, :3] = poses[4, :3, :3] @ rotation_about(np.array([0.0, 0.0, 1.0]), 0.01)
    distances, angles = compare_arm("ur5e", joints, poses)
    assert np.allclose(distances, [0, 0, 3e-4, 0, 0], atol=1e-15)
    assert np.allclose(angles, [0, 0, 0, 0, 0.01], atol=1e-12)
