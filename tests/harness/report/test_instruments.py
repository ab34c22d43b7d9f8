"""Rows of instruments and artefacts: samples counted as the box counts them, ages from dates."""

from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from harness.bench.acquisition import shipped_acquisition
from harness.bench.acquisition_channels import BLOCK, FLAGS, FORCE, PRESSURE, block_channel
from harness.bench.device import Channel, Health, Reading
from harness.bench.station_file import load_station, station_path
from harness.recording.run_folder import RunFiles
from harness.report.run_page import artefacts, instruments, samples
from harness.report.values import Missing
from harness.sim.optics.tactile_calibration import shipped_calibration

BOX = shipped_acquisition("acquisition_bench")


def reading(name: str, count: int) -> Reading:
    values = np.zeros((count, BLOCK), np.int32)
    return Reading(block_channel(name, BLOCK, 50_000.0), np.arange(float(count)), values)


def poses(count: int) -> Reading:
    return Reading(
        Channel("arm.joints", "rad", (6,), "float64"), np.arange(float(count)), np.zeros((count, 6))
    )


def run(box: Any = BOX) -> RunFiles:
    readings = {FORCE: reading(FORCE, 4), PRESSURE: reading(PRESSURE, 3), "arm.joints": poses(70)}
    recording = SimpleNamespace(
        steps=lambda: [SimpleNamespace(readings=readings)] * 2,
        header=SimpleNamespace(created="2026-11-11T00:00:00+00:00"),
    )
    made = SimpleNamespace(
        recording=recording,
        station=load_station(station_path("mock")),
        calibration=shipped_calibration("gelsight_r15_bench"),
        acquisition=box,
    )
    return cast(RunFiles, made)


def test_a_block_of_the_box_is_as_many_samples_as_it_holds() -> None:
    assert samples(reading(FORCE, 4)) == 4 * BLOCK
    assert samples(poses(70)) == 70
    remark = Reading(Channel(FLAGS, "1", (5,), "float64"), np.zeros(1), np.zeros((1, 5)))
    assert samples(remark) == 0


def test_the_box_is_one_row_with_both_channels_and_its_nominal_rate() -> None:
    health = {
        "arm": Health("arm", "a UR5e", 499.9, 0, 1e-3),
        "hammer": Health("hammer", "a DI-2108", 50_001.0, 2, None, "crystal +20 ppm"),
    }
    rows = instruments(run(), health)
    assert not isinstance(rows, Missing)
    assert [(row.name, row.readings) for row in rows] == [
        ("arm", 2 * 70),
        ("hammer and microphone", 2 * 7 * BLOCK),
    ]
    assert [row.nominal_rate for row in rows] == [500.0, 50_000.0]
    assert (rows[1].rate, rows[1].drops, rows[1].remark) == (50_001.0, 2, "crystal +20 ppm")


def test_a_microphone_with_a_box_of_its_own_has_a_row_of_its_own() -> None:
    health = {name: Health(name, "", 48_000.0, 0, None) for name in ("hammer", "microphone")}
    rows = instruments(run(), health)
    assert not isinstance(rows, Missing)
    assert [(row.name, row.readings) for row in rows] == [
        ("hammer", 2 * 4 * BLOCK),
        ("microphone", 2 * 3 * BLOCK),
    ]


def test_a_replay_has_no_instruments() -> None:
    assert isinstance(instruments(run(), None), Missing)


def test_the_boxs_calibration_is_listed_where_the_run_was_heard() -> None:
    gel, box = artefacts(run())
    assert gel.name.startswith("tactile optics")
    assert box.sha256 == BOX.hash
    for serial in (BOX.serial, BOX.hammer_serial, BOX.microphone_serial):
        assert serial in box.serial
    assert box.made == BOX.date == "2026-11-01"
    assert box.age_days == pytest.approx(10.0)
    assert box.residual.startswith("2.0 %")
    assert [one.name for one in artefacts(run(None))] == [gel.name]
