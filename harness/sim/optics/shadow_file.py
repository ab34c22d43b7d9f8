"""Shadow tables as Taxim publishes them: lists of grey levels by channel, direction and depth.

The published file keeps its ragged lists as Python objects. Loading those would run what the file
says; here they are only looked at: the opcodes of such a file are walked, lists are counted where they
begin and the numbers in them taken from their bytes.
"""

import pickletools
from pathlib import Path
from zipfile import ZipFile

import numpy as np
from numpy.lib import format as npy_format

from harness.basics.arrays import FloatArray, IntArray, read_only
from harness.basics.errors import CalibrationRefused
from harness.basics.files.foreign_file import refused_as, require_unpackable
from harness.basics.npz_file import read_arrays
from harness.basics.whole_file import whole_file
from harness.sim.optics.shadow import ShadowTable

SHALLOWEST = -0.2e-3
"""Metres: the first row as the published program reads it, 0.4 mm less the six rows it adds."""

_CHANNELS = 3
_DIRECTIONS, _TURN = 63, 0.1
_DEPTHS, _DEPTH = 9, 0.1e-3
_OWN_LISTS = 1
_FLOAT = np.dtype("<f8")
_NOTES = frozenset({"BINPUT", "LONG_BINPUT", "MEMOIZE"})
_REFERS = frozenset({"BINGET", "LONG_BINGET"})
_WORDS = frozenset(
    {"numpy", "numpy.core.multiarray", "numpy._core.multiarray", "_reconstruct", "ndarray", "dtype", "scalar"}
    | {"O8", "f8", "|", "<"}
)
"""All that the file of an object array of lists of float64 has to name."""

_TYPE_STATE = (3, 0, -1)
"""The whole numbers that belong to a type and not to a list: its version, and sizes that it leaves open."""


def read_shadow_table(path: Path, shallowest: float = SHALLOWEST) -> ShadowTable:
    """Read ``shadowTable.npz``, or one of plain arrays ``directions``, ``lengths`` and ``values``.

    The published lists are blue first, as ``cv2.imread`` gave them; they are turned to RGB here.

    Args:
        path: of the file.
        shallowest: metres, where the first row of depths begins; the files do not say.

    Raises:
        CalibrationRefused: missing, incomplete, or lists of another kind.
    """
    if not path.is_file():
        raise CalibrationRefused(f"{path} does not read as a shadow table: there is no such file")
    with refused_as(CalibrationRefused, f"{path} does not read as a shadow table: cut short or damaged"):
        require_unpackable(path, "a shadow table", CalibrationRefused)
        with ZipFile(path) as archive:
            names = {name.removesuffix(".npy") for name in archive.namelist()}
            if {"directions", "lengths", "values"} <= names:
                parts = _plain(path)
            elif {"shadowDirections", "shadowTable"} <= names:
                parts = _published(archive)
            else:
                raise CalibrationRefused(
                    f"{path} holds {sorted(names)}; a shadow table holds shadowDirections and shadowTable"
                )
    directions, lengths, values = parts
    lists = np.split(values, np.cumsum(lengths.ravel())[:-1])
    rgb = np.arange(lengths.size).reshape(lengths.shape)[::-1].ravel()
    turned = np.concatenate([lists[at] for at in rgb])
    return ShadowTable(read_only(directions), read_only(lengths[::-1].copy()), read_only(turned), shallowest)


def write_shadow_table(table: ShadowTable, path: Path) -> None:
    """Write shadows as Taxim publishes them: 63 directions 0.1 rad apart, nine depths, blue first.

    A row of depths is that of the table where the file's row has its middle; directions are the nearest.

    Args:
        table: of the sensor.
        path: ending in ``.npz``.
    """
    lists = np.empty((_CHANNELS, _DIRECTIONS, _DEPTHS), dtype=object)
    towards = (np.arange(_DIRECTIONS) * _TURN).astype(np.float64)
    row_of = (SHALLOWEST + (np.arange(_DEPTHS) + 0.5) * _DEPTH - table.shallowest) / table.depth_step
    starts = np.concatenate([[0], np.cumsum(table.lengths.ravel())]).reshape(-1)[:-1]
    starts = starts.reshape(table.lengths.shape)
    for c, d, k in np.ndindex(lists.shape):
        apart = (table.directions - towards[d] + np.pi) % (2.0 * np.pi) - np.pi
        nearest, row = int(np.argmin(np.abs(apart))), min(int(row_of[k]), table.lengths.shape[2] - 1)
        first = starts[c, nearest, max(row, 0)]
        length = table.lengths[c, nearest, row] if row_of[k] >= 0.0 else 0
        lists[_CHANNELS - 1 - c, d, k] = [float(v) for v in table.values[first : first + length]]
    with whole_file(path) as stream:
        np.savez(stream, shadowDirections=towards, shadowTable=lists)


def _plain(path: Path) -> tuple[FloatArray, IntArray, FloatArray]:
    names = ("directions", "lengths", "values")
    arrays = read_arrays(path, "a shadow table", names)
    directions, lengths, values = (arrays[name] for name in names)
    _check_lengths(lengths.shape, len(directions))
    if int(lengths.sum()) != len(values):
        raise CalibrationRefused(f"{path}: {int(lengths.sum())} samples are listed and {len(values)} came")
    return directions.astype(np.float64), lengths.astype(np.int64), values.astype(np.float64)


def _published(archive: ZipFile) -> tuple[FloatArray, IntArray, FloatArray]:
    with archive.open("shadowDirections.npy") as file:
        directions = npy_format.read_array(file, allow_pickle=False).astype(np.float64)
    with archive.open("shadowTable.npy") as file:
        version = npy_format.read_magic(file)
        shape, by_column, kind = (
            npy_format.read_array_header_1_0(file) if version == (1, 0) else ((), True, None)
        )
        if kind != np.dtype(object) or by_column:
            raise CalibrationRefused(
                f"shadowTable.npy is {kind}, {shape}; lists in the order of rows are wanted"
            )
        _check_lengths(shape, len(directions))
        lists = _lists_in(file.read())
    if len(lists) != int(np.prod(shape)):
        raise CalibrationRefused(f"shadowTable.npy has {len(lists)} lists where {shape} were announced")
    lengths = np.array([len(one) for one in lists], dtype=np.int64).reshape(shape)
    return directions, lengths, np.array([level for one in lists for level in one])


def _check_lengths(shape: tuple[int, ...], directions: int) -> None:
    if len(shape) != 3 or shape[:2] != (_CHANNELS, directions) or directions < 2:
        raise CalibrationRefused(f"shadow lists are {shape}, for {directions} directions of 3 channels")


def _lists_in(stream: bytes) -> list[list[float]]:
    """The innermost lists of numbers of a pickled object array, in order; nothing is run."""
    lists: list[list[float]] = []
    known: dict[int, float] = {}
    bytes_of, made, noted = None, None, 0
    for opcode, argument, _ in pickletools.genops(stream):
        _check_word(opcode.name, argument, len(lists) > _OWN_LISTS)
        if opcode.name == "EMPTY_LIST":
            lists.append([])
        elif isinstance(argument, float):
            lists[-1].append(argument)
        elif isinstance(argument, bytes) and len(argument) == _FLOAT.itemsize:
            bytes_of = float(np.frombuffer(argument, _FLOAT)[0])
        elif opcode.name == "REDUCE" and bytes_of is not None:
            lists[-1].append(bytes_of)
            made, bytes_of = bytes_of, None
        elif opcode.name in _NOTES:
            # A number that occurs twice as one object is written once and then referred to.
            if made is not None:
                known[noted if argument is None else int(argument)] = made
            made, noted = None, noted + 1
        elif opcode.name in _REFERS and argument in known:
            lists[-1].append(known[int(argument)])
    # The array's own list of items is the first one.
    return lists[_OWN_LISTS:]


def _check_word(opcode: str, argument: object, among_lists: bool) -> None:
    words = argument.split() if isinstance(argument, str) else []
    foreign = [word for word in words if word not in _WORDS]
    number = among_lists and isinstance(argument, int) and opcode.startswith("BININT")
    if foreign or (number and argument not in _TYPE_STATE):
        raise CalibrationRefused(
            f"shadowTable.npy holds {foreign[0] if foreign else argument!r}; lists of float64 are read, and "
            "nothing else"
        )
