"""The controller in virtual time: motions, stops, contact, noise, power. No sockets, no waiting."""

import math

import numpy as np
import numpy.typing as npt
import pytest

from mocks.ur.arm.motions import trapezoid
from mocks.ur.controller import Controller, RuntimeState
from mocks.ur.hooks import CYCLE, HOME, ControllerConfig, Six
from mocks.ur.ports import TOO_EARLY, Dashboard
from mocks.ur.robot import SafetyMode
from tests.support.plane_contact import PlaneContact

CONFIG = ControllerConfig(host="127.0.0.2")
FAR = "[1.0, -1.5707963267948966, 1.5707963267948966, -1.5707963267948966, -1.5707963267948966, 0]"
DOWN = 0.4879  # m, height of the flange at HOME


def _controller(script: str, plane: float | None = None, config: ControllerConfig = CONFIG) -> Controller:
    controller = Controller(config, PlaneContact(plane, 20e3) if plane is not None else None)
    _start(controller, script)
    return controller


def _start(controller: Controller, script: str) -> None:
    controller.player.start(controller.player.translate(f"def f():\n{script}\nend\n"))


def _run(controller: Controller, seconds: float) -> npt.NDArray[np.float64]:
    """Joints, cycle after cycle."""
    found = [controller.robot.mover.joints]
    for _ in range(round(seconds / CYCLE)):
        controller.cycle()
        found.append(controller.robot.mover.joints)
    return np.array(found)


def _state(controller: Controller) -> RuntimeState:
    return controller.player.state


def _run_until_stopped(controller: Controller) -> int:
    """Cycles until the program ended."""
    for cycle in range(20_000):
        if controller.player.state is RuntimeState.STOPPED:
            return cycle
        controller.cycle()
    raise AssertionError("the program goes on")


@pytest.mark.parametrize(
    ("length", "speed", "acceleration"),
    [(1.0, 0.5, 2.0), (0.01, 0.5, 2.0), (2.0, 3.0, 1.0), (1e-3, 0.5, 0.2), (0.02, 0.01, np.inf)],
)
def test_a_trapezoid_keeps_its_limits(length: float, speed: float, acceleration: float) -> None:
    profile = trapezoid(length, speed, acceleration)
    times = np.linspace(0.0, profile.duration, 20_001)
    way = length * np.array([profile.share(float(time)) for time in times])
    rate = np.diff(way) / np.diff(times)
    assert way[0] == 0.0
    assert way[-1] == length
    assert rate.max() <= speed * (1 + 1e-6)
    assert rate.min() >= 0.0
    assert np.abs(np.diff(rate) / times[1]).max() <= acceleration * (1 + 1e-3)


def test_no_way_takes_no_time_and_is_done() -> None:
    nowhere = trapezoid(0.0, 1.0, 1.0)
    assert nowhere.duration == 0.0
    assert nowhere.share(0.0) == 1.0


def test_a_move_ends_exactly_at_its_goal_after_its_trapezoid() -> None:
    controller = _controller(f"movej({FAR}, a=2.0, v=0.5)")
    cycles = _run_until_stopped(controller)
    assert controller.robot.mover.joints == (1.0, *HOME[1:])
    assert cycles * CYCLE == pytest.approx(1.0 / 0.5 + 0.5 / 2.0, abs=2 * CYCLE)


def test_a_line_turns_and_moves_at_the_same_time() -> None:
    script = "p0 = get_actual_tcp_pose() movel(pose_trans(p0, p[0.1, 0, 0, 0, 0, 0.5]), a=1, v=0.1)"
    controller = _controller(script)
    start = np.array(controller.robot.mover.base_from_tcp)
    _run_until_stopped(controller)
    start_from_goal = np.linalg.inv(start) @ controller.robot.mover.base_from_tcp
    c, s = math.cos(0.5), math.sin(0.5)
    turn = np.array([[c, -s, 0, 0.1], [s, c, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]])
    assert np.abs(start_from_goal - turn).max() < 1e-9


@pytest.mark.parametrize("stop", ["stopj(4)", "stopl(1.2)"])
def test_a_stop_takes_over_at_the_speed_the_arm_has(stop: str) -> None:
    controller = _controller(
        f"thread t(): movej({FAR}, a=2.0, v=0.5) end h = run t() sleep(0.5) kill h {stop}"
    )
    joints = _run(controller, 1.5)[:, 0]
    speeds = np.diff(joints) / CYCLE
    assert speeds[240] == pytest.approx(0.5)
    assert np.abs(np.diff(speeds)).max() <= 5.0 * CYCLE * 1.05
    assert speeds[-1] == 0.0
    assert 0.2 < joints[-1] < 0.35


def test_a_program_that_ends_during_a_motion_brakes() -> None:
    controller = _controller(f"thread t(): movej({FAR}, a=2.0, v=0.5) end run t() sleep(0.5)")
    speeds = np.diff(_run(controller, 1.0)[:, 0]) / CYCLE
    assert speeds.max() == pytest.approx(0.5)
    assert speeds[-1] == 0.0
    assert np.diff(speeds).min() >= -10.0 * CYCLE * 1.05


def test_speed_commands_ramp_and_follow_the_slider() -> None:
    controller = _controller("while True: speedl([0, 0.1, 0, 0, 0, 0], 0.5, t=0.002) end")
    _run(controller, 0.1)
    assert controller.robot.mover.twist[0][1] == pytest.approx(0.05, abs=2e-3)
    _run(controller, 0.2)
    assert controller.robot.mover.twist[0] == pytest.approx((0.0, 0.1, 0.0), abs=1e-9)
    controller.robot.outputs.slider = 0.25
    _run(controller, 0.3)
    assert controller.robot.mover.twist[0] == pytest.approx((0.0, 0.025, 0.0), abs=1e-9)


def test_too_fast_is_a_protective_stop() -> None:
    controller = _controller("while True: speedl([0, 3.0, 0, 0, 0, 0], 40.0, t=0.002) end")
    _run(controller, 0.5)
    assert controller.robot.safety.mode is SafetyMode.PROTECTIVE_STOP
    assert "1.5 m/s" in controller.robot.safety.cause
    assert controller.player.state is RuntimeState.PAUSED
    assert not any(controller.robot.mover.speeds)


def test_leaving_the_reach_is_a_protective_stop() -> None:
    controller = _controller("while True: speedl([-0.5, 0, 0, 0, 0, 0], 5.0, t=0.002) end")
    _run(controller, 2.0)
    assert controller.robot.safety.mode is SafetyMode.PROTECTIVE_STOP
    assert not any(controller.robot.mover.speeds)


def test_pressing_too_hard_is_a_protective_stop() -> None:
    controller = _controller("while True: speedl([0, 0, -0.05, 0, 0, 0], 1.0, t=0.002) end", DOWN - 0.02)
    _run(controller, 2.0)
    assert controller.robot.safety.cause == "the force at the tool exceeds 150 N"
    assert controller.robot.force.base[2] < 250.0


UNTIL_CONTACT = """
    while True:
        step_back = tool_contact(direction=[0, 0, -1, 0, 0, 0])
        if step_back <= 0:
            speedl([0, 0, -0.05, 0, 0, 0], 0.5, t=get_steptime())
        else:
            q = get_actual_joint_positions_history(step_back)
            stopl(3)
            movel(q)
            break
        end
    end"""


@pytest.mark.parametrize("wait", [0.0, 0.777])
def test_moving_until_contact_ends_at_the_same_place_however_long_it_was_waited_for(wait: float) -> None:
    controller = Controller(CONFIG, PlaneContact(DOWN - 0.02, 20e3))
    _run(controller, wait)
    _start(controller, UNTIL_CONTACT)
    _run_until_stopped(controller)
    height = controller.robot.mover.base_from_flange[2][3]
    assert height == pytest.approx(DOWN - 0.02, abs=1e-4)
    assert controller.robot.safety.mode is SafetyMode.NORMAL
    reference = _controller(UNTIL_CONTACT, DOWN - 0.02)
    _run_until_stopped(reference)
    assert controller.robot.mover.joints == reference.robot.mover.joints


def _forces(step: int, seed: int, wait: float) -> list[Six]:
    """Readings during a motion that begins after a wait."""
    controller = Controller(ControllerConfig(host="127.0.0.2", seed=seed), step=lambda: step)
    _run(controller, wait)
    _start(controller, f"movej({FAR}, a=2.0, v=0.5)")
    found = []
    for _ in range(100):
        controller.cycle()
        found.append(controller.robot.force.base)
    return found


def test_noise_depends_on_seed_step_and_motion_and_on_no_waiting() -> None:
    reference = _forces(step=3, seed=1, wait=0.0)
    later = _forces(step=3, seed=1, wait=0.777)
    # at rest before, the flange is where it was: the same readings, motion for motion
    assert later == reference
    assert _forces(step=4, seed=1, wait=0.0) != reference
    assert _forces(step=3, seed=2, wait=0.0) != reference


def test_zeroing_removes_the_bias_in_every_attitude_of_the_tool() -> None:
    quiet = ControllerConfig(host="127.0.0.2", force_noise=0.0, torque_noise=0.0, force_bias=5.0)
    controller = _controller("zero_ftsensor()", config=quiet)
    _run(controller, 0.01)
    _start(controller, f"movej({FAR}) movej([0, -1.2, 1.7, -1.0, -1.0, 0.7])")
    _run_until_stopped(controller)
    mover = controller.robot.mover
    assert np.abs(controller.robot.force.raw).max() > 1.0
    felt = controller.robot.force.at_tcp(mover.base_from_flange, mover.flange_from_tcp)
    assert np.abs(felt).max() < 1e-12


def test_the_moment_is_about_the_tool_centre_point() -> None:
    quiet = ControllerConfig(host="127.0.0.2", force_noise=0.0, torque_noise=0.0, force_bias=0.0)
    controller = _controller("set_tcp(p[0.1, 0, 0, 0, 0, 0])", DOWN + 0.001, quiet)
    _run(controller, 0.01)
    mover = controller.robot.mover
    felt = controller.robot.force.at_tcp(mover.base_from_flange, mover.flange_from_tcp)
    arm = np.array(mover.base_from_flange)[:3, :3] @ [0.1, 0.0, 0.0]
    assert felt[2] == pytest.approx(20.0, rel=1e-6)
    assert np.array(felt[3:]) == pytest.approx(-np.cross(arm, felt[:3]), abs=1e-9)


def test_a_paused_move_is_taken_up_again_where_it_was() -> None:
    controller = _controller(f"movej({FAR}, a=2.0, v=0.5)")
    dashboard = Dashboard(controller)
    _run(controller, 1.0)
    assert dashboard.reply("pause") == "Pausing program"
    joints = _run(controller, 1.0)
    assert joints[-1, 0] == joints[-200, 0]
    assert dashboard.reply("play") == "Starting program"
    _run_until_stopped(controller)
    assert controller.robot.mover.joints == (1.0, *HOME[1:])


def test_after_a_protective_stop_play_takes_the_interrupted_move_up_again() -> None:
    controller = _controller(f"movej({FAR}, a=2.0, v=0.5)")
    dashboard = Dashboard(controller)
    _run(controller, 1.0)
    controller.protective_stop("the test asks for it")
    joints = _run(controller, 4.9)
    assert joints[-1, 0] == joints[100, 0]
    assert dashboard.reply("unlock protective stop") == TOO_EARLY
    _run(controller, 0.1)
    assert dashboard.reply("play") == "Failed to execute: play"
    assert dashboard.reply("unlock protective stop") == "Protective stop releasing"
    assert (_run(controller, 0.5)[:, 0] == joints[-1, 0]).all()
    assert dashboard.reply("play") == "Starting program"
    _run_until_stopped(controller)
    assert controller.robot.mover.joints == (1.0, *HOME[1:])


def test_a_watchdog_stops_a_program_whose_input_falls_silent() -> None:
    move = "while True: speedl([0, 0.02, 0, 0, 0, 0], 0.5, t=0.002) end"
    controller = _controller(f'rtde_set_watchdog("input_int_register_0", 10, "stop") {move}')
    for _ in range(20):
        _run(controller, 0.09)
        controller.robot.written["input_int_register_0"] = controller.robot.cycles
    assert _state(controller) is RuntimeState.PLAYING
    _run(controller, 0.11)
    assert _state(controller) is RuntimeState.STOPPED
    _run(controller, 0.1)
    assert controller.robot.mover.at_rest


@pytest.mark.parametrize(
    "script",
    [
        "movej([0, 0, 0, 0, 0])",
        "movel([1, 2])",
        "set_tcp(p[0, 0, 0, 0, 0, 1e999])",
        "force_mode(1)",
    ],
)
def test_bad_arguments_stop_the_program_where_the_arm_stands(script: str) -> None:
    controller = _controller(script)
    joints = _run(controller, 0.1)
    assert controller.player.state is RuntimeState.STOPPED
    assert (joints == HOME).all()
    assert "stopped: line 2" in controller.robot.log[-1]


def test_a_secondary_program_runs_beside_the_first_and_must_not_move() -> None:
    controller = _controller("while True: sync() end")
    for body in ("write_output_integer_register(1, 7)", "movej([0, 0, 0, 0, 0, 0])"):
        controller.player.start(controller.player.translate(f"sec s():\n{body}\nend\n"))
    joints = _run(controller, 0.1)
    assert controller.robot.results.ints[1] == 7
    assert (joints == HOME).all()
    assert controller.player.state is RuntimeState.PLAYING
