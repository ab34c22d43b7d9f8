"""The controller's dashboard port, by a plain socket: the second way to stop the arm.

Each call makes a connection of its own, so it works from any thread, in a signal handler,
and whatever state ur_rtde is in (Universal Robots, Dashboard Server e-Series, port 29999).
"""

import socket
from dataclasses import dataclass
from typing import Final

from drivers.ur.safety import require_mock
from harness.basics.errors import BenchFault, ProtectiveStop

PORT: Final = 29999
TIMEOUT: Final = 1.0


def ask(address: str, command: str, timeout: float = TIMEOUT) -> str:
    """The controller's one-line reply to a dashboard command.

    Raises:
        BenchFault: no connection or no reply within ``timeout`` s.
    """
    try:
        with socket.create_connection((address, PORT), timeout=timeout) as link:
            link.settimeout(timeout)
            lines = link.makefile("rwb")
            lines.readline()  # the greeting
            lines.write(command.encode() + b"\n")
            lines.flush()
            reply = lines.readline()
    except OSError as error:
        raise BenchFault(
            f"the dashboard at {address} port {PORT} did not answer '{command}' within {timeout:g} s "
            f"({error}); use the emergency stop if the arm still moves, then check the network cable "
            "of the control box"
        ) from error
    return reply.decode(errors="replace").strip()


def stop(address: str, timeout: float = TIMEOUT) -> bool:
    """Stop the controller's program; whether the controller said that it did."""
    return ask(address, "stop", timeout).startswith("Stopped")


@dataclass(frozen=True)
class ControllerLink:
    """What the controller says it is."""

    model: str
    serial: str
    version: str


def checked_controller(address: str, model: str) -> ControllerLink:
    """The controller's identity, a mock's model, remote control, power and safety; then end its program.

    A script left by a client that died keeps RTDEControlInterface's constructor waiting for
    minutes; the dashboard ends it at once.

    Raises:
        SafetyStop: it is no mock; it was only asked who it is.
        ProtectiveStop: it has stopped the arm.
        BenchFault: it is another model, in local control or without power, or its dashboard is silent.
    """
    from dashboard_client import DashboardClient

    board = DashboardClient(address)
    try:
        board.connect(2000)
        serial = board.getSerialNumber().strip()
        require_mock(address, serial)
        identity = ControllerLink(board.getRobotModel().strip(), serial, board.polyscopeVersion().strip())
        remote, mode, safety = board.isInRemoteControl(), board.robotmode(), board.safetystatus()
        # The dashboard names an e-Series arm without its e.
        if identity.model.lower().rstrip("e") != model.lower().rstrip("e"):
            raise BenchFault(
                f"the station says {model}; the controller at {address} is a {identity.model} "
                f"(serial {identity.serial}): correct the station file or the address"
            )
        _check_ready(remote, mode, safety, address)
        board.stop()
    except RuntimeError as error:
        raise BenchFault(
            f"the dashboard of the arm at {address} does not answer as a UR controller's should "
            f"({error}); check the address and the network cable of the control box"
        ) from error
    return identity


def _check_ready(remote: bool, mode: str, safety: str, address: str) -> None:
    if not remote:
        raise BenchFault(
            f"the arm at {address} is in local control; switch it to remote control at the top right "
            "of the pendant"
        )
    if not any(word in safety.upper() for word in ("NORMAL", "REDUCED")):
        raise ProtectiveStop(
            f"the arm at {address} is stopped ({safety}); look at the pendant for the cause, clear it "
            "and release the stop there"
        )
    if "RUNNING" not in mode.upper():
        raise BenchFault(
            f"the arm at {address} is not powered ({mode}); switch it on and release the brakes "
            "at the pendant"
        )
