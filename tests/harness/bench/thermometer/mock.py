"""A toy far end: a warm room at the other end of a line."""

import contextlib
import socket
import time

from mocks.far_ends import LabBench
from mocks.lab_processes import ChildPipe, FarEnd, LabChild

KELVIN = 294.5


def start_thermometer(name: str, lab: LabBench) -> FarEnd:
    listener = socket.create_server((lab.address, 0))

    def serve(line: ChildPipe) -> None:
        listener.settimeout(0.1)
        line.ready()
        while not line.should_stop():
            with contextlib.suppress(OSError):
                client, _ = listener.accept()
                while not line.should_stop() and line.fault() is None:
                    client.sendall(f"{KELVIN}\n".encode())
                    time.sleep(0.1)
                client.close()

    child = LabChild(name, serve, f"{lab.address}:{listener.getsockname()[1]}", ("unplug",))
    listener.close()
    return child
