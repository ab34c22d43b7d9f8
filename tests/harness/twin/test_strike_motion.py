"""A strike goes where the press went, along its axis, with the tip clear of the object until it is fired."""

import numpy as np
import pytest

from harness.basics.arrays import FloatArray
from harness.basics.errors import WrongUse
from harness.basics.geometry import apply, frame_facing, inverse, rotation_from_vector, transform, translation
from harness.bench import kinematics
from harness.bench.sensor import GELSIGHT_R15
from harness.objects.household import build
from harness.twin.bench import NAME, TwinBench
from harness.twin.motion import BACK, PlannedStrike, StrikePlanner, plan_contact
from harness.twin.rehearsal import Segment, rehearse

TOOL = translation(np.array([0.0, 0.0, 0.12]))
HAMMER = transform(rotation_from_vector(np.array([0.0, np.pi / 3, 0.0])), np.array([0.1039, 0.0, 0.06]))
BASE_FROM_OBJECT = translation(np.array([-0.42, 0.0, 0.25]))
HOME = np.radians([0.0, -90.0, 60.0, -60.0, -90.0, 0.0])
STAND_OFF = 6e-3


@pytest.fixture(scope="module")
def bench() -> TwinBench:
    return TwinBench(
        "ur5e", TOOL, GELSIGHT_R15, build("mug", 6e-3), BASE_FROM_OBJECT, flange_from_hammer=HAMMER
    )


@pytest.fixture(scope="module")
def planner(bench: TwinBench) -> StrikePlanner:
    return StrikePlanner(bench, HAMMER, STAND_OFF)


def wall(bench: TwinBench, bearing: float, height: float) -> tuple[FloatArray, FloatArray]:
    """A press into the mug's wall, and the place that it touches, in base."""
    outward = np.array([np.cos(bearing), np.sin(bearing), 0.0])
    start = np.array([0.0, 0.0, height]) + 0.3 * outward
    point = start - bench.solid.first_hit(start, -outward) * outward
    centre, place = apply(BASE_FROM_OBJECT, np.stack([point - 1e-3 * outward, point]))
    return transform(frame_facing(-outward, 0.3), centre), place


def planned(planner: StrikePlanner, press: FloatArray, joints: FloatArray) -> PlannedStrike:
    strike = planner.plan(press, joints)
    assert strike is not None
    return strike


@pytest.mark.parametrize("bearing", [0.9, 1.5, -1.1])
def test_the_tip_waits_at_its_stand_off_before_the_place_and_along_the_axis_of_the_press(
    bench: TwinBench, planner: StrikePlanner, bearing: float
) -> None:
    press, place = wall(bench, bearing, 0.05)
    strike = planned(planner, press, HOME)
    tip = strike.base_from_firing @ HAMMER
    np.testing.assert_allclose(tip[:3, 2], press[:3, 2], atol=1e-9)
    np.testing.assert_allclose(tip[:3, 3], place - STAND_OFF * press[:3, 2], atol=1e-6)
    ready = strike.base_from_ready @ HAMMER
    np.testing.assert_allclose(tip[:3, 3] - ready[:3, 3], BACK * press[:3, 2], atol=1e-9)
    np.testing.assert_allclose(
        kinematics.forward("ur5e", strike.firing_joints), strike.base_from_firing, atol=1e-9
    )


def test_a_press_and_its_strike_are_rehearsed_in_a_row_and_nothing_is_refused(
    bench: TwinBench, planner: StrikePlanner
) -> None:
    joints, segments = HOME, list[Segment]()
    for step, bearing in enumerate((0.9, 1.3, -1.1)):
        press, _ = wall(bench, bearing, 0.05)
        contact = plan_contact(bench, press, joints)
        assert contact is not None
        strike = planned(planner, press, contact.stand_off_joints)
        segments += [*contact.segments(step), *strike.segments(step)]
        joints = strike.stand_off_joints
    report = rehearse(bench, segments)
    assert report.refusals == ()
    labels = [segment.label for segment in segments if segment.step == 1]
    assert labels.index("press") < labels.index("strike") < labels.index("draw back")


def test_the_rehearsal_refuses_a_tip_that_would_touch(bench: TwinBench, planner: StrikePlanner) -> None:
    press, _ = wall(bench, 0.9, 0.05)
    strike = planned(planner, press, HOME)
    nearer = translation((STAND_OFF - 1e-3) * strike.axis) @ strike.base_from_firing
    report = rehearse(bench, [Segment(0, "strike", "line", strike.stand_off_joints, nearer)])
    (refusal,) = report.refusals
    assert {"hammer", "object"} <= set(refusal.bodies[0])


def test_the_same_question_gets_the_same_answer(bench: TwinBench, planner: StrikePlanner) -> None:
    press, _ = wall(bench, -1.1, 0.04)
    first, second = (planned(planner, press, HOME) for _ in range(2))
    np.testing.assert_array_equal(first.travel, second.travel)


def test_a_place_that_no_posture_reaches_has_no_strike(bench: TwinBench, planner: StrikePlanner) -> None:
    below = np.array([0.0, 0.0, 1.0])  # from under the object, where its pedestal stands
    press = transform(frame_facing(below, 0.0), apply(BASE_FROM_OBJECT, np.array([[0.0, 0.0, 1e-3]]))[0])
    assert planner.plan(press, HOME) is None


def test_a_tip_within_the_clearance_is_refused(bench: TwinBench) -> None:
    with pytest.raises(WrongUse, match=r"hammer.stand_off = 1 mm.* 2 mm"):
        StrikePlanner(bench, HAMMER, 1e-3)


def test_the_hammer_is_a_body_of_the_tool_and_its_tip_is_its_end(bench: TwinBench) -> None:
    part = next(part for part in bench.parts if part.name == NAME)
    assert part.link == 6
    in_hammer = apply(inverse(HAMMER), part.vertices)
    assert in_hammer[:, 2].max() == pytest.approx(0.0, abs=1e-9)
    without = TwinBench("ur5e", TOOL, GELSIGHT_R15, build("mug", 6e-3), BASE_FROM_OBJECT)
    assert NAME not in [part.name for part in without.parts]
