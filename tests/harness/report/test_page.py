"""The page of a run shows its inputs, refers to nothing outside itself, and escapes names."""

import re
import subprocess
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from harness.effects.explain import NetworkInUse
from harness.experiment.report_content import (
    Bar,
    CaptionedPicture,
    Missing,
    Notice,
    PageSection,
    ReportTable,
    Tiles,
)
from harness.report import run_page
from harness.report.figures.figures import Album
from harness.report.figures.tiles import png
from tests.harness.report.conftest import REPORT, Stub
from tests.support.pages import Page

HEADINGS = [
    "Answer", "Readings and estimates", "Agreement with the model", "Bench", "Cost of the answer",
]  # fmt: skip
BENCH = [
    "Instruments", "Calibrations", "Simulated effects", "Differences of the mocked world", "Versions",
]  # fmt: skip

TextOf = Callable[[Stub, Path], str]


def full(folder: Path) -> Stub:
    """A page with a block of every kind."""
    folder.mkdir(parents=True, exist_ok=True)
    picture = Album(folder).pixels("contact_1_live", png(np.full((3, 4, 3), 100, np.uint8)))
    table = ReportTable(("peak", ""), [("1 Hz", Bar(100.0, False)), ("2 Hz", Bar(27.0, True))], "rl")
    tiles = Tiles((("live", picture), ("simulated", Missing("no place fitted"))))
    blocks = (
        "Words.", Notice("slipped: its weight is limited"), CaptionedPicture(picture, "The image. Live."),
        CaptionedPicture(Missing("nothing was drawn"), "Never shown."), table, tiles,
    )  # fmt: skip
    sections = (PageSection("Contacts", (PageSection("Contact 1", blocks),)), PageSection("Bare", ()))
    return Stub(replace(REPORT, sections=sections))


@pytest.fixture(scope="module")
def written(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("report") / "new" / "folder"
    return full(folder).write(folder)


@pytest.fixture(scope="module")
def page(written: Path) -> Page:
    return Page(written.read_text(encoding="utf-8"))


def test_the_page_holds_everything_it_shows(written: Path, page: Page) -> None:
    outside = [a for a in page.addresses if not a.startswith(("data:image/", "#"))]
    assert outside == []
    assert "script" not in page.tags
    assert "link" not in page.tags
    assert "url(" not in written.read_text(encoding="utf-8")
    assert written.stat().st_size <= 3_000_000


def test_no_tag_of_ours_is_shown_as_words(page: Page) -> None:
    assert not re.search(r"</?(a|b|br|code|em|i|p|span|sub|sup)\b", page.text)


def test_its_table_of_contents_leads_to_every_section(page: Page) -> None:
    assert page.headings["h2"] == HEADINGS
    assert page.headings["h3"] == ["Contacts", "Bare", *BENCH]
    assert page.headings["h4"] == ["Contact 1"]
    titles = [*page.headings["h2"], *page.headings["h3"]]
    anchors = {title.lower().replace(" ", "-") for title in titles}
    assert {a for a in page.addresses if a.startswith("#")} == {f"#{anchor}" for anchor in anchors}
    assert anchors <= page.ids


def test_every_table_scrolls_by_itself_and_no_picture_is_wider_than_the_page(written: Path) -> None:
    text = written.read_text(encoding="utf-8")
    assert text.count("<table") == text.count('<div class="scroll"><table')
    assert ".scroll { overflow-x: auto; }" in text
    assert "figure > img { max-width: 100%;" in text
    assert '<meta name="viewport" content="width=device-width' in text


def test_the_answer_is_a_sentence_and_values_with_units(page: Page) -> None:
    assert REPORT.sentence in page.text
    assert [row for row in page.rows["Answer"] if row] == [
        ["position", "(1.0, 2.0, 3.0)", "mm", "90 % within 2.1 mm"],
        ["likely positions", "2", "count", ""],
    ]


def test_bars_are_to_scale_and_show_their_sign(written: Path) -> None:
    bars = re.findall(r'<i( class="against")? style="width: ([0-9.]+)%"', written.read_text(encoding="utf-8"))
    assert [(bool(against), float(width)) for against, width in bars] == [(False, 100.0), (True, 27.0)]


def test_every_figure_has_a_caption_and_every_picture_words_in_its_place(written: Path, page: Page) -> None:
    assert page.tags.count("figure") == page.tags.count("figcaption") >= 1
    assert all(re.search(r'alt="[^"]{4,}"', tag) for tag in re.findall(r"<img[^>]*>", written.read_text()))


@pytest.mark.parametrize(
    "words",
    [
        "slipped: its weight is limited", "127.0.0.1:30004", "reopened once", "10 days",
        "the sensor casts no shadow", "gel centre", "(0.3, -0.06, 0) mm", "sound: modes 13", "054b11f+",
        "numpy 2.3.1", "fitted at 22 degrees", "stub.spacing 0.002 m distance of the samples",
        "search 12.3 ms", "refinement 2.50 s", "all stages 2.51 s",
        "touch.image the scene observes it 3 250 ms",
        "touch.image 2 x 120 x 160 x 3 0 97 254", "no cost curve has these levels",
        "runs/20260302-140512-mug",
    ],
)  # fmt: skip
def test_what_is_known_of_the_run_is_on_the_page(page: Page, words: str) -> None:
    assert words in page.text


@pytest.mark.parametrize("mock", [True, False])
def test_mock_results_and_only_they_are_labelled(tmp_path: Path, mock: bool) -> None:
    text = Stub(mock=mock).write(tmp_path).read_text(encoding="utf-8")
    assert ('<span class="mock">MOCK</span>' in text) == mock
    assert ("<title>MOCK: " in text) == mock
    assert ("not from a bench" in text) == mock


def test_what_is_missing_is_stated_with_its_reason(tmp_path: Path, page: Page, text_of: TextOf) -> None:
    assert "not available: no place fitted" in page.text
    assert "Not available: nothing was drawn." in page.text
    sections = (PageSection("Posterior", (Missing("the reason & <it>"),)),)
    text = text_of(Stub(replace(REPORT, sections=sections), health=None, world=None), tmp_path)
    assert "the reason & <it>" in text
    assert "no instrument was open" in text
    assert "the truth is unknown" in text
    assert "the readings were not compared with a model" in text
    assert "None" not in text
    assert "nan" not in text


def test_names_are_shown_and_not_obeyed(tmp_path: Path) -> None:
    title = "<script>alert(1)</script><canvas>"
    page = Page(Stub(title=title).write(tmp_path).read_text(encoding="utf-8"))
    assert "script" not in page.tags
    assert title in page.text


def test_the_same_data_give_the_same_bytes(tmp_path: Path) -> None:
    first, second = (full(tmp_path / name).write(tmp_path / name) for name in ("a", "b"))
    for path in first.parent.iterdir():
        assert path.read_bytes() == (second.parent / path.name).read_bytes()


def test_a_report_loads_neither_the_simulator_of_the_arm_nor_slow_libraries() -> None:
    ask = (
        "import sys, harness.report.run_page, harness.report.figures.pictures, harness.report.figures.sound\n"
        "print({'mujoco', 'networkx', 'scipy.signal', 'scipy.stats'} & set(sys.modules))"
    )
    answer = subprocess.run([sys.executable, "-c", ask], capture_output=True, text=True, check=True)
    assert answer.stdout.strip() == "set()"


def test_networks_that_replace_a_simulation_are_listed_with_their_errors(
    page: Page, tmp_path: Path, text_of: TextOf, monkeypatch: pytest.MonkeyPatch
) -> None:
    sound = NetworkInUse("sound.shapes", "audio.onnx", "finite elements", {"gain_error_median": 0.0045}, {})
    look = NetworkInUse("camera.look", "vision.onnx", "rays on the mesh", {}, {})
    monkeypatch.setattr(run_page, "find_networks", lambda _: (sound, look))
    text = text_of(Stub(), tmp_path)
    assert "gain error median 0.0045" in text
    assert "vision.onnx rays on the mesh not measured" in text
    assert "The object is an ObjectFile" not in page.text
