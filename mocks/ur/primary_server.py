"""Port 30011: what the controller reports unasked, to clients that only read.

From the manual of the primary client interface (Universal Robots). Of its messages only the key messages
are sent, at the start and at the end of each main program; they carry the program's name. The state that
a real controller sends ten times a second is not.
"""

import asyncio
import struct
from typing import Final

from mocks.ur.connection import Connection
from mocks.ur.controller import Controller

_ROBOT_MESSAGE: Final = 20
_SOURCE: Final = -3
_KEY_MESSAGE: Final = 7
_LENGTH: Final = struct.Struct(">i")
_HEAD: Final = struct.Struct(">BQbBiiB")
"""Package type, time stamp in us, source, message type, code, argument, length of the title."""


def key_message(time: float, title: str, text: str) -> bytes:
    """One package; ``time`` in s on the controller's clock."""
    name = title.encode()
    head = _HEAD.pack(_ROBOT_MESSAGE, round(1e6 * time), _SOURCE, _KEY_MESSAGE, 0, 0, len(name))
    body = head + name + text.encode()
    return _LENGTH.pack(_LENGTH.size + len(body)) + body


class PrimaryServer:
    """All clients of the port."""

    def __init__(self, controller: Controller) -> None:
        self.connections: set[PrimaryConnection] = set()
        self._controller = controller
        controller.player.listeners.append(self._publish)

    def _publish(self, event: str, program: str) -> None:
        message = key_message(self._controller.robot.time, f"PROGRAM_XXX_{event}", program)
        for connection in self.connections:
            connection.send(message)


class PrimaryConnection(Connection):
    """One client; what it sends is ignored."""

    def __init__(self, server: PrimaryServer) -> None:
        super().__init__()
        self._server = server

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """A client has come."""
        super().connection_made(transport)
        self._server.connections.add(self)

    def connection_lost(self, error: Exception | None) -> None:
        """It has gone."""
        super().connection_lost(error)
        self._server.connections.discard(self)
