"""The report of a localization: the answer in words and numbers, pictures of each contact, and their gaps."""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import cast

import numpy as np
import pytest

from experiments.contact_localization.answer import ScoredContact
from experiments.contact_localization.experiment import EXPERIMENT
from experiments.contact_localization.report import report as report_module
from experiments.contact_localization.report.report import create_report
from harness.effects.quantities import Quantities
from harness.experiment.answer import score
from harness.experiment.compare import Comparison, compare
from harness.experiment.report_content import (
    COUNT,
    Missing,
    Notice,
    PageSection,
    ReportTable,
    RunReport,
    Tiles,
)
from harness.recording.run_folder import RunFiles
from tests.support.localization import chosen
from tests.support.whole_run import in_process_run, touch_scene

TILES = ("live", "simulated", "difference", "height_live", "height_simulated")
PICTURES = ("bench", "contacts", "posterior", "posterior_by_contact", "error_by_contact", "error_by_seconds")


@pytest.fixture(scope="module", autouse=True)
def _small_views() -> Iterator[None]:
    with pytest.MonkeyPatch.context() as monkeypatch:
        monkeypatch.setattr(report_module, "SIDE_PIXELS", 160)
        yield


@pytest.fixture(scope="module")
def scored(tmp_path_factory: pytest.TempPathFactory) -> ScoredContact:
    """Two contacts with the mug, answered from touch; the first is marked as slipped."""
    recording = in_process_run(tmp_path_factory.mktemp("run") / "mug", touch_scene(contacts=2), seed=5)
    made = score(EXPERIMENT, RunFiles(recording), chosen([]))
    last = made.found.last
    slipped = (replace(last.gates[0], slipped=True), *last.gates[1:])
    return replace(made, found=replace(made.found, last=replace(last, gates=slipped)))


@pytest.fixture(scope="module")
def comparison(scored: ScoredContact) -> Comparison:
    return compare(scored, EXPERIMENT.sources(scored))


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("report")


@pytest.fixture(scope="module")
def report(scored: ScoredContact, comparison: Comparison, folder: Path) -> RunReport:
    return create_report(scored, comparison, folder)


@pytest.fixture(scope="module")
def bare_folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("bare")


@pytest.fixture(scope="module")
def bare(scored: ScoredContact, comparison: Comparison, bare_folder: Path) -> RunReport:
    """The report of a run without a truth, for which nothing of touch was simulated."""
    real = replace(scored, truth=None)
    values = {
        key: value for key, value in comparison.evaluation.values.items() if not key.startswith("touch")
    }
    without = replace(comparison, evaluation=replace(comparison.evaluation, values=cast(Quantities, values)))
    return create_report(replace(real, result=EXPERIMENT.result(real)), without, bare_folder)


def section(report: RunReport, title: str) -> PageSection:
    return next(one for one in report.sections if one.title == title)


def test_every_picture_lies_in_the_folder(report: RunReport, folder: Path) -> None:
    tiles = {f"contact_{number}_{tile}.png" for number in (1, 2) for tile in TILES}
    assert report.sections
    assert {path.name for path in folder.glob("*")} == {*(f"{name}.png" for name in PICTURES), *tiles}
    assert all(path.read_bytes().startswith(b"\x89PNG") for path in folder.glob("*.png"))


def test_the_answer_states_position_error_certainty_and_ambiguity(
    report: RunReport, scored: ScoredContact
) -> None:
    last, found = scored.found.last, scored.result["estimates"]["touch"]
    x, y, z = last.position_in_object * 1e3
    for part in (
        f"at ({x:.1f}, {y:.1f}, {z:.1f}) mm on the mug",
        f"with 90 % probability within {1e3 * last.credible90:.1f} mm",
        f"{1e3 * found['error_m']:.2f} mm from the true contact",
    ):
        assert part in report.sentence
    assert (f"fit {len(last.modes)} separate positions" in report.sentence) == (len(last.modes) > 1)
    values = {value.quantity: value for value in report.values}
    position = values["position of the last contact, from touch"]
    assert position.uncertainty == f"90 % within {1e3 * last.credible90:.1f} mm"
    shown = [float(number) for number in position.value.strip("()").split(", ")]
    assert shown == pytest.approx(1e3 * last.position_in_object, abs=0.05)
    for name, key in (
        ("error of the last contact", "error_m"),
        ("error modulo the object's symmetry", "error_symmetric_m"),
        ("mean error of all contacts", "error_mean_m"),
    ):
        value = values[f"{name}, from touch"]
        assert float(value.value) == pytest.approx(1e3 * found[key], rel=1e-3)
        assert value.unit == "mm"
    assert values["area of the 90 % region, from touch"].unit == "mm²"
    likely = values["separate likely positions of the last contact"]
    assert (likely.value, likely.unit) == (str(len(last.modes)), COUNT)


def test_without_a_truth_nothing_is_compared_with_it(bare: RunReport) -> None:
    assert "true" not in bare.sentence
    assert not [value for value in bare.values if "error" in value.quantity]
    (missing,) = section(bare, "Error").blocks
    assert missing == Missing("the true contacts are unknown")


def test_likely_positions_are_rows(report: RunReport, scored: ScoredContact) -> None:
    _, likely, _ = section(report, "Posterior of the contacts").blocks
    assert isinstance(likely, ReportTable)
    assert [row[1] for row in likely.rows] == [f"{100 * m.weight:.1f} %" for m in scored.found.last.modes]


def test_each_contact_has_its_flags_its_fit_and_five_tiles(report: RunReport) -> None:
    _, first, second = section(report, "Contact by contact").blocks
    assert isinstance(first, PageSection)
    assert isinstance(second, PageSection)
    notice, words, tiles = first.blocks
    assert isinstance(notice, Notice)
    assert notice.text.startswith("slipped")
    assert "images differ by" in str(words)
    assert "height maps differ by" in str(words)
    assert isinstance(tiles, Tiles)
    titles = [title.split(":")[0] for title, _ in tiles.tiles]
    assert titles == ["live", "simulated", "difference", "height, live", "height, simulated"]
    assert len(second.blocks) == 2


def test_what_was_not_simulated_leaves_the_other_tiles(
    scored: ScoredContact, bare: RunReport, bare_folder: Path
) -> None:
    contact = section(bare, "Contact by contact").blocks[1]
    assert isinstance(contact, PageSection)
    tiles = contact.blocks[-1]
    assert isinstance(tiles, Tiles)
    shown = {title.split(":")[0]: picture for title, picture in tiles.tiles}
    assert shown["simulated"] == Missing("the scene's observe does not ask for touch.image")
    assert shown["height, simulated"] == Missing("the scene's observe does not ask for touch.gel")
    assert (bare_folder / "contact_1_live.png").exists()
    assert not (bare_folder / "contact_1_difference.png").exists()
    assert np.all(scored.found.readings.gels[0].height < 5e-3)
