"""Keys of JSON in words: every leaf of a tree is a row, with four digits and the unit of its key."""

import pytest

from harness.report.run_page import flatten
from harness.report.wording import format_key


def test_a_tree_of_values_is_a_row_for_each_leaf() -> None:
    tree = {"gap": "default", "sound": {"modes": 13, "room": {"seconds": 0.4}}, "scale": 1.0}
    rows = [("gap", "default"), ("sound.modes", 13), ("sound.room.seconds", 0.4), ("scale", 1.0)]
    assert list(flatten(tree)) == rows


@pytest.mark.parametrize(
    ("key", "value", "words"),
    [
        ("scale", 0.123456, ("scale", "0.1235", "")),
        ("sound.centre_m", [0.0, -0.0, -1e-9], ("sound: centre", "(0, 0, -1e-06)", "mm")),
        ("mesh_faces", 31444, ("mesh faces", "31444", "")),
        ("optics_level", "exact", ("optics level", "exact", "")),
        ("object_yaw_rad", 0.0175, ("object yaw", "1.003", "°")),
        ("extra_damping_per_s", 2.0, ("extra damping", "2", "1/s")),
        ("frequencies_hz", [1.0, 2.0, 3.0, 4.0, 5.5], ("frequencies", "5 values, from 1 to 5.5", "Hz")),
        ("is_round", True, ("is round", "yes", "")),
        ("rooms", ["hall", "booth"], ("rooms", "hall, booth", "")),
        ("speed_m_per_s", 0.25, ("speed", "0.25", "m/s")),
        ("calibration_sha256", "51732c5970f03ef9b5", ("calibration sha256", "51732c5970f0", "")),
    ],
)
def test_a_value_has_four_digits_and_its_unit_and_zero_has_no_sign(
    key: str, value: object, words: tuple[str, str, str]
) -> None:
    assert format_key(key, value) == words
