"""Ports 30001 to 30003: programs arrive as text and run once they are whole.

Translation takes some tens of milliseconds and happens in a worker thread, so that the cycle
goes on. The state that these ports also send on a real controller is not sent: clients that want
it use the real-time data exchange.
"""

import asyncio
from concurrent.futures import ThreadPoolExecutor
from typing import Final

from mocks.ur.connection import Connection
from mocks.ur.controller import Controller
from mocks.ur.urscript.errors import ScriptError
from mocks.ur.urscript.tokens import whole_length

LONGEST_PROGRAM: Final = 1 << 20


class ScriptServer:
    """Runs what arrives, in order of arrival.

    Attributes:
        connections: open ones.
    """

    def __init__(self, controller: Controller) -> None:
        self.connections: set[ScriptConnection] = set()
        self._controller = controller
        self._worker = ThreadPoolExecutor(max_workers=1, thread_name_prefix="translate")
        self._tasks: set[asyncio.Task[None]] = set()

    def submit(self, text: str) -> None:
        """Translate a program, then start it."""
        task = asyncio.get_running_loop().create_task(self._run(text))
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)

    async def close(self) -> None:
        """End the worker; what was not translated yet is not run."""
        self._worker.shutdown(wait=False, cancel_futures=True)
        for task in self._tasks:
            task.cancel()
        await asyncio.gather(*self._tasks, return_exceptions=True)

    async def _run(self, text: str) -> None:
        controller = self._controller
        try:
            program = await asyncio.get_running_loop().run_in_executor(
                self._worker, controller.player.translate, text
            )
        except ScriptError as error:
            controller.complain(f"a program was refused: {error}")
            return
        if controller.robot.remote:
            controller.player.start(program)
        else:
            controller.complain("a program was refused: the pendant is in local control")


class ScriptConnection(Connection):
    """One client."""

    def __init__(self, server: ScriptServer) -> None:
        super().__init__()
        self._server = server
        self._waiting = ""

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """A client has come."""
        super().connection_made(transport)
        self._server.connections.add(self)

    def connection_lost(self, error: Exception | None) -> None:
        """It has gone; what it left unfinished is not run."""
        super().connection_lost(error)
        self._server.connections.discard(self)

    def data_received(self, data: bytes) -> None:
        """Run every whole program."""
        self._waiting += data.decode("utf-8", "replace")
        while length := whole_length(self._waiting):
            text, self._waiting = self._waiting[:length], self._waiting[length:]
            if text.strip():
                self._server.submit(text)
        if len(self._waiting) > LONGEST_PROGRAM:
            self.abort()
