"""The arrays of an ``.npz`` file, written whole and read without pickles."""

from collections.abc import Collection, Mapping
from pathlib import Path
from zipfile import BadZipFile, is_zipfile

import numpy as np

from harness.basics.arrays import AnyArray
from harness.basics.errors import CalibrationRefused
from harness.basics.whole_file import whole_file


def write_arrays(path: Path, arrays: Mapping[str, AnyArray], compressed: bool = False) -> None:
    """Write an archive, whole or not at all; the same arrays give the same bytes."""
    save = np.savez_compressed if compressed else np.savez
    with whole_file(path) as stream:
        save(stream, allow_pickle=False, **arrays)


def read_arrays(
    path: Path, what: str, wanted: Collection[str] | None = None, advice: str = ""
) -> dict[str, AnyArray]:
    """Arrays by their names in the file.

    Args:
        path: of the file.
        what: it is, for people.
        wanted: names that are read; None for all that there are.
        advice: after the error of a file of another kind.

    Raises:
        CalibrationRefused: missing, no such archive, or without an array that is wanted.
    """
    if path.is_file() and not is_zipfile(path):
        raise CalibrationRefused(f"{path} does not read as {what}: it is no .npz archive{advice}")
    try:
        with np.load(path, allow_pickle=False) as archive:
            names = archive.files if wanted is None else wanted
            missing = set(names) - set(archive.files)
            if missing:
                raise CalibrationRefused(f"{path} has no {sorted(missing)}; {what} holds {sorted(names)}")
            return {name: archive[name] for name in names}
    except (OSError, EOFError, ValueError, BadZipFile) as error:
        raise CalibrationRefused(f"{path} does not read as {what}: {error}") from error
