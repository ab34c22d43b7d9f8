"""The artefact: what is written is what is read, or it is refused."""

import dataclasses
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from harness.basics.errors import CalibrationRefused
from harness.sim.optics.tactile_calibration import (
    ColourMisfit,
    TactileCalibration,
    load_calibration,
    save_calibration,
    shipped_calibration,
    with_background,
)


@pytest.fixture(scope="module")
def bench() -> TactileCalibration:
    return shipped_calibration("gelsight_r15_bench")


def test_it_reads_back_as_it_was_written(bench: TactileCalibration, tmp_path: Path) -> None:
    save_calibration(bench, tmp_path / "a.npz")
    again = load_calibration(tmp_path / "a.npz")
    assert again.header == bench.header
    assert again.sha256 == bench.sha256
    assert all(np.array_equal(again.arrays[name], array) for name, array in bench.arrays.items())
    save_calibration(again, tmp_path / "b.npz")
    assert (tmp_path / "a.npz").read_bytes() == (tmp_path / "b.npz").read_bytes()


def test_a_misfit_is_stated_where_it_was_measured_alone(bench: TactileCalibration, tmp_path: Path) -> None:
    """Files of before it was measured keep their bytes, and so their hash."""
    save_calibration(bench, tmp_path / "a.npz")
    assert bench.header.misfit is None
    assert "misfit" not in str(np.load(tmp_path / "a.npz")["header"])
    measured = dataclasses.replace(
        bench, header=dataclasses.replace(bench.header, misfit=ColourMisfit(4.0, 0.2))
    )
    save_calibration(measured, tmp_path / "b.npz")
    assert load_calibration(tmp_path / "b.npz").header == measured.header
    assert measured.sha256 != bench.sha256


@pytest.mark.parametrize(
    ("rms", "alike"), [(np.nan, 0.2), (-1.0, 0.2), (np.inf, 0.2), (1.0, 0.0), (1.0, np.nan)]
)
def test_a_misfit_that_cannot_be_is_refused(rms: float, alike: float) -> None:
    with pytest.raises(CalibrationRefused, match="misfit"):
        ColourMisfit(rms, alike)


def test_the_two_that_are_shipped_saw_different_presses(bench: TactileCalibration) -> None:
    world = shipped_calibration("gelsight_r15_world")
    seen = [{int(n) for n in c.header.made_from.split("presses ")[1].split(",")} for c in (bench, world)]
    assert not seen[0] & seen[1]
    assert len(seen[0] | seen[1]) == 49
    assert bench.sha256 != world.sha256


def test_every_bit_counts(bench: TactileCalibration) -> None:
    table = bench.table.copy()
    table[3, 4, 5, 1] = np.nextafter(table[3, 4, 5, 1], np.float32(1e9))
    assert dataclasses.replace(bench, table=table).sha256 != bench.sha256
    header = dataclasses.replace(bench.header, serial="another")
    assert dataclasses.replace(bench, header=header).sha256 != bench.sha256


def _rewrite(path: Path, **changes: Any) -> None:
    with np.load(path, allow_pickle=False) as archive:
        arrays = {name: archive[name] for name in archive.files}
    for name, value in changes.items():
        arrays.pop(name)
        if value is not None:
            arrays[name] = value
    np.savez(path, **arrays)


def _header(path: Path, **changes: Any) -> Any:
    with np.load(path, allow_pickle=False) as archive:
        outer = json.loads(str(archive["header"]))
    outer["header"].update(changes)
    return np.array(json.dumps(outer))


def test_what_was_tampered_with_is_refused(bench: TactileCalibration, tmp_path: Path) -> None:
    path = tmp_path / "c.npz"
    bad = bench.table.copy()
    bad[0, 0, 0, 0] = np.nan
    cases: list[tuple[str, Any]] = [
        ("not what was written", {"background": 255 - bench.background}),
        ("holds", {"support": None}),
        ("finite", {"table": bad}),
        ("table .*float64", {"table": bench.table.astype(np.float64)}),
        ("schema 99", {"header": {"schema": 99}}),
        ("RGB", {"header": {"channel_order": "BGR"}}),
        ("header .*mood", {"header": {"mood": "good"}}),
        ("pitch -1", {"header": {"pitch": -1.0}}),
    ]
    for words, change in cases:
        save_calibration(bench, path)
        if "header" in change:
            change = {"header": _header(path, **change["header"])}
        _rewrite(path, **change)
        with pytest.raises(CalibrationRefused, match=words):
            load_calibration(path)


def test_what_is_no_calibration_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "d.npz"
    path.write_bytes(b"not an archive")
    with pytest.raises(CalibrationRefused, match=r"d\.npz .*archive"):
        load_calibration(path)
    with pytest.raises(CalibrationRefused, match=r"absent\.npz"):
        load_calibration(tmp_path / "absent.npz")
    with pytest.raises(CalibrationRefused, match=r"'gelsight_r16'.*gelsight_r15_bench"):
        shipped_calibration("gelsight_r16")


def test_an_array_alone_is_no_calibration(tmp_path: Path) -> None:
    np.save(tmp_path / "heights.npy", np.zeros((2, 3)))
    with pytest.raises(CalibrationRefused, match=r"heights\.npy .*\.npz"):
        load_calibration(tmp_path / "heights.npy")


def test_a_pickle_is_never_opened(bench: TactileCalibration, tmp_path: Path) -> None:
    path = tmp_path / "e.npz"
    save_calibration(bench, path)
    _rewrite(path, support=np.array([{"a": 1}], dtype=object))
    with pytest.raises(CalibrationRefused, match=r"\.npz .*numbers"):
        load_calibration(path)


def test_a_fresh_background_is_another_calibration(bench: TactileCalibration) -> None:
    fresh = with_background(bench, np.zeros_like(bench.background))
    assert fresh.sha256 != bench.sha256
    assert not fresh.background.any()
    with pytest.raises(CalibrationRefused, match="background"):
        with_background(bench, np.zeros((2, 2, 4), np.uint8))
