"""What the report says of a world that differs from the model: every value in a row, in a few digits."""

import pytest

from experiments.contact_localization.report.report import SweepPoint, _by_seconds
from harness.effects.accuracy import Accuracy
from harness.report.run_page import _said, flat
from harness.report.values import Missing
from tests.support.localization import dials


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


def test_a_run_without_sound_answers_by_touch_whatever_its_levels_say() -> None:
    def by(*tried: Accuracy) -> list[str]:
        curves = _by_seconds(tuple(SweepPoint("", accuracy, 1.0, 1.0) for accuracy in tried))
        assert not isinstance(curves, Missing)
        return [curve.by for curve in curves]

    assert by(dials(senses="both")) == ["touch"]
    heard = dials(senses="audio"), dials(senses="both"), dials(senses="touch", method="particle")
    assert by(*heard) == ["audio", "both", "particle"]
