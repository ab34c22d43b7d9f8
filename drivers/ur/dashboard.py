"""The controller's dashboard port, by a plain socket: the second way to stop the arm.

Each call makes a connection of its own, so it works from any thread, in a signal handler,
and whatever state ur_rtde is in (Universal Robots, Dashboard Server e-Series, port 29999).
"""

import socket
from typing import Final

from harness.basics.errors import BenchFault

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
