import re
import subprocess
import sys
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path

import pytest

from harness.effects.explain import NetworkInUse
from harness.report.data import AnswerRow, ReportData, StrikeLine
from harness.report.page import write_report
from harness.report.values import Missing

SECTIONS = (
    "bench", "posterior", "sound", "errors", "contacts", "instruments", "calibrations", "effects", "world",
    "twin", "versions", "agreement",
)  # fmt: skip
BESIDE = (
    "bench", "contacts", "posterior", "posterior_by_contact", "error_by_contact", "error_by_seconds",
    "senses", "spectrograms",
)  # fmt: skip


class Page(HTMLParser):
    def __init__(self, text: str) -> None:
        super().__init__()
        self.addresses: list[str] = []
        self.ids: set[str] = set()
        self.tags: list[str] = []
        self.words: list[str] = []
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append(tag)
        for name, value in attrs:
            if name in {"src", "href", "srcset", "data", "action"}:
                self.addresses.append(value or "")
            if name == "id":
                self.ids.add(value or "")

    def handle_data(self, data: str) -> None:
        self.words.append(data)

    @property
    def text(self) -> str:
        return re.sub(r"\s+", " ", " ".join(self.words))


@pytest.fixture(scope="module")
def written(report_data: ReportData, tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_report(report_data, tmp_path_factory.mktemp("report") / "new" / "folder")


@pytest.fixture(scope="module")
def page(written: Path) -> Page:
    return Page(written.read_text(encoding="utf-8"))


def light(data: ReportData) -> ReportData:
    """The same run without its pictures, which take the time."""
    gone = Missing("left out")
    contacts = tuple(replace(c, posterior=gone, object_from_gel=gone) for c in data.contacts[:1])
    return replace(data, bench=gone, contacts=contacts, sound=gone)


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
    assert {f"#{name}" for name in SECTIONS} == {a for a in page.addresses if a.startswith("#")}
    assert set(SECTIONS) <= page.ids


def test_the_same_pictures_lie_beside_it(written: Path, report_data: ReportData) -> None:
    tiles = ("live", "simulated", "difference", "height_live", "height_simulated")
    expected = {f"{name}.png" for name in BESIDE}
    expected |= {f"contact_{c.number}_{tile}.png" for c in report_data.contacts for tile in tiles}
    assert {path.name for path in written.parent.glob("*.png")} == expected
    assert all(path.read_bytes().startswith(b"\x89PNG") for path in written.parent.glob("*.png"))


def test_the_headline_says_position_error_certainty_and_ambiguity(
    page: Page, report_data: ReportData
) -> None:
    answer = report_data.answer
    assert isinstance(answer, AnswerRow)
    assert answer.error is not None
    x, y, z = answer.position * 1e3
    for part in (
        f"({x:.1f}, {y:.1f}, {z:.1f}) mm",
        f"{answer.error * 1e3:.2f} mm from the truth",
        "90 % certainty",
    ):
        assert part in page.text
    assert "2 separate" in page.text


def test_the_headline_says_how_near_each_sense_came(page: Page) -> None:
    assert "7.31 mm" in page.text
    assert "1.27 mm" in page.text


@pytest.mark.parametrize(
    "said",
    [
        "no answer: no place on this object explains the <images>", "24 cm²", "61 mm²", "31.2 ms", "41.2 N",
        "310 µs", "2.44 Pa", "not used: the hammer hit twice", "not used: no strike came",
        "4 of 6 strikes count; together they excite 0.2 to 9.4 kHz",
        "3 resonances in common, 2 of them taken for modes, and 4 more set aside",
        "rings 1.3 % above its model",
        "The strike of contact 6", "1225.7 Hz", "1225.1 Hz", "+0.05 %", "2 to 3", "-0.27 %", "97 %",
        "+5.21 at 0.2", "-1.40 at 0.2", "9.2 %",
    ],
)  # fmt: skip
def test_what_each_sense_contributed_is_on_the_page(page: Page, said: str) -> None:
    assert said in page.text


def test_bars_are_to_scale_and_show_which_side_a_peak_is_on(written: Path) -> None:
    bars = re.findall(r'<i( class="against")? style="width: ([0-9.]+)%"', written.read_text(encoding="utf-8"))
    assert [(bool(against), float(width)) for against, width in bars] == [
        (False, 100.0),
        (True, pytest.approx(100.0 * 1.4 / 5.21, abs=0.05)),
        (False, 0.0),
    ]


@pytest.mark.slow  # a whole page; what it says is in the result too
def test_sound_that_says_nothing_is_said_to(report_data: ReportData, tmp_path: Path) -> None:
    full = report_data.sound
    assert not isinstance(full, Missing)
    unused = tuple(StrikeLine(number, "no strike came") for number in (1, 2))
    quiet = replace(
        full, strikes=unused, pair=Missing("no strike counts"), peaks=Missing("fewer than two"), band=None
    )
    text = Page(write_report(replace(light(report_data), sound=quiet), tmp_path).read_text("utf-8")).text
    assert "0 of 2 strikes" in text
    assert "Not available: no strike counts." in text
    assert "Not available: fewer than two." in text
    assert "None" not in text
    assert not (tmp_path / "spectrograms.png").exists()
    assert (tmp_path / "senses.png").exists()


def test_every_figure_has_a_caption_and_every_picture_words_in_its_place(written: Path, page: Page) -> None:
    assert page.tags.count("figure") == page.tags.count("figcaption") >= 6
    assert all(re.search(r'alt="[^"]{5,}"', tag) for tag in re.findall(r"<img[^>]*>", written.read_text()))


@pytest.mark.parametrize(
    "said",
    [
        "slipped: down-weighted", "repeated contact 4", "127.0.0.1:30004", "reopened once", "10 days",
        "nothing listens: the scene has no microphone", "gel centre offset", "054b11f+", "numpy 2.3.1",
        "fitted at 22 degrees", "samples = 2 mm", "0.440 mm", "images differ by",
    ],
)  # fmt: skip
def test_what_the_run_knew_is_on_the_page(page: Page, said: str) -> None:
    assert said in page.text


@pytest.mark.parametrize("mock", [True, False])
def test_mock_results_and_only_they_are_labelled(report_data: ReportData, tmp_path: Path, mock: bool) -> None:
    written = write_report(replace(light(report_data), mock=mock), tmp_path)
    text = written.read_text(encoding="utf-8")
    assert ('<span class="mock">MOCK</span>' in text) == mock
    assert ("<title>MOCK: " in text) == mock
    assert ("not from a bench" in text) == mock


def test_what_is_missing_is_said_to_be_with_its_reason(report_data: ReportData, tmp_path: Path) -> None:
    names = ("answer", "bench", "error_by_contact", "error_by_seconds", "instruments", "sound")
    more = ("calibrations", "effects", "world", "twin")
    reasons = {name: Missing(f"the reason for {name} & <it>") for name in names + more}
    bare = replace(
        light(report_data),
        answer=reasons["answer"],
        bench=reasons["bench"],
        error_by_contact=reasons["error_by_contact"],
        error_by_seconds=reasons["error_by_seconds"],
        instruments=reasons["instruments"],
        calibrations=reasons["calibrations"],
        effects=reasons["effects"],
        world=reasons["world"],
        twin=reasons["twin"],
        sound=reasons["sound"],
    )
    text = Page(write_report(bare, tmp_path).read_text(encoding="utf-8")).text
    for name in names + more:
        assert f"the reason for {name} & <it>" in text
    assert "None" not in text
    assert "nan" not in text


@pytest.mark.slow  # a whole page; what is missing is said by the test above
def test_a_run_without_a_contact_has_a_report(report_data: ReportData, tmp_path: Path) -> None:
    empty = replace(
        report_data, contacts=(), answer=Missing("the gel met nothing"), bench=Missing("no contact")
    )
    text = Page(write_report(empty, tmp_path).read_text(encoding="utf-8")).text
    assert "No answer: the gel met nothing." in text
    assert "the recording has no contact" in text


def test_missing_tactile_images_leave_the_other_tiles(report_data: ReportData, tmp_path: Path) -> None:
    one = light(report_data)
    half = replace(one, contacts=(replace(one.contacts[0], simulated=Missing("no place fitted")),))
    text = Page(write_report(half, tmp_path).read_text(encoding="utf-8")).text
    assert "not available: no place fitted" in text
    assert "not available: there is no simulated image" in text
    assert (tmp_path / "contact_1_live.png").exists()
    assert not (tmp_path / "contact_1_difference.png").exists()


def test_names_are_shown_and_not_obeyed(report_data: ReportData, tmp_path: Path) -> None:
    title = "<script>alert(1)</script>"
    page = Page(write_report(replace(light(report_data), title=title), tmp_path).read_text(encoding="utf-8"))
    assert "script" not in page.tags
    assert title in page.text


def test_the_same_data_give_the_same_bytes(report_data: ReportData, tmp_path: Path) -> None:
    data = light(report_data)
    first, second = (write_report(data, tmp_path / name) for name in ("a", "b"))
    for path in first.parent.iterdir():
        assert path.read_bytes() == (second.parent / path.name).read_bytes()


def test_a_report_needs_no_simulator_of_the_arm() -> None:
    ask = "import sys, harness.report.page, harness.report.figures.pictures; print('mujoco' in sys.modules)"
    answer = subprocess.run([sys.executable, "-c", ask], capture_output=True, text=True, check=True)
    assert answer.stdout.strip() == "False"


def test_networks_that_stand_for_a_simulation_are_listed_with_their_errors(
    report_data: ReportData, page: Page, tmp_path: Path
) -> None:
    sound = NetworkInUse("sound.shapes", "audio.onnx", "finite elements", {"gain_error_median": 0.0045}, {})
    look = NetworkInUse("camera.look", "vision.onnx", "rays on the mesh", {}, {})
    path = write_report(replace(light(report_data), networks=(sound, look)), tmp_path)
    text = Page(path.read_text(encoding="utf-8")).text
    assert "gain_error_median 0.0045" in text
    assert "vision.onnx rays on the mesh not measured" in text
    assert "The object is an ObjectFile" not in page.text
