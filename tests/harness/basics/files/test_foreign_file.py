"""Files that somebody else wrote are read within bounds, or refused in a sentence that names them."""

import struct
import tracemalloc
import zipfile
from pathlib import Path

import numpy as np
import pytest

from harness.basics.errors import CalibrationRefused, DataRefused, WrongUse
from harness.basics.files import foreign_file
from harness.basics.files.foreign_file import read_bounded, refused_as, require_unpackable
from harness.basics.npz_file import read_array, read_arrays, write_array, write_arrays
from harness.basics.toml_file import read_toml
from harness.picture.image_file import read_image
from tests.support.hostile_files import make_hostile_files

BOUND = 2**28
"""Bytes that a refusal may take."""


@pytest.fixture(scope="module")
def hostile(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    return make_hostile_files(tmp_path_factory.mktemp("files") / "hostile")


def test_an_archive_that_unpacks_to_gigabytes_is_not_unpacked(hostile: dict[str, Path]) -> None:
    path = hostile["zeros.npz"]
    assert path.stat().st_size < 5e6
    tracemalloc.start()
    with pytest.raises(CalibrationRefused, match=r"zeros\.npz .*4,096 MiB"):
        read_arrays(path, "a calibration")
    assert tracemalloc.get_traced_memory()[1] < BOUND
    tracemalloc.stop()


@pytest.mark.parametrize("name", ["stated.npy", "nested.npy", "objects.npy", "text.png", "zeros.npz"])
def test_an_array_that_is_none(hostile: dict[str, Path], name: str) -> None:
    tracemalloc.start()
    with pytest.raises(DataRefused, match=name):
        read_array(hostile[name], "a height map")
    assert tracemalloc.get_traced_memory()[1] < BOUND
    tracemalloc.stop()
    assert not Path("executed").exists()


@pytest.mark.parametrize("name", ["text.npz", "cut.npz", "broken.3mf", "archive.pth"])
def test_an_archive_of_other_things(hostile: dict[str, Path], name: str) -> None:
    with pytest.raises(CalibrationRefused, match=name):
        read_arrays(hostile[name], "a calibration")


def test_arrays_read_back(tmp_path: Path) -> None:
    arrays = {"a": np.arange(6.0).reshape(2, 3), "b": np.array("text")}
    write_arrays(tmp_path / "some.npz", arrays, compressed=True)
    again = read_arrays(tmp_path / "some.npz", "some arrays")
    assert again.keys() == arrays.keys()
    assert all(np.array_equal(again[name], arrays[name]) for name in arrays)
    write_array(tmp_path / "one", np.asfortranarray(arrays["a"]))
    assert np.array_equal(read_array(tmp_path / "one.npy", "an array"), arrays["a"])


@pytest.mark.parametrize("name", ["stated.png", "vast.png", "large.png", "stated.jpg"])
def test_a_picture_of_more_pixels_than_a_camera_has_is_not_unpacked(
    hostile: dict[str, Path], name: str
) -> None:
    with pytest.raises(DataRefused, match=rf"{name} .*33,554,432"):
        read_image(hostile[name])


@pytest.mark.parametrize(
    ("name", "why"),
    [
        ("deep.toml", "32 deep"),
        ("deep_tables.toml", "32 deep"),
        ("many.toml", "1 MiB"),
        ("zero.toml", "device"),
        ("folder.obj", "directory"),
        ("absent.toml", "no such file"),
    ],
)
def test_text_that_no_person_wrote(hostile: dict[str, Path], name: str, why: str) -> None:
    with pytest.raises(WrongUse, match=why):
        read_toml(hostile[name])


def test_a_file_of_many_values_is_not_one_of_ours(tmp_path: Path) -> None:
    path = tmp_path / "many.toml"
    path.write_text("".join(f"k{n}=1\n" for n in range(10_001)))
    with pytest.raises(WrongUse, match="10,000 values"):
        read_toml(path)


def test_a_file_is_read_up_to_its_bound(tmp_path: Path) -> None:
    path = tmp_path / "some"
    path.write_bytes(bytes(100))
    assert read_bounded(path, "a file", 100) == bytes(100)
    with pytest.raises(DataRefused, match="some"):
        read_bounded(path, "a file", 99)


def test_our_own_refusals_go_through() -> None:
    with pytest.raises(WrongUse, match="ours"), refused_as(DataRefused, "theirs"):
        raise WrongUse("ours")
    with pytest.raises(DataRefused, match="theirs"), refused_as(DataRefused, "theirs"):
        raise RecursionError


@pytest.mark.parametrize(
    ("listed", "place", "fits"),
    [(None, None, True), (2**24, None, False), (None, 0, False)],
    ids=["as torch writes it", "a list too long", "a record elsewhere"],
)
def test_an_archive_of_zip64_is_bounded_by_its_own_record(
    tmp_path: Path, listed: int | None, place: int | None, fits: bool
) -> None:
    path = tmp_path / "some.zip"
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("a.bin", bytes(10))
    data = path.read_bytes()
    end = data.rfind(b"PK\x05\x06")
    count, size, start = struct.unpack("<HLL", data[end + 10 : end + 20])
    size = size if listed is None else listed
    record = struct.pack("<4sQ2H2L4Q", b"PK\x06\x06", 44, 45, 45, 0, 0, count, count, size, start)
    locator = struct.pack("<4sLQL", b"PK\x06\x07", 0, end if place is None else place, 1)
    path.write_bytes(data[:end] + record + locator + data[end:])
    if fits:
        require_unpackable(path, "an archive")
    else:
        with pytest.raises(DataRefused, match="members"):
            require_unpackable(path, "an archive")


@pytest.mark.parametrize(("sizes", "fits"), [([400, 400], True), ([400, 400, 400], False), ([1100], False)])
def test_the_members_of_an_archive_are_counted_together(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, sizes: list[int], fits: bool
) -> None:
    """Each member below the limit, all of them above it."""
    monkeypatch.setattr(foreign_file, "MOST_DATA", 1000)
    path = tmp_path / "some.zip"
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for number, size in enumerate(sizes):
            archive.writestr(f"{number}.bin", bytes(size))
    if fits:
        require_unpackable(path, "an archive")
    else:
        with pytest.raises(DataRefused, match=r"some\.zip .* MiB"):
            require_unpackable(path, "an archive")
