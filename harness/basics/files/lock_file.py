"""Locks on files and folders that end with the process that took them, also when it is killed."""

import fcntl
import os
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from harness.basics.errors import WrongUse
from harness.basics.whole_file import make_folder

FOLDER_LOCK = ".in-use.lock"
"""Name of the lock file in a folder that a program writes to; it is removed when the program is done."""

_RETRY_INTERVAL = 0.02
"""Seconds between two attempts at a lock."""


def take_lock(path: Path, attempts: int = 1) -> int | None:
    """Lock a file, creating it where it is missing, and write this process's number into it.

    Args:
        path: lock file; its folder must exist.
        attempts: number of attempts, 20 ms apart.

    Returns:
        The descriptor, which holds the lock until it is closed here and in every child that inherited it.
        None where another process holds the lock.
    """
    for attempt in range(attempts):
        if attempt:
            time.sleep(_RETRY_INTERVAL)
        while True:
            descriptor = os.open(path, os.O_RDWR | os.O_CREAT | os.O_NOFOLLOW | os.O_CLOEXEC, 0o666)
            if not _lock(descriptor):
                os.close(descriptor)
                break
            if _has_name(path, descriptor):
                os.ftruncate(descriptor, 0)
                os.pwrite(descriptor, f"{os.getpid()}\n".encode(), 0)
                return descriptor
            os.close(descriptor)  # another process removed the file between opening and locking
    return None


def release_lock(path: Path, descriptor: int) -> None:
    """Remove a lock file that this process holds, and free its lock."""
    if _has_name(path, descriptor):
        with suppress(OSError):
            path.unlink()
    os.close(descriptor)


def remove_unheld(path: Path) -> None:
    """Remove this user's lock file if no living process holds it."""
    try:
        descriptor = os.open(path, os.O_RDWR | os.O_NOFOLLOW | os.O_CLOEXEC)
    except OSError:  # it was removed meanwhile, or belongs to another user
        return
    try:
        is_mine = os.fstat(descriptor).st_uid == os.getuid()
        # Only a lock file that still has its name is removed, and only while it is locked here.
        if is_mine and _lock(descriptor) and _has_name(path, descriptor):
            path.unlink()
    finally:
        os.close(descriptor)


def read_owner(path: Path) -> str:
    """Read the number of the process that took a lock: ``"process 1234"``, or ``"another program"``."""
    try:
        number = path.read_text(encoding="ascii", errors="replace").strip()[:32]
    except OSError:
        number = ""
    return f"process {number}" if number.isdigit() else "another program"


@contextmanager
def hold_folder(folder: Path, advice: str = "wait for it to end, or name another folder") -> Iterator[None]:
    """Hold a folder for one writer, creating it where it is missing.

    Nothing but the lock is removed at the end, and the folder itself where this call created it and
    nothing was put there.

    Args:
        folder: written to in the block.
        advice: end of the refusal: what the operator can do.

    Raises:
        WrongUse: another process, or another block of this one, is writing to the folder.
    """
    path, is_new = folder / FOLDER_LOCK, False
    while True:
        is_new = is_new or not folder.is_dir()
        make_folder(folder)
        try:
            descriptor = take_lock(path)
            break
        except FileNotFoundError:  # its creator was refused and removed the empty folder
            continue
    if descriptor is None:
        raise WrongUse(f"{read_owner(path)} is writing to {folder}; {advice}")
    try:
        yield
    finally:
        release_lock(path, descriptor)
        if is_new:
            with suppress(OSError):  # it is not empty: the block wrote there
                folder.rmdir()


@contextmanager
def hold_briefly(path: Path) -> Iterator[None]:
    """Hold a lock file for an action that takes moments; waits up to 5 s for another process.

    Raises:
        WrongUse: another process still holds it then.
    """
    descriptor = take_lock(path, attempts=250)
    if descriptor is None:
        raise WrongUse(f"{read_owner(path)} has held {path} for 5 s; wait for it to end, then try again")
    try:
        yield
    finally:
        release_lock(path, descriptor)


def _lock(descriptor: int) -> bool:
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    return True


def _has_name(path: Path, descriptor: int) -> bool:
    try:
        return os.path.samestat(path.stat(follow_symlinks=False), os.fstat(descriptor))
    except FileNotFoundError:
        return False
