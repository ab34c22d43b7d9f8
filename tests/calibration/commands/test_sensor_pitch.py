"""``touchstone calibrate taxim`` in pictures: the pitch is that of the sensor's file."""

from pathlib import Path

import numpy as np
import pytest

from calibration.taxim.pictures import Pictures
from calibration.taxim.result import identify
from harness.basics.errors import WrongUse
from harness.bench.sensor import sensor_path
from tests.samples.drawn_presses import press_set

_MINI = 0.0634e-3


def _pictures(rows: int, columns: int) -> Pictures:
    rest = np.full((rows, columns, 3), 120, np.uint8)
    return press_set([rest, rest], rest)


def _pitch(sensor: str | None, rows: int, columns: int, pitch: float | None = None) -> float:
    who = identify(sensor, "unknown", "", pitch, 2e-3, None, None, _pictures(rows, columns))
    return float(who.pitch)


@pytest.mark.parametrize(("rows", "reduced"), [(240, 1.0), (120, 2.0), (80, 3.0), (480, 0.5)])
def test_the_pitch_is_the_sensors_for_any_reduction_of_its_pictures(
    rows: int, reduced: float, tmp_path: Path
) -> None:
    assert _pitch("gelsight-mini", rows, rows * 4 // 3) == pytest.approx(reduced * _MINI, rel=0.005)
    copy = tmp_path / "mine.toml"
    copy.write_text(sensor_path("gelsight-mini").read_text())
    assert _pitch(str(copy), rows, rows * 4 // 3) == pytest.approx(reduced * _MINI, rel=0.005)


def test_a_stated_pitch_and_a_name_of_no_file_are_used_as_they_are() -> None:
    assert _pitch("gelsight-mini", 240, 320, 0.05e-3) == pytest.approx(0.05e-3)
    assert _pitch("my gel", 240, 320) == pytest.approx(0.1245e-3)


def test_cropped_pictures_and_a_missing_file_are_refused() -> None:
    with pytest.raises(WrongUse, match=r"240 x 240.*320 x 240.*--pitch"):
        _pitch("gelsight-mini", 240, 240)
    with pytest.raises(WrongUse, match=r"nosuch\.toml"):
        _pitch("nosuch.toml", 240, 320)
