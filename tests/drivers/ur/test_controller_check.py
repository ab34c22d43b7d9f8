"""A controller is used only if it is the stated model, in remote control, normal and powered."""

import sys
from types import ModuleType

import pytest

from drivers.ur.dashboard import checked_controller
from harness.basics.errors import BenchFault, ProtectiveStop


class Board:
    """A dashboard client that answers from class attributes."""

    model, remote, mode, safety = "UR5", True, "Robotmode: RUNNING", "Safetystatus: NORMAL"
    stopped = 0

    def __init__(self, address: str) -> None:
        self.address = address

    def connect(self, timeout: int) -> None:
        pass

    def getSerialNumber(self) -> str:  # noqa: N802 (the library's name)
        return "00001234567\n"

    def getRobotModel(self) -> str:  # noqa: N802
        return f"{type(self).model}\n"

    def polyscopeVersion(self) -> str:  # noqa: N802
        return "5.11.0\n"

    def isInRemoteControl(self) -> bool:  # noqa: N802
        return type(self).remote

    def robotmode(self) -> str:
        return type(self).mode

    def safetystatus(self) -> str:
        return type(self).safety

    def stop(self) -> None:
        type(self).stopped += 1


@pytest.fixture
def board(monkeypatch: pytest.MonkeyPatch) -> type[Board]:
    class Fresh(Board):
        """One test's own answers."""

    module = ModuleType("dashboard_client")
    module.DashboardClient = Fresh  # type: ignore[attr-defined]
    monkeypatch.setitem(sys.modules, "dashboard_client", module)
    return Fresh


@pytest.mark.parametrize(
    ("controller", "stated"), [("UR5", "ur5e"), ("UR5e", "ur5e"), ("UR5", "UR5"), ("UR10", "ur10e")]
)
def test_the_dashboard_may_leave_out_the_e(board: type[Board], controller: str, stated: str) -> None:
    board.model = controller
    identity = checked_controller("127.0.0.1", stated)
    assert (identity.model, identity.serial, identity.version) == (controller, "00001234567", "5.11.0")
    assert board.stopped == 1


@pytest.mark.parametrize(("controller", "stated"), [("UR10", "ur5e"), ("UR5", "ur10e"), ("UR3", "ur5e")])
def test_another_model_is_refused(board: type[Board], controller: str, stated: str) -> None:
    board.model = controller
    with pytest.raises(BenchFault, match=f"{stated}.*127.0.0.1.*{controller}"):
        checked_controller("127.0.0.1", stated)
    assert board.stopped == 0


def test_local_control_is_refused(board: type[Board]) -> None:
    board.remote = False
    with pytest.raises(BenchFault, match="local control"):
        checked_controller("127.0.0.1", "ur5e")
    assert board.stopped == 0


@pytest.mark.parametrize("mode", ["Robotmode: POWER_OFF", "Robotmode: IDLE", "Robotmode: BOOTING"])
def test_an_arm_without_power_is_refused(board: type[Board], mode: str) -> None:
    board.mode = mode
    with pytest.raises(BenchFault, match="power"):
        checked_controller("127.0.0.1", "ur5e")
    assert board.stopped == 0


def test_a_stopped_arm_is_refused(board: type[Board]) -> None:
    board.safety = "Safetystatus: PROTECTIVE_STOP"
    with pytest.raises(ProtectiveStop, match="PROTECTIVE_STOP"):
        checked_controller("127.0.0.1", "ur5e")
