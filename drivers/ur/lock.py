"""One program per arm: a lock file for each robot address."""

import fcntl
import os
import re
import tempfile
import time
from pathlib import Path

from harness.basics.errors import BenchFault

_PREFIX, _SUFFIX = "touchstone-arm-", ".lock"

_GLANCES, _GLANCE = 10, 0.02
"""Times, and s between them, that a lock is asked for: others hold it for moments, to see if it is free."""


def lock_path(address: str, folder: Path | None = None) -> Path:
    """The lock file of the arm at ``address``; shared by all users of this computer."""
    name = re.sub(r"[^0-9A-Za-z.]", "-", address)
    return (folder or Path(tempfile.gettempdir())) / f"{_PREFIX}{name}{_SUFFIX}"


def take(address: str, folder: Path | None = None) -> int:
    """The descriptor that holds the lock until it is closed, here and in any child given it.

    The lock files of programs that ended, or were killed, are removed first.

    Raises:
        BenchFault: another program owns this arm.
    """
    path = lock_path(address, folder)
    remove_ownerless(path.parent)
    while True:
        descriptor = os.open(path, os.O_RDWR | os.O_CREAT | os.O_NOFOLLOW | os.O_CLOEXEC, 0o666)
        if not _locked(descriptor, _GLANCES):
            owner = os.read(descriptor, 32).decode(errors="replace").strip() or "unknown"
            os.close(descriptor)
            raise BenchFault(
                f"the arm at {address} is owned by another program (process {owner}, lock {path}); "
                "two programs must not drive one arm: end that one first"
            )
        if _names(path, descriptor):
            break
        os.close(descriptor)  # removed by another program between opening and locking
    os.ftruncate(descriptor, 0)
    os.pwrite(descriptor, f"{os.getpid()}\n".encode(), 0)
    return descriptor


def remove_ownerless(folder: Path) -> None:
    """Remove this user's lock files that no living process holds."""
    for path in folder.glob(f"{_PREFIX}*{_SUFFIX}"):
        try:
            descriptor = os.open(path, os.O_RDWR | os.O_NOFOLLOW | os.O_CLOEXEC)
        except OSError:  # another program removed it, or it is another user's
            continue
        try:
            mine = os.fstat(descriptor).st_uid == os.getuid()
            # Only a lock file that still has its name is removed, and only while it is locked here.
            if mine and _locked(descriptor) and _names(path, descriptor):
                path.unlink()
        finally:
            os.close(descriptor)


def _locked(descriptor: int, times: int = 1) -> bool:
    for _ in range(times - 1):
        if _locked(descriptor):
            return True
        time.sleep(_GLANCE)
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    return True


def _names(path: Path, descriptor: int) -> bool:
    """Whether the path still leads to the open file."""
    try:
        return os.path.samestat(path.stat(follow_symlinks=False), os.fstat(descriptor))
    except FileNotFoundError:
        return False
