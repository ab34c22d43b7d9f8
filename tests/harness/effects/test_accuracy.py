"""Accuracy: one level for every knob, chosen from those the knob has."""

import pytest

from harness.basics.errors import WrongUse
from harness.effects.accuracy import Accuracy, Knob, Level

GRID = Knob("touch.grid", (30, 60, 120), "px", "number", 60)
OPTICS = Knob("touch.optics", ("fast", "exact"), "", "method", "fast", removed={"rough": "fast"})
ZERO = Knob("rounds", (0, 1, 3), "", "number", 3)
KNOBS = (GRID, OPTICS, ZERO)


def test_default_chooses_a_level_for_every_knob() -> None:
    assert dict(Accuracy.default(KNOBS)) == {"touch.grid": 60, "touch.optics": "fast", "rounds": 3}


def test_a_change_leaves_the_other_knobs_and_the_original_alone() -> None:
    before = Accuracy.default(KNOBS)
    after = before.with_({"touch.grid": 120})
    assert (after["touch.grid"], after["touch.optics"]) == (120, "fast")
    assert before["touch.grid"] == 60
    with pytest.raises(TypeError):
        before.levels["touch.grid"] = 30  # type: ignore[index]


def test_an_operator_sets_knobs_in_text() -> None:
    chosen = Accuracy.default(KNOBS).with_texts(["touch.grid=120", "touch.optics = exact", "rounds=0"])
    assert dict(chosen) == {"touch.grid": 120, "touch.optics": "exact", "rounds": 0}


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("touch.gird=60", "'touch.gird'.*'touch.grid'"),
        ("touch.grid=61", r"61.0.*30, 60, 120 \(px\)"),
        ("touch.grid=many", "'many'.*30, 60, 120"),
        ("touch.optics=exat", "'exat'.*'exact'"),
        ("touch.grid", "KNOB=LEVEL"),
        ("touch.optics=rough", "'rough'.* fast"),
        ("scale.yaws=12", "scale.yaws"),
    ],
)
def test_an_unknown_knob_or_level_is_refused_with_the_nearest(text: str, said: str) -> None:
    with pytest.raises(WrongUse, match=said):
        Accuracy.default(KNOBS).with_texts([text])


def test_asking_for_a_knob_that_is_not_there_is_refused() -> None:
    with pytest.raises(WrongUse, match=r"touch\.none"):
        Accuracy.default(KNOBS)["touch.none"]


@pytest.mark.parametrize(
    ("levels", "kind", "default"),
    [((), "number", 1), ((1, 1), "number", 1), (("a",), "number", "a"), ((1, 2), "method", 1)],
)
def test_a_knob_that_cannot_be_turned_is_refused(
    levels: tuple[Level, ...], kind: str, default: Level
) -> None:
    with pytest.raises(ValueError, match="bad"):
        Knob("bad", levels, "", kind, default)  # type: ignore[arg-type]
    with pytest.raises(WrongUse):
        Knob("x", (1, 2), "", "number", 5)
