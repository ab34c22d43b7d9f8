"""The part that holds live readings beside a model: verdicts with their numbers, and a picture."""

from pathlib import Path

import numpy as np
import pytest

from harness.agreement.agreement import Agreement, Residual, SenseResiduals, SideBySide, judge_residuals
from harness.experiment.report_content import CaptionedPicture, Missing, Picture, ReportTable
from harness.report.agreement_part import show_agreement
from harness.report.figures.figures import Album
from tests.harness.report.conftest import Stub

FIELD = np.linspace(0.0, 2e-3, 24).reshape(4, 6)


@pytest.fixture
def agreement() -> Agreement:
    fields = SideBySide(FIELD, 0.9 * FIELD, "m")
    peaks = SideBySide(np.array([900.0, 2100.0]), np.array([905.0, 2090.0, 7000.0]), "Hz")
    touch = (
        Residual(0, "gel surface", 3.0, 4.0, {"rms_m": 4e-5}, fields),
        Residual(2, "gel surface", 99.0, 4.0, {"rms_m": 4e-4, "turned_rad": 0.1}, fields),
    )
    return judge_residuals(
        "mug",
        [
            SenseResiduals("touch", "network", touch),
            SenseResiduals("sound", "reference", (Residual(2, "resonances", 0.1, 2.0, {}, peaks),)),
            SenseResiduals("camera", "reference", (), "the scene uses no camera"),
        ],
    )


def test_each_sense_has_its_verdict_and_numbers(agreement: Agreement, tmp_path: Path) -> None:
    words, table, shown = show_agreement(agreement, Album(tmp_path))
    assert isinstance(table, ReportTable)
    assert str(words).endswith(" First in doubt: touch, at step 3.")
    assert [row[2] for row in table.rows] == ["does not fit", "fits", "not comparable"]
    assert "step 3, gel surface, chi-square 99.0" in str(table.rows[0][3])
    assert "rms 0.4 mm, turned 5.73°" in str(table.rows[0][3])
    assert table.rows[2][3] == "the scene uses no camera"
    assert isinstance(shown, CaptionedPicture)
    assert isinstance(shown.picture, Picture)
    assert (tmp_path / "agreement.png").exists()


def test_a_run_that_was_not_compared_says_so(tmp_path: Path) -> None:
    assert show_agreement(None, Album(tmp_path)) == (Missing("the readings were not compared with a model"),)


def test_a_run_of_which_nothing_can_be_compared_has_no_picture(tmp_path: Path) -> None:
    nothing = judge_residuals("mug", [SenseResiduals("touch", "reference", (), "no picture of the gel")])
    words, _, shown = show_agreement(nothing, Album(tmp_path))
    assert str(words).endswith(" Nothing could be compared.")
    assert isinstance(shown, CaptionedPicture)
    assert isinstance(shown.picture, Missing)


def test_the_page_shows_it(agreement: Agreement, tmp_path: Path) -> None:
    text = Stub(agreement=agreement).write(tmp_path).read_text(encoding="utf-8")
    assert "First in doubt: touch, at step 3." in text
    assert "does not fit" in text
    assert (tmp_path / "agreement.png").exists()
