"""Pictures of a run that are not what the calibration was made of are left out, and named."""

from pathlib import Path

import pytest

from harness.basics.errors import FitRefused
from harness.recording.recording import Recording
from tests.support import sessions as session_of
from tests.support.localization import chosen
from tests.support.whole_run import SPOILED, with_spoiled_pictures


@pytest.mark.parametrize("how", SPOILED)
def test_a_spoiled_picture_is_named_and_the_rest_answers(done: Recording, tmp_path: Path, how: str) -> None:
    spoiled = with_spoiled_pictures(done, tmp_path / "run", how, 1)
    scored = session_of.score(spoiled, chosen(["localization.senses=touch"]))
    assert list(scored.found.readings.refused_pictures) == [1]
    assert not scored.found.readings.gels[1].height.any()
    assert any(one.startswith("contact 2: ") for one in scored.result["warnings"])
    assert "left out" in scored.result["estimates"]["touch"]["contacts"][1]["flags"][0]
    assert scored.result["estimates"]["touch"]["error_m"] < 0.02


def test_the_estimates_by_contact_begin_with_the_first_picture_that_is_read(
    done: Recording, tmp_path: Path
) -> None:
    spoiled = with_spoiled_pictures(done, tmp_path / "run", "black", 0)
    scored = session_of.score(spoiled, chosen(["localization.senses=touch"]))
    history = scored.answering.history(scored.found.last, "touch")
    assert [isinstance(after, FitRefused) for after in history] == [True, False, False]


def test_where_no_picture_is_left_touch_is_refused_with_the_reason(done: Recording, tmp_path: Path) -> None:
    spoiled = with_spoiled_pictures(done, tmp_path / "run", "black", 0, 1, 2)
    with pytest.raises(FitRefused, match=r"contact 1: .*%.*light"):
        session_of.score(spoiled, chosen(["localization.senses=touch"]))
