"""Rows say whose they are; files and JSON hold finite numbers; what is not there is named."""

import csv
import io
import json

import numpy as np
import pytest

from experiments.paper.rendering import MadeMethod, MeasuredMethod, RenderingMethod, picture_scores
from experiments.paper.rendering_table import (
    QUOTED_QUALITY,
    QUOTED_SECONDS,
    as_csv,
    plain_rendering,
    print_tables,
    quoted_rows,
    row_of,
)
from harness.cli import invoke


def method() -> RenderingMethod:
    return RenderingMethod("codes", "ours", (), lambda: MadeMethod(lambda _: np.zeros(1)), "small")


def found() -> MeasuredMethod:
    scores = {"psnr_db": np.array([40.0, 42.0, 44.0]), "ssim": np.array([0.9, 0.92, 0.94])}
    return MeasuredMethod(method(), scores, np.array([1e-3, 2e-3, 3e-3, 4e-3, 5e-3]), made=7.0)


def test_what_the_paper_prints_is_marked_as_quoted_and_adds_up_to_its_totals() -> None:
    rows = quoted_rows()
    assert {row.object for row in rows} == {"quoted"}
    assert all(row.column.endswith("quoted") and row.timings == 0 for row in rows)
    totals = {name: sum(senses.values()) for name, senses in QUOTED_SECONDS.items()}
    assert totals == {"ObjectFolder 1.0": pytest.approx(4.129), "ObjectFolder 2.0": pytest.approx(0.111)}
    assert set(QUOTED_QUALITY) == set(QUOTED_SECONDS)


def test_a_row_has_medians_with_quartiles_and_means_with_intervals() -> None:
    row = row_of("mug", 3, "touch", found())
    assert row.seconds == pytest.approx((3e-3, 2e-3, 4e-3))
    assert row.metrics["psnr_db"].value == pytest.approx(42.0)
    assert row.metrics["psnr_db"].low <= 42.0 <= row.metrics["psnr_db"].high
    assert row.note == "small"


def test_the_file_reads_back_and_json_holds_no_nan() -> None:
    missing = MeasuredMethod(method(), {}, np.empty(0), missing="torch")
    rows = [*quoted_rows(), row_of("mug", 3, "touch", found()), row_of("mug", 3, "touch", missing)]
    lines = list(csv.DictReader(io.StringIO(as_csv(rows))))
    assert len(lines) == len(rows)
    assert float(lines[-2]["psnr_db"]) == pytest.approx(42.0)
    assert lines[-1]["psnr_db"] == lines[-1]["seconds"] == ""
    assert "torch" in lines[-1]["note"]
    json.dumps([plain_rendering(row) for row in rows], allow_nan=False)


def test_tables_are_printed_with_every_row(capsys: pytest.CaptureFixture[str]) -> None:
    print_tables([*quoted_rows(), row_of("mug", 3, "touch", found())], "this machine")
    printed = capsys.readouterr().out
    for part in ("Table 1, mug", "Table 2, mug", "ObjectFolder 1.0, quoted", "codes", "this machine"):
        assert part in printed


def test_pictures_of_whole_greys_are_known_no_better_than_their_rounding() -> None:
    picture = np.full((16, 16, 3), 7, np.uint8)
    assert picture_scores(picture, picture)["psnr_db"] == pytest.approx(58.92, abs=0.01)
    assert picture_scores(picture, picture + np.uint8(8))["psnr_db"] == pytest.approx(
        10.0 * np.log10(255.0**2 / 64.0)
    )


@pytest.mark.parametrize(
    ("options", "named"),
    [(["--sense", "smell"], "--sense smell"), (["--object", "nothing-of-that-name"], "nothing-of-that-name")],
)
def test_what_there_is_not_is_refused_by_name(
    options: list[str], named: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert invoke(["tables", "rendering", *options]) == 2
    assert named in capsys.readouterr().err
