"""What the controller does that this driver did not ask for: another's program, numbers that are none."""

import threading
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from drivers.ur.arm import UrArm
from harness.basics.arrays import FloatArray
from harness.basics.errors import BenchFault, SafetyStop, TouchstoneError
from harness.basics.geometry import translation
from tests.support.arm_bench import READY, FarEnd, comes_to_rest, make_arm

SPEED = 0.25
"""m/s of the arm's line and of the other program's."""

LONGEST = 0.040
"""m that the flange may still go once another's program runs."""

CYCLE = 0.002
"""s of the controller."""

LINE = "movel(pose_trans(get_actual_tcp_pose(), p[0, 0, -0.3, 0, 0, 0]), a=1.2, v=0.25)"
RISE = "while True: speedl([0, 0, 0.25, 0, 0, 0], 5, t=0.002) end"
PROGRAMS = {
    "a line": f"def intruder():\n{LINE}\nend\n",
    "a speed, sent on": f"def intruder():\n{RISE}\nend\n",
    "under this driver's name": f"def rtde_control():\n{RISE}\nend\n",
    "statements without a name": f"{LINE}\n",
}


@pytest.fixture(scope="module")
def far_end() -> Iterator[FarEnd]:
    end = FarEnd()
    yield end
    end.close()


@pytest.fixture
def arm(far_end: FarEnd, tmp_path: Path) -> Iterator[UrArm]:
    """At rest in the ready posture; its watchdog is patient, so that what ends a motion is what is tested."""
    arm = make_arm(far_end.address, tmp_path, patience=0.5)
    arm.open()
    arm.move_joints(READY, 0.5, 2.0)
    yield arm
    arm.close()


class Line:
    """A line to the side in a thread of its own, at ``SPEED`` once this is made, and how it ended."""

    def __init__(self, arm: UrArm) -> None:
        self.error: TouchstoneError | None = None
        start = arm.state().base_from_flange
        self._thread = threading.Thread(target=self._move, args=(arm, start))
        self._thread.start()
        while arm.state().base_from_flange[1, 3] < start[1, 3] + 0.05:
            assert self._thread.is_alive(), f"the line ended before it was at speed: {self.error!r}"
            time.sleep(0.002)

    def _move(self, arm: UrArm, start: FloatArray) -> None:
        try:
            arm.move_line(translation(np.array([0.0, 0.45, 0.0])) @ start, SPEED, 1.5)
        except TouchstoneError as error:
            self.error = error

    def join(self) -> TouchstoneError | None:
        self._thread.join()
        return self.error


def way_after_the_line(arm: UrArm) -> float:
    """m that the flange went after the last cycle at the line's own velocity: there another program began."""
    steps = np.diff(arm.history(5.0)[1].values[:, :3], axis=0)
    own = np.linalg.norm(steps - np.array([0.0, SPEED * CYCLE, 0.0]), axis=1) < 1e-3 * SPEED * CYCLE
    last = int(np.flatnonzero(own)[-1])
    return float(np.linalg.norm(steps[last + 1 :], axis=1).sum())


@pytest.mark.parametrize("program", PROGRAMS)
def test_another_program_in_mid_motion_is_stopped_within_40_mm_and_latches(
    arm: UrArm, far_end: FarEnd, program: str
) -> None:
    line = Line(arm)
    far_end.program(PROGRAMS[program])
    error = line.join()
    assert isinstance(error, SafetyStop)
    assert "straight line" in str(error)
    assert comes_to_rest(far_end, 1.0)
    time.sleep(0.1)
    assert way_after_the_line(arm) < LONGEST
    resting = far_end.joints()
    with pytest.raises(SafetyStop, match=r"straight line.*program"):
        arm.move_joints(READY, 0.2, 1.0)
    assert np.array_equal(far_end.joints(), resting)


def test_another_program_at_rest_is_stopped_and_latches_and_opening_again_mends_it(
    arm: UrArm, far_end: FarEnd
) -> None:
    far_end.program(PROGRAMS["a line"])
    while "true" in far_end.ask("running"):
        time.sleep(0.005)
    assert comes_to_rest(far_end, 1.0)
    with pytest.raises(SafetyStop, match="'intruder'"):
        arm.move_joints(READY + 0.02, 0.2, 1.0)
    arm.close()
    arm.open()
    arm.move_joints(READY + 0.02, 0.2, 1.0)


def test_a_force_that_is_no_number_stops_the_arm_and_latches(arm: UrArm, far_end: FarEnd) -> None:
    line = Line(arm)
    far_end.cue("broken_force_sensor", 0.5)
    error = line.join()
    assert isinstance(error, BenchFault)
    assert "actual_TCP_force [nan" in str(error)
    assert comes_to_rest(far_end, 1.0)
    resting = far_end.joints()
    time.sleep(0.5)
    with pytest.raises(BenchFault, match="actual_TCP_force"):
        arm.move_joints(READY, 0.2, 1.0)
    assert np.array_equal(far_end.joints(), resting)
