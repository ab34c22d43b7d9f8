"""The real ur_rtde against the mocked controller: the force sensor, contact, outputs."""

import time
from functools import partial
from typing import Any

import numpy as np
import pytest
from rtde_io import RTDEIOInterface

from tests.support.ur_process import HOME, PLANE, TURN, UrProcess, wait_until

pytestmark = pytest.mark.usefixtures("at_home")


def test_moving_until_contact_ends_at_the_surface(receive: Any, control: Any) -> None:
    assert control.zeroFtSensor()
    assert control.moveUntilContact([0.0, 0.0, -0.05, 0.0, 0.0, 0.0])
    assert receive.getActualTCPPose()[2] == pytest.approx(PLANE, abs=1e-4)
    assert not control.toolContact([0.0, 0.0, 1.0, 0.0, 0.0, 0.0])


def test_contact_is_felt_along_the_motion_only(receive: Any, control: Any) -> None:
    pose = receive.getActualTCPPose()
    assert control.moveL([*pose[:2], PLANE - 0.001, *pose[3:]], 0.1, 1.0)
    down, up = [0.0, 0.0, -1.0, 0.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0, 0.0, 0.0]
    for direction, felt in ((down, True), (up, False), ([0.0] * 6, True)):
        control.toolContact(direction)
        time.sleep(0.05)
        assert bool(control.toolContact(direction)) is felt
    assert receive.getActualTCPForce()[2] > 15.0


def test_zeroing_takes_the_bias_out(receive: Any, control: Any) -> None:
    raw = np.array(receive.getFtRawWrench())
    assert control.zeroFtSensor()
    time.sleep(0.05)
    forces = []
    for _ in range(50):
        forces.append(receive.getActualTCPForce())
        time.sleep(0.004)
    assert np.abs(raw[:3]).max() > 0.3
    assert np.abs(np.mean(forces, axis=0)[:3]).max() < 0.2
    assert 0.01 < np.std(forces, axis=0)[:3].max() < 0.2


def test_steady_a_while_after_a_move(control: Any) -> None:
    assert control.moveJ((HOME + 0.1 * TURN).tolist(), 3.0, 10.0)
    assert not control.isSteady()
    wait_until(control.isSteady)


def test_outputs_are_switched_by_their_masks(mock: UrProcess, receive: Any) -> None:
    outputs = RTDEIOInterface(mock.host)
    switched = 0
    switches = (
        (outputs.setToolDigitalOut, 0, 16),
        (outputs.setToolDigitalOut, 1, 17),
        (outputs.setStandardDigitalOut, 3, 3),
        (outputs.setConfigurableDigitalOut, 2, 10),
    )
    for switch, index, bit in switches:
        switched |= 1 << bit
        assert switch(index, True)
        wait_until(partial(_reads, receive, switched))
    assert outputs.setSpeedSlider(0.5)
    wait_until(lambda: receive.getTargetSpeedFraction() == 0.5)
    assert outputs.setSpeedSlider(1.0)
    wait_until(lambda: receive.getTargetSpeedFraction() == 1.0)
    outputs.disconnect()


def _reads(receive: Any, bits: int) -> bool:
    return bool(receive.getActualDigitalOutputBits() == bits)
