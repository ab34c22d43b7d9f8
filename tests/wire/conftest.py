"""One mocked controller a module, spoken to by ur_rtde itself."""

from collections.abc import Iterator
from typing import Any

import pytest

from tests.support.idle_computer import idle_computer as idle_computer
from tests.support.ur_process import HOME, PLANE, UrProcess, wait_until


@pytest.fixture(scope="module")
def mock() -> Iterator[UrProcess]:
    """A controller whose tool can touch a plane."""
    with UrProcess("--plane", str(PLANE), "--seed", "3") as process:
        yield process


@pytest.fixture(scope="module")
def receive(mock: UrProcess) -> Iterator[Any]:
    """What the controller streams, at 500 Hz."""
    from rtde_receive import RTDEReceiveInterface

    interface = RTDEReceiveInterface(mock.host, 500.0)
    yield interface
    interface.disconnect()


@pytest.fixture(scope="module")
def control(mock: UrProcess, receive: Any) -> Iterator[Any]:
    """ur_rtde's own program, running on the controller."""
    from rtde_control import RTDEControlInterface

    interface = RTDEControlInterface(mock.host, 500.0)
    yield interface
    interface.stopScript()
    interface.disconnect()


@pytest.fixture
def at_home(control: Any) -> None:
    """The program runs, the tool is the flange, and the arm is where every test may begin."""
    if not control.isProgramRunning():
        assert control.reuploadScript()
        wait_until(control.isProgramRunning)
    assert control.setTcp([0.0] * 6)
    assert control.moveJ(HOME.tolist(), 2.0, 8.0)
