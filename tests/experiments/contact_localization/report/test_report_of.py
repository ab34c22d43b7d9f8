"""What the report says of a world that differs from the model: every value in a row, in a few digits."""

import pytest

from harness.report.run_page import _said, flat


def test_a_tree_of_values_is_a_row_for_each_leaf() -> None:
    tree = {"gap": "default", "sound": {"modes": 13, "room": {"seconds": 0.4}}, "scale": 1.0}
    rows = [("gap", "default"), ("sound.modes", 13), ("sound.room.seconds", 0.4), ("scale", 1.0)]
    assert list(flat(tree)) == rows


@pytest.mark.parametrize(
    ("value", "said"),
    [(0.123456, "0.1235"), ([0.0, -0.0, -1e-6], "0, 0, -1e-06"), (13, "13"), ("exact", "exact")],
)
def test_a_value_is_said_in_four_digits_and_nothing_is_not_less_than_nothing(
    value: object, said: str
) -> None:
    assert _said(value) == said
