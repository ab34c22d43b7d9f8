"""A refusal of what a file held says which file."""

from pathlib import Path

import pytest

from harness.basics.errors import CalibrationRefused, DataRefused, WrongUse
from harness.basics.files.named_file import refusals_name

ONE, OTHER, THIRD = (Path(name) for name in ("press.png", "rest.png", "more.png"))


@pytest.mark.parametrize(
    ("paths", "said"),
    [
        ((ONE,), "press.png: 2 x 2 pixels"),
        ((ONE, OTHER), "press.png, rest.png: 2 x 2 pixels"),
        ((ONE, OTHER, THIRD), "press.png and 2 more: 2 x 2 pixels"),
    ],
)
def test_a_refusal_that_names_no_file_gets_its_files_and_keeps_its_kind(
    paths: tuple[Path, ...], said: str
) -> None:
    with pytest.raises(CalibrationRefused) as refused, refusals_name(*paths):
        raise CalibrationRefused("2 x 2 pixels")
    assert str(refused.value) == said


def test_a_refusal_that_names_one_of_the_files_stays_as_it_is() -> None:
    with pytest.raises(DataRefused) as refused, refusals_name(ONE, OTHER):
        raise DataRefused(f"{OTHER} is grey")
    assert str(refused.value) == "rest.png is grey"


def test_wrong_use_is_not_the_files_doing() -> None:
    with pytest.raises(WrongUse) as refused, refusals_name(ONE):
        raise WrongUse("say --pitch")
    assert str(refused.value) == "say --pitch"
