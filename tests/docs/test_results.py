"""docs/results is rendered from its JSON, states where each figure comes from, and stays short."""

import re
import sys
from collections import Counter
from pathlib import Path

import pytest

from tests.benchmarks.results import finish_figure
from tests.docs import results
from tests.docs.results import DATA, FOLDER, Spread, pages, read_page

ROOT = FOLDER.parents[1]
PAGES = pages()
NAMES = sorted(path.stem for path in DATA.glob("*.json"))
COMMIT = r"not recorded|on the linked pages|[0-9a-f]{7,40}(-dirty)?(, [0-9a-f]{7,40})*"
COMMAND = r"not recorded|on the linked pages|((PYTHONPATH=\.|[A-Z_]+=\d+) )?(python|touchstone|make) .*"
MAX_WORDS = 10_000
MAX_LIMITS_WORDS = 500


@pytest.mark.parametrize("name", PAGES)
def test_a_page_is_as_it_is_rendered(name: str) -> None:
    assert (FOLDER / name).read_text(encoding="utf-8") == PAGES[name], "run `make results`"


def test_every_page_has_data() -> None:
    assert {path.name for path in FOLDER.glob("*.md")} == set(PAGES)


@pytest.mark.parametrize("name", NAMES)
def test_an_introduction_has_two_sentences_and_a_conclusion_one(name: str) -> None:
    page = read_page(name)
    assert len(re.findall(r"[.?](?= |$)", page.introduction)) <= 2
    for figure in page.figures:
        assert len(re.findall(r"[.?](?= |$)", figure.conclusion)) == 1, figure.id


@pytest.mark.parametrize("name", NAMES)
def test_every_figure_states_its_command_and_commit(name: str) -> None:
    figures = read_page(name).figures
    assert max(Counter(figure.id for figure in figures).values()) == 1
    for figure in figures:
        assert re.fullmatch(COMMIT, figure.commit), figure.id
        assert re.fullmatch(COMMAND, figure.command), figure.id
        for script in re.findall(r"\btests/[\w/]+\.py\b", figure.command):
            assert (ROOT / script).is_file(), figure.id
        assert all(len(row) == len(figure.columns) for row in figure.rows), figure.id


def test_benchmarks_write_figures_that_are_there() -> None:
    written = {
        pair
        for path in (ROOT / "tests" / "benchmarks").rglob("*.py")
        for pair in re.findall(r'finish_figure\(\s*"(\w+)",\s*"([\w-]+)"', path.read_text(encoding="utf-8"))
    }
    assert written
    assert written <= {(name, figure.id) for name in NAMES for figure in read_page(name).figures}


def test_a_benchmark_replaces_its_figure_alone(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(results, "DATA", tmp_path)
    (tmp_path / "modes.json").write_text((DATA / "modes.json").read_text(encoding="utf-8"))
    before = read_page("modes").figures
    monkeypatch.setattr(sys, "argv", ["benchmark.py", "--write"])
    finish_figure("modes", "filling", "program; time [CPU s] .1f; cells", [("ours", "9.9 (9 to 11.2)", 7.04)])
    after = read_page("modes").figures
    (number,) = [k for k, (old, new) in enumerate(zip(before, after, strict=True)) if old != new]
    assert after[number].rows == (("ours", Spread(value=9.9, low=9, high=11.2), 7.04),)
    assert after[number].title == before[number].title
    assert after[number].commit != before[number].commit
    assert "ours | 9.9 (9 to 11.2) | 7.04" in pages()["modes.md"]


def test_results_and_limits_are_short() -> None:
    words = sum(len(text.split()) for text in PAGES.values())
    assert words <= MAX_WORDS
    limits = (FOLDER.parent / "limits.md").read_text(encoding="utf-8")
    assert len(limits.split()) <= MAX_LIMITS_WORDS
