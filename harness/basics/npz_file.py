"""Arrays in ``.npz`` and ``.npy`` files, written whole and read without pickles, within bounds."""

from collections.abc import Collection, Mapping
from pathlib import Path
from zipfile import is_zipfile

import numpy as np

from harness.basics.arrays import AnyArray
from harness.basics.errors import CalibrationRefused, DataRefused, TouchstoneError
from harness.basics.files.foreign_file import MOST_DATA, refused_as, require_readable, require_unpackable
from harness.basics.whole_file import whole_file


def write_arrays(path: Path, arrays: Mapping[str, AnyArray], compressed: bool = False) -> None:
    """Write an archive, whole or not at all; the same arrays give the same bytes."""
    save = np.savez_compressed if compressed else np.savez
    with whole_file(path) as stream:
        save(stream, allow_pickle=False, **arrays)


def write_array(path: Path, array: AnyArray) -> None:
    """Write an ``.npy`` file, whole or not at all; a name without that ending gets it, as numpy does it."""
    with whole_file(path if path.suffix == ".npy" else path.with_name(f"{path.name}.npy")) as stream:
        np.save(stream, array, allow_pickle=False)


def read_arrays(
    path: Path,
    what: str,
    wanted: Collection[str] | None = None,
    advice: str = "",
    refused: type[TouchstoneError] = CalibrationRefused,
) -> dict[str, AnyArray]:
    """Arrays by their names in the file.

    Args:
        path: of the file.
        what: it is, for people.
        wanted: names that are read; None for all that there are.
        advice: after the error of a file of another kind.
        refused: the class of what is raised.

    Raises:
        TouchstoneError: of the class ``refused``: missing, no such archive, one that unpacks to more than
            ``MOST_DATA``, or without an array that is wanted.
    """
    if not path.is_file():
        raise refused(f"{path} does not read as {what}: there is no such file{advice}")
    if not is_zipfile(path):
        raise refused(f"{path} does not read as {what}: it is no .npz archive{advice}")
    with refused_as(refused, f"{path} does not read as {what}: {_DAMAGED}{advice}"):
        require_unpackable(path, what, refused)
        with np.load(path, allow_pickle=False) as archive:
            names = archive.files if wanted is None else wanted
            missing = set(names) - set(archive.files)
            if missing:
                raise refused(f"{path} has no {sorted(missing)}; {what} holds {sorted(names)}")
            arrays = {name: archive[name] for name in names}
    if not all(isinstance(array, np.ndarray) for array in arrays.values()):
        raise refused(f"{path} does not read as {what}: it holds other things than arrays{advice}")
    return arrays


def read_array(path: Path, what: str, refused: type[TouchstoneError] = DataRefused) -> AnyArray:
    """The array of an ``.npy`` file.

    Raises:
        WrongUse: no file, or none that may be read.
        TouchstoneError: of the class ``refused``: no such array, or a longer one than any.
    """
    require_readable(path, what, MOST_DATA, refused)
    with refused_as(refused, f"{path} does not read as {what}: it is no .npy file of numbers, or {_DAMAGED}"):
        # Mapped, so that a head that states more numbers than there are takes no memory.
        return np.array(np.lib.format.open_memmap(path, mode="r"))


_DAMAGED = "cut short, damaged, or of other things than numbers"
