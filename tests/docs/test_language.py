"""The check of the language finds each kind of text that it forbids, and nothing else."""

from pathlib import Path

import pytest

from tests.docs.language.check import (
    Counts,
    Finding,
    Words,
    count,
    excess,
    find_all,
    function_shares,
    lower,
)
from tests.docs.language.sources import Sources, Text, read_sources

CLEAN = '''"""Fit circles to marks."""

#: Largest residual, in pixels.
MAX_RESIDUAL_PX = 2.0


class Circle:
    """A circle in the image plane."""

    radius: float  #: radius in metres.

    @property
    def bounded(self) -> bool:
        """True if the radius is finite."""
        return True


def fit_circle(points: int) -> Circle:
    """Fit a circle to points."""
    raise ValueError("the circle has {points} points; it needs at least 3")
'''


def findings(tmp_path: Path, module: str, page: str = "") -> list[tuple[str, str, int]]:
    (tmp_path / "harness" / "sim").mkdir(parents=True)
    (tmp_path / "harness" / "sim" / "circles.py").write_text(module)
    (tmp_path / "README.md").write_text(page)
    found = find_all(read_sources(tmp_path), Words())
    return [(one.rule, one.word, int(one.text.place.rpartition(":")[2])) for one in found]


def test_plain_english_has_no_finding(tmp_path: Path) -> None:
    assert findings(tmp_path, CLEAN, "# Fit circles\n\nRun `touchstone fit`.\n") == []


@pytest.mark.parametrize(
    ("before", "after", "rule", "word", "line"),
    [
        ("MAX_RESIDUAL_PX", "SKIRT_PX", "private word in a name", "skirt", 4),
        ("points: int", "skirtPoints: int", "private word in a name", "skirt", 18),
        ("points: int", "beside: int", "ordinary word in a name", "beside", 18),
        ("class Circle", "class ToldCircle", "ordinary word in a name", "tell", 7),
        ("to marks", "to marks, anew", "private word in a text", "anew", 1),
        ("radius in metres", "radius that nobody measured", "private word in a text", "nobody", 10),
        ("at least 3", "at least 3; say a larger number", "forbidden phrase", "say a", 20),
        ("{points} points", "{points} of them, as is asked for", "forbidden phrase", "is asked for", 20),
        ("Fit a circle to", "Of", "start of a docstring", "of", 19),
        ("Fit a circle to points", "Hz of a circle", "start of a docstring", "unit", 19),
        ("Fit a circle to points", "``(n, 2)`` m of a circle", "start of a docstring", "unit", 19),
        ("Fit a circle to points", "``(n, 2)`` points of a circle", "start of a docstring", "shape", 19),
        ("radius in metres", "m, of the circle", "start of a field", "unit", 10),
        ("Largest residual, in pixels", "How far off", "start of a field", "how", 3),
        ("def fit_circle", "def fitted_circle", "participle as a function's name", "participle", 18),
        ("def fit_circle", "def drawn_circle", "participle as a function's name", "participle", 18),
        ("def fit_circle", "def circle", "function's name without a verb", "no verb", 18),
    ],
)
def test_each_rule_finds_its_text_where_it_stands(
    before: str, after: str, rule: str, word: str, line: int, tmp_path: Path
) -> None:
    assert CLEAN.count(before) == 1
    assert (rule, word, line) in findings(tmp_path, CLEAN.replace(before, after))


def test_pages_are_searched_for_phrases_and_private_words(tmp_path: Path) -> None:
    found = findings(tmp_path, CLEAN, "# Circles\n\nIt is held against the mesh by its skirt.\n")
    assert found == [("private word in a text", "skirt", 3), ("forbidden phrase", "held against", 3)]


def test_only_more_findings_than_allowed_are_in_excess() -> None:
    def found(place: str, word: str) -> Finding:
        return Finding("rule", word, Text(place, "harness/sim", word))

    listed = [found("a.py:1", "told"), found("a.py:2", "told"), found("a.py:3", "said")]
    allowed: Counts = {
        "rule": {"harness/sim": {"told": 1, "said": 1, "gone": 4}, "harness/bench": {"told": 9}}
    }
    assert excess(listed, allowed) == listed[:2]
    assert lower(allowed, count(listed)) == {"rule": {"harness/sim": {"told": 1, "said": 1}}}


def test_shares_of_verbs_and_participles_are_of_all_functions() -> None:
    names = ("fit_circle", "fitted", "circle", "_read_all", "seen_by", "set_rate", "embed_points", "need")
    sources = Sources(functions=[Text("a.py:1", "harness", name) for name in names])
    assert function_shares(sources, Words()) == (4 / 8, 2 / 8)
