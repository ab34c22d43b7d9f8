"""A TCP relay on a loopback address, as ``ssh -L`` or ``socat`` make one; it notes what it carries."""

import contextlib
import secrets
import select
import socket
import threading
from collections import defaultdict
from typing import Self

from tests.support.ur_process import PORTS


class Relay:
    """The controller's ports on another address.

    Args:
        target: the address that they lead to.
    """

    def __init__(self, target: str) -> None:
        self.address = "127." + ".".join(str(1 + secrets.randbelow(254)) for _ in range(3))  #: of the relay.
        self.sent: defaultdict[int, bytes] = defaultdict(bytes)
        """bytes that were sent to each port of the target."""
        self._target = target
        self._closing = False
        self._listeners = {port: socket.create_server((self.address, port)) for port in PORTS}
        self._threads: list[threading.Thread] = []

    def __enter__(self) -> Self:
        for port in self._listeners:
            self._begin(self._accept, port)
        return self

    def __exit__(self, *_: object) -> None:
        self._closing = True
        for listener in self._listeners.values():
            listener.shutdown(socket.SHUT_RDWR)
            listener.close()
        for thread in self._threads:
            thread.join(30.0)

    def _begin(self, work: object, *arguments: object) -> None:
        assert callable(work)
        thread = threading.Thread(target=work, args=arguments, daemon=True)
        self._threads.append(thread)
        thread.start()

    def _accept(self, port: int) -> None:
        with contextlib.suppress(OSError):
            while True:
                near, _ = self._listeners[port].accept()
                self._begin(self._carry, port, near)

    def _carry(self, port: int, near: socket.socket) -> None:
        with contextlib.suppress(OSError), near, socket.create_connection((self._target, port)) as far:
            while not self._closing:
                for source in select.select([near, far], [], [], 0.05)[0]:
                    data = source.recv(1 << 16)
                    if not data:
                        return
                    if source is near:
                        self.sent[port] += data
                    (far if source is near else near).sendall(data)
