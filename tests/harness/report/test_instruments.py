"""Rows of instruments and calibrations: counts of samples, ages from dates."""

import numpy as np

from harness.bench.acquisition_channels import BLOCK, FLAGS, FORCE
from harness.bench.device import Channel, Health, Reading
from harness.experiment.report_content import Missing, ReportTable
from harness.report.run_page import count_samples, list_calibrations, list_instruments
from harness.report.wording import NONE
from tests.harness.report.conftest import BOX, poses, reading, stub_run


def rows_of(health: dict[str, Health]) -> list[list[str]]:
    table = list_instruments(stub_run(), health)
    assert isinstance(table, ReportTable)
    return [[str(cell) for cell in row] for row in table.rows]


def test_a_block_of_the_box_is_as_many_samples_as_it_holds() -> None:
    assert count_samples(reading(FORCE, 4)) == 4 * BLOCK
    assert count_samples(poses(70)) == 70
    remark = Reading(Channel(FLAGS, "1", (5,), "float64"), np.zeros(1), np.zeros((1, 5)))
    assert count_samples(remark) == 0


def test_the_box_is_one_row_with_both_channels_and_its_nominal_rate() -> None:
    health = {
        "arm": Health("arm", "a UR5e", 499.9, 0, 1e-3),
        "hammer": Health("hammer", "a DI-2108", 50_001.0, 2, None, "crystal +20 ppm"),
    }
    assert rows_of(health) == [
        ["arm", "a UR5e", str(2 * 70), "499.9 Hz", "500 Hz", "0", "1 ms", ""],
        [
            *("hammer and microphone", "a DI-2108", str(2 * 7 * BLOCK), "50.001 kHz", "50 kHz"),
            *("2", NONE, "crystal +20 ppm"),
        ],
    ]


def test_a_microphone_with_a_box_of_its_own_has_a_row_of_its_own() -> None:
    health = {name: Health(name, "", 48_000.0, 0, None) for name in ("hammer", "microphone")}
    assert [(row[0], row[2]) for row in rows_of(health)] == [
        ("hammer", str(2 * 4 * BLOCK)),
        ("microphone", str(2 * 3 * BLOCK)),
    ]


def test_a_replay_has_no_instruments() -> None:
    assert isinstance(list_instruments(stub_run(), None), Missing)


def test_the_boxs_calibration_is_listed_where_the_run_was_heard() -> None:
    gel, box = list_calibrations(stub_run()).rows
    assert str(gel[0]).startswith("tactile optics")
    assert box[5] == BOX.hash[:12]
    for serial in (BOX.serial, BOX.hammer_serial, BOX.microphone_serial):
        assert serial in str(box[1])
    assert box[2] == BOX.date == "2026-11-01"
    assert box[3] == "10 days"
    assert str(box[4]).startswith("2.0 %")
    assert list(list_calibrations(stub_run(None)).rows) == [gel]
