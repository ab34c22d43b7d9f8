"""The live page, served in a thread while it is asked for."""

import threading
from collections.abc import Iterator
from contextlib import contextmanager

from harness.live_view.server import LiveFrames, LiveServer


@contextmanager
def served(frames: LiveFrames) -> Iterator[LiveServer]:
    """A server at a free port, shut down and waited for at the end."""
    server = LiveServer(frames)
    thread = threading.Thread(target=server.run)
    thread.start()
    try:
        yield server
    finally:
        server.shutdown()
        thread.join()
