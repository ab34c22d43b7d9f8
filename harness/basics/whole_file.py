"""Files that are on the disk whole or not at all."""

import os
import secrets
import shutil
from collections.abc import Collection, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import BinaryIO

_NAME_LENGTH = 50
"""Characters of a file's name that its temporary file keeps: file systems allow 255 bytes in all."""


def sync_folder(folder: Path) -> None:
    """Flush a folder's entries to the disk, so that a rename survives a power cut."""
    descriptor = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def make_folder(folder: Path) -> None:
    """Make a folder with those above it, each flushed to the disk; nothing where it is there."""
    if folder.is_dir():
        return
    make_folder(folder.parent)
    folder.mkdir(exist_ok=True)
    sync_folder(folder.parent)


@contextmanager
def whole_file(path: Path) -> Iterator[BinaryIO]:
    """Open a temporary file that replaces ``path``, flushed to the disk, when the block ends.

    Readers see the old file or the new one. If the block fails, nothing is left of the temporary file, whose
    name belongs to this call alone: several processes may write the same path, and the last one wins. A link
    stays a link, and a device is written to directly.

    Raises:
        OSError: with the path, which a full disk's own error does not name.
    """
    path = Path(os.path.realpath(path))
    part = path.with_name(f".{path.name[:_NAME_LENGTH]}.{os.getpid()}-{secrets.token_hex(4)}.part")
    try:
        if path.exists() and not path.is_file():
            with path.open("wb") as stream:
                yield stream
            return
        with part.open("xb") as stream:
            yield stream
            stream.flush()
            os.fsync(stream.fileno())
        part.replace(path)
        sync_folder(path.parent)
    except OSError as error:
        part.unlink(missing_ok=True)
        if error.filename is not None:
            raise
        raise OSError(error.errno, error.strerror, str(path)) from error
    except BaseException:
        part.unlink(missing_ok=True)
        raise


def write_text_whole(path: Path, text: str) -> None:
    """A text file, whole or not at all."""
    write_bytes_whole(path, text.encode("utf-8"))


def write_bytes_whole(path: Path, data: bytes) -> None:
    """The same of a file's bytes."""
    with whole_file(path) as stream:
        stream.write(data)


@contextmanager
def removed_on_failure(folder: Path, names: Collection[str]) -> Iterator[None]:
    """Remove the named entries of a folder if the block fails, and the folder if it is new and then empty.

    Entries that were there before the block are kept. Other entries belong to another program and are kept.
    """
    before = {name for name in names if os.path.lexists(folder / name)}
    is_new = not folder.is_dir()
    try:
        yield
    except BaseException:
        for name in names:
            if name in before:
                continue
            path = folder / name
            if path.is_dir() and not path.is_symlink():
                shutil.rmtree(path, ignore_errors=True)
            else:
                path.unlink(missing_ok=True)
        if is_new:
            with suppress(OSError):  # another program wrote there meanwhile
                folder.rmdir()
        raise
