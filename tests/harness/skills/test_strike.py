"""A strike: before the place, fire, listen, go back, whatever happens; and who is asked where nobody is."""

import json
from collections.abc import Callable
from dataclasses import replace
from typing import Any, cast

import numpy as np
import pytest

from experiments.contact_localization.plan import plan_contacts
from experiments.contact_localization.section import Localization
from harness.basics.arrays import FloatArray
from harness.basics.errors import BenchFault, WrongUse
from harness.basics.geometry import translation
from harness.bench.device import Channel, Reading
from harness.bench.named_files import SHIPPED
from harness.bench.scene import SceneFile, load_scene
from harness.bench.station import STRIKE, Bench
from harness.bench.station_file import Station, load_station, station_path
from harness.effects.scene_object import known_object
from harness.skills.planning import RunPlan
from harness.skills.strike import (
    AFTER,
    ATTEMPTS,
    BEFORE,
    FARTHEST,
    POSE,
    StrikeMotion,
    by_hand,
    planner,
    strike,
    strike_by_hand,
)

STATION = load_station(station_path("mock"))
AXIS = np.array([1.0, 0.0, 0.0])
MOTION = StrikeMotion(np.zeros(6), np.ones((2, 6)), translation(-0.03 * AXIS), np.eye(4), AXIS)
HEARD = Reading(Channel("hammer.force", "count", (1,), "int32"), np.zeros(1), np.zeros((1, 1)))


class Recorder:
    """An arm and a hammer that note what they are asked, in order."""

    def __init__(self, failures: int = 0) -> None:
        self.log: list[str] = []
        self.failures = failures
        self.pose = np.eye(4)
        self.time = 0.0

    def move_line(self, base_from_flange: FloatArray, speed: float, acceleration: float) -> None:
        self.pose = base_from_flange
        self.log.append(f"line {1e3 * base_from_flange[0, 3]:.1f}")

    def set_digital_output(self, index: int, on: bool) -> None:
        self.log.append(f"output {index} {'on' if on else 'off'}")

    def state(self) -> Any:
        from harness.bench.device import ArmState

        return ArmState(self.time, np.zeros(6), np.zeros(6), self.pose, np.zeros(6), "normal", False)

    def capture(
        self, fire: Callable[[], None], before: float, after: float, timeout: float
    ) -> tuple[Reading, ...]:
        assert (before, after) == (BEFORE, AFTER)
        self.log.append("listen")
        fire()
        if self.failures:
            self.failures -= 1
            raise BenchFault("samples were lost")
        return (HEARD,)

    @property
    def bench(self) -> Bench:
        arm = cast("Any", self)

        def mark(step: int, sample: int) -> None:
            self.log.append(f"mark {step} {sample}")

        def pause(seconds: float) -> None:
            self.log.append("pause")

        return Bench(STATION, {"arm": arm, "gel": arm, "hammer": arm}, mark, pause)


FIRED = ["listen", "output 0 on", "pause", "output 0 off"]


def test_it_goes_there_marks_fires_listens_and_goes_back() -> None:
    recorder = Recorder()
    pose, heard = strike(MOTION, 4, 0.0, recorder.bench)
    assert recorder.log == ["line 0.0", f"mark 4 {STRIKE}", *FIRED, "line -30.0"]
    assert heard is HEARD
    assert pose.channel.name == POSE
    np.testing.assert_array_equal(pose.values, [[0, 0, 0, 1, 0, 0, 0]])


@pytest.mark.parametrize("moved", [2e-3, -3e-3])
def test_it_follows_the_surface_that_was_touched(moved: float) -> None:
    recorder = Recorder()
    pose, _ = strike(MOTION, 0, moved, recorder.bench)
    assert recorder.log[0] == f"line {1e3 * moved:.1f}"
    assert pose.values[0, 0] == pytest.approx(moved)


@pytest.mark.parametrize("moved", [1.01 * FARTHEST, -1.01 * FARTHEST])
def test_a_surface_too_far_from_the_plan_is_not_struck_and_nothing_moves(moved: float) -> None:
    recorder = Recorder()
    with pytest.raises(BenchFault, match=r"contact 3: .* mm .* mm"):
        strike(MOTION, 2, moved, recorder.bench)
    assert recorder.log == []


def test_a_hammer_is_switched_off_whatever_ends_the_wait() -> None:
    recorder = Recorder()

    def interrupted(_: float) -> None:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        strike(MOTION, 4, 0.0, replace(recorder.bench, pause=interrupted))
    assert "output 0 off" in recorder.log


def test_a_strike_that_was_lost_is_repeated_and_then_given_up_behind_the_stand_off() -> None:
    lost_once = Recorder(failures=1)
    strike(MOTION, 0, 0.0, lost_once.bench)
    assert lost_once.log.count("output 0 on") == 2
    lost = Recorder(failures=ATTEMPTS)
    with pytest.raises(BenchFault, match="samples"):
        strike(MOTION, 0, 0.0, lost.bench)
    assert lost.log.count("output 0 on") == ATTEMPTS
    assert lost.log[-1] == "line -30.0"


def test_a_person_is_asked_and_the_arm_keeps_still() -> None:
    recorder, asked = Recorder(), list[str]()
    assert strike_by_hand(1, recorder.bench, asked.append) == (HEARD,)
    assert recorder.log == [f"mark 1 {STRIKE}", "listen"]
    (said,) = asked
    assert said.startswith("contact 2: ")


def test_where_nobody_is_a_person_s_strike_is_refused() -> None:
    with pytest.raises(WrongUse, match="--json"):
        strike_by_hand(1, Recorder().bench, None)


def test_a_motion_survives_the_plan_s_json() -> None:
    read = StrikeMotion.from_parameters(json.loads(json.dumps(MOTION.to_parameters())))
    for name, value in vars(MOTION).items():
        np.testing.assert_array_equal(vars(read)[name], value)
    at_once = StrikeMotion(np.zeros(6), np.zeros((0, 6)), np.eye(4), np.eye(4), AXIS)
    assert StrikeMotion.from_parameters(at_once.to_parameters()).travel.shape == (0, 6)


@pytest.fixture(scope="module")
def both() -> SceneFile:
    return load_scene(SHIPPED / "scenes" / "mug_both.toml")


@pytest.fixture(scope="module")
def plan(both: SceneFile) -> RunPlan:
    few = both.section(Localization).model_copy(update={"contacts": 2})
    return plan_contacts(both.with_section(few), STATION, known_object(both).mesh, 1)


def test_every_contact_of_a_scene_with_sound_has_its_strike(plan: RunPlan) -> None:
    steps = plan.parameters()
    assert len(steps) == len(plan.strikes) == 2
    for step, site, contact in zip(steps, plan.sites, plan.contacts, strict=True):
        motion = StrikeMotion.from_parameters(step["strike"])
        np.testing.assert_allclose(motion.axis, site.base_from_gel[:3, 2], atol=1e-9)
        np.testing.assert_array_equal(motion.start, contact.stand_off_joints)
    np.testing.assert_array_equal(plan.contacts[1].start, plan.strikes[0].stand_off_joints)


def test_a_touch_only_scene_plans_no_strike(both: SceneFile) -> None:
    silent = both.sensors.model_copy(update={"sound": False})
    few = both.section(Localization).model_copy(update={"contacts": 1})
    scene = both.model_copy(update={"sensors": silent, "localization": few})
    made = plan_contacts(scene, STATION, known_object(scene).mesh, 1)
    assert made.strikes == ()
    assert "strike" not in made.parameters()[0]


def operated() -> Station:
    assert STATION.hammer is not None
    return STATION.model_copy(
        update={"hammer": STATION.hammer.model_copy(update={"strike": "operator"}), "mock": None}
    )


def test_a_person_s_strikes_are_not_planned(both: SceneFile, plan: RunPlan) -> None:
    assert planner(both, operated(), plan.bench) is None
    assert by_hand(both, operated())
    assert not by_hand(both, STATION)


def test_sound_without_a_hammer_is_refused(both: SceneFile, plan: RunPlan) -> None:
    deaf = STATION.model_copy(update={"hammer": None})
    with pytest.raises(WrongUse, match=r"\[hammer\]"):
        planner(both, deaf, plan.bench)
