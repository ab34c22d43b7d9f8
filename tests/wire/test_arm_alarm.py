"""A gel camera that dies while the arm moves: the motion ends then, and not at the next picture."""

import threading
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from drivers.camera.http_camera import HttpCamera, gelsight
from drivers.ur.arm import UrArm
from harness.basics.arrays import ByteArray
from harness.basics.errors import MotionEnded
from harness.bench.sensor import GELSIGHT_R15
from mocks.camera.gelsight_stream import MjpegServer
from mocks.faults import Fault
from tests.support.arm_bench import DOWN, FAR, READY, FarEnd, InFlight, comes_to_rest, make_arm

SHAPE = (GELSIGHT_R15.rows, GELSIGHT_R15.columns, 3)


class Grey:
    """A view of nothing."""

    def state(self) -> int:
        return 0

    def picture(self) -> ByteArray:
        return np.full(SHAPE, 128, np.uint8)

    def sent(self) -> None:
        """Nobody waits for it."""


@pytest.fixture
def server() -> Iterator[MjpegServer]:
    served = MjpegServer("127.0.0.1", 0, Grey(), 25.0)
    stop = threading.Event()
    thread = threading.Thread(target=served.serve, args=(stop.is_set,))
    thread.start()
    yield served
    stop.set()
    thread.join()


@pytest.fixture
def gel(server: MjpegServer) -> Iterator[HttpCamera]:
    camera = gelsight(f"http://127.0.0.1:{server.port}/?action=stream", GELSIGHT_R15)
    camera.open()
    yield camera
    camera.close()


@pytest.fixture
def far_end() -> Iterator[FarEnd]:
    end = FarEnd()
    yield end
    end.close()


@pytest.fixture
def arm(far_end: FarEnd, gel: HttpCamera, tmp_path: Path) -> Iterator[UrArm]:
    arm = make_arm(far_end.address, tmp_path, patience=0.5, alarm=lambda: gel.health().failure)
    arm.open()
    yield arm
    arm.close()


@pytest.mark.parametrize("kind", ["drop", "stall", "truncate"])
def test_a_dead_gel_camera_ends_a_motion_and_lets_the_arm_go_back(
    arm: UrArm, far_end: FarEnd, server: MjpegServer, kind: str
) -> None:
    motion = InFlight(arm)
    server.fault.set(Fault("gel", kind))
    error = motion.join()
    assert isinstance(error, MotionEnded)
    assert "joint motion" in str(error)
    assert comes_to_rest(far_end, 1.0, FAR)
    resting = far_end.joints()
    with pytest.raises(MotionEnded, match="gel"):
        arm.move_until_contact(DOWN, 0.01, 3.0, 0.01)
    assert np.array_equal(far_end.joints(), resting)
    arm.move_joints(READY, 0.3, 1.5)
    assert np.abs(far_end.joints() - READY).max() < 1e-6


def test_a_camera_that_comes_back_lets_the_arm_search(
    arm: UrArm, gel: HttpCamera, server: MjpegServer
) -> None:
    server.fault.set(Fault("gel", "drop", 0.3))
    while not gel.health().failure:
        pass
    while gel.health().failure:
        pass
    assert not arm.move_until_contact(DOWN, 0.02, 3.0, 0.004)


def test_a_frozen_gel_camera_lets_no_search_begin(
    arm: UrArm, gel: HttpCamera, far_end: FarEnd, server: MjpegServer
) -> None:
    """A picture that never changes would hide a contact: named within three seconds, and no search begins."""
    server.fault.set(Fault("gel", "freeze"))
    end = time.monotonic() + 3.0
    while not gel.health().failure and time.monotonic() < end:
        time.sleep(0.02)
    resting = far_end.joints()
    with pytest.raises(MotionEnded, match="gel"):
        arm.move_until_contact(DOWN, 0.01, 3.0, 0.01)
    assert np.array_equal(far_end.joints(), resting)
