"""One program per arm: a lock file for each robot address."""

import fcntl
import os
import re
import tempfile
from pathlib import Path

from harness.errors import BenchFault


def lock_path(address: str, folder: Path | None = None) -> Path:
    """The lock file of the arm at ``address``; shared by all users of this computer."""
    name = re.sub(r"[^0-9A-Za-z.]", "-", address)
    return (folder or Path(tempfile.gettempdir())) / f"touchstone-arm-{name}.lock"


def take(address: str, folder: Path | None = None) -> int:
    """The descriptor that holds the lock until it is closed, here and in any child given it.

    Raises:
        BenchFault: another program owns this arm.
    """
    path = lock_path(address, folder)
    descriptor = os.open(path, os.O_RDWR | os.O_CREAT | os.O_NOFOLLOW | os.O_CLOEXEC, 0o666)
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        owner = os.read(descriptor, 32).decode(errors="replace").strip() or "unknown"
        os.close(descriptor)
        raise BenchFault(
            f"the arm at {address} is owned by another program (process {owner}, lock {path}); "
            "two programs must not drive one arm: end that one first"
        ) from None
    os.ftruncate(descriptor, 0)
    os.pwrite(descriptor, f"{os.getpid()}\n".encode(), 0)
    return descriptor
