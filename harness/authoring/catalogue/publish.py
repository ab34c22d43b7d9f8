"""ObjectFiles of a build, copied to a folder or to any address that fsspec has a driver for."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path

from fsspec.core import url_to_fs
from fsspec.spec import AbstractFileSystem

from harness.authoring.catalogue.layout import BuildFolder, ObjectRecord, read_record, read_settings, stands
from harness.basics.errors import DataRefused, WrongUse
from harness.objects.builtin import DESCRIPTION


@dataclass(frozen=True)
class SentObject:
    """What became of one object."""

    name: str  #: of the object.
    outcome: str  #: ``"sent"``, ``"there"`` or ``"not built"``.
    bytes: int  #: number of sent bytes; 0 if complete before or not built.


class ObjectStore:
    """Where ObjectFiles are copied to; one whose ``object.json`` is there is whole.

    Args:
        url: a folder, or ``PROTOCOL://...`` of fsspec: s3, gs, sftp, memory.

    Raises:
        WrongUse: nobody knows the protocol, or its driver is not installed.
    """

    def __init__(self, url: str) -> None:
        try:
            found: tuple[AbstractFileSystem, str] = url_to_fs(url)
        except (ValueError, ImportError) as error:
            raise WrongUse(f"{url}: {error}; give a folder, or a URL whose driver is installed") from error
        self._system, self._root = found

    def put(self, folder: Path, record: ObjectRecord) -> int:
        """Copy one object; bytes sent.

        The description goes last, and an older one is taken away first: whatever stops the copy, an object
        with a description has all files that it names.

        Raises:
            DataRefused: a file is not the one that was built.
            OSError: the store refused it.
        """
        place = f"{self._root.rstrip('/')}/{record.name}"
        description = f"{place}/{DESCRIPTION}"
        with _named(description), suppress(FileNotFoundError):
            data: bytes = self._system.cat_file(description)
            if sha256(data).hexdigest() == record.object_json_sha256:
                return 0
        with _named(description):
            self._system.makedirs(place, exist_ok=True)
            if self._system.exists(description):
                self._system.rm_file(description)
        sums = {entry.file: entry.sha256 for entry in record.files}
        return sum(
            self._send(folder / name, f"{place}/{name}", expected)
            for name, expected in (*sums.items(), (DESCRIPTION, record.object_json_sha256))
        )

    def _send(self, path: Path, to: str, expected: str) -> int:
        data = path.read_bytes()
        if sha256(data).hexdigest() != expected:
            raise DataRefused(f"{path} is not the file that was built; build again, then publish")
        with _named(to):
            self._system.pipe_file(to, data)
        return len(data)


@contextmanager
def _named(path: str) -> Iterator[None]:
    """Failures of a store's driver, which come in any class, as those of a file."""
    try:
        yield
    except OSError:
        raise
    except Exception as error:
        raise OSError(f"{path}: {type(error).__name__}: {error}") from error


def publish(
    of: BuildFolder, store: ObjectStore, on: Callable[[str, float], None] = lambda *_: None
) -> list[SentObject]:
    """Copy every finished object of a build, which may be running, that is not in the store yet.

    ``on`` receives the name and the completed fraction before each object.

    Raises:
        WrongUse: nothing was built into the folder.
        DataRefused: a file is not the one that was built.
        OSError: the store refused a file; copied files remain, and the next call continues.
    """
    names = read_settings(of).names
    found = []
    for index, name in enumerate(names):
        on(name, index / len(names))
        record = read_record(of, name)
        if record is None or not stands(of, record, record.key):
            found.append(SentObject(name, "not built", 0))
            continue
        sent = store.put(of.object(name), record)
        found.append(SentObject(name, "sent" if sent else "there", sent))
    return found
