"""Temporary folders that tell whether their owner still lives, so that what the dead left can be removed."""

import fcntl
import os
import shutil
import tempfile
from pathlib import Path

_OWNER = "owner.lock"


class OwnedFolder:
    """A new temporary folder, held until it is closed; a process that was killed holds nothing.

    Making one removes the folders of the same prefix, and the same user, whose owners are dead.

    Args:
        prefix: of the folder's name, for all folders of one purpose.
        parent: where; the computer's temporary folder where None.
    """

    def __init__(self, prefix: str, parent: Path | None = None) -> None:
        parent = parent or Path(tempfile.gettempdir())
        _remove_ownerless(prefix, parent)
        self.path = Path(tempfile.mkdtemp(prefix=prefix, dir=parent))
        # The lock on this descriptor shows that the owner lives; no child inherits it.
        part = self.path / f".{_OWNER}.part"
        self._held: int | None = os.open(part, os.O_RDWR | os.O_CREAT | os.O_EXCL | os.O_CLOEXEC, 0o600)
        fcntl.flock(self._held, fcntl.LOCK_EX)
        # Renamed once locked: a folder with an owner's lock that is free has lost its owner.
        part.rename(self.path / _OWNER)

    def close(self) -> None:
        """Remove the folder with all that is in it; may be called twice."""
        held, self._held = self._held, None
        if held is not None:
            shutil.rmtree(self.path, ignore_errors=True)
            os.close(held)


def _remove_ownerless(prefix: str, parent: Path) -> None:
    for folder in parent.glob(f"{prefix}*"):
        try:
            mine = not folder.is_symlink() and folder.stat().st_uid == os.getuid()
            lock = os.open(folder / _OWNER, os.O_RDWR | os.O_NOFOLLOW | os.O_CLOEXEC) if mine else None
        except OSError:  # it is not a held folder, or another program is removing it
            continue
        if lock is None:
            continue
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
            shutil.rmtree(folder, ignore_errors=True)
        except BlockingIOError:  # its owner lives
            continue
        finally:
            os.close(lock)
