"""A disk that loses, at a power cut, what no program flushed."""

import os
import stat
from pathlib import Path

import pytest


class PowerCut:
    """Notes what is flushed from now on: of a file its bytes, of a folder the names in it.

    That is what POSIX promises of a disk: bytes that were never flushed may be gone, and so may a name, new
    or renamed, in a folder that was not flushed after it. Linux alone, where a descriptor can be read again.
    """

    def __init__(self, patch: pytest.MonkeyPatch) -> None:
        self._bytes: dict[int, bytes] = {}
        self._names: dict[int, dict[str, int]] = {}
        self._held: list[int] = []
        self._flush = os.fsync
        patch.setattr(os, "fsync", self._fsync)

    def left_of(self, folder: Path, into: Path) -> Path:
        """Write what a power cut now would leave of a folder into another one, which is made."""
        into.mkdir()
        for name, number in self._names.get(folder.stat().st_ino, {}).items():
            if number in self._names or (folder / name).is_dir():
                self.left_of(folder / name, into / name)
            else:
                (into / name).write_bytes(self._bytes.get(number, b""))
        return into

    def close(self) -> None:
        """Let the files go."""
        for descriptor in self._held:
            os.close(descriptor)

    def _fsync(self, descriptor: int) -> None:
        self._flush(descriptor)
        # Held open, so that no later file gets this one's number.
        self._held.append(os.dup(descriptor))
        about = os.fstat(descriptor)
        again = Path(f"/proc/self/fd/{descriptor}")
        if stat.S_ISDIR(about.st_mode):
            self._names[about.st_ino] = {entry.name: entry.stat().st_ino for entry in again.iterdir()}
        else:
            self._bytes[about.st_ino] = again.read_bytes()
