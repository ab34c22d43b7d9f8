"""One program per arm: a lock file for each robot address."""

import re
import tempfile
from pathlib import Path

from harness.basics.errors import BenchFault
from harness.basics.files.lock_file import read_owner, remove_unheld, take_lock

_PREFIX, _SUFFIX = "touchstone-arm-", ".lock"

_ATTEMPTS = 10
"""Attempts at a lock: other programs hold it for moments, to find out whether it is free."""


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
    descriptor = take_lock(path, _ATTEMPTS)
    if descriptor is None:
        raise BenchFault(
            f"the arm at {address} is owned by another program ({read_owner(path)}, lock {path}); "
            "two programs must not drive one arm: end that one first"
        )
    return descriptor


def remove_ownerless(folder: Path) -> None:
    """Remove this user's lock files that no living process holds."""
    for path in folder.glob(f"{_PREFIX}*{_SUFFIX}"):
        remove_unheld(path)
