"""Every relative link of a Markdown page leads to a file that is there, and to a heading that is there."""

import re
from pathlib import Path

import pytest

from tests.docs.model_tables import anchor

ROOT = Path(__file__).parents[2]
PAGES = sorted(path.relative_to(ROOT).as_posix() for path in (*ROOT.glob("*.md"), *ROOT.glob("docs/**/*.md")))
SOURCES = (
    "harness",
    "drivers",
    "mocks",
    "experiments",
    "calibration",
    "tests",
    "examples",
)


def prose(page: Path) -> str:
    """A page without its blocks of code."""
    return re.sub(r"^```.*?^```", "", page.read_text(encoding="utf-8"), flags=re.M | re.S)


def anchors(page: Path) -> set[str]:
    """Those of a page's headings."""
    headings = re.findall(r"^#+ (.*)$", prose(page), flags=re.M)
    return {anchor(re.sub(r"\[([^]]*)\]\([^)]*\)", r"\1", heading)) for heading in headings}


@pytest.mark.parametrize("name", PAGES)
def test_every_relative_link_leads_somewhere(name: str) -> None:
    page = ROOT / name
    for target in re.findall(r"\]\(([^)\s]+)\)", prose(page)):
        if re.match(r"[a-z]+:", target):
            continue
        path, _, heading = target.partition("#")
        aim = (page.parent / path).resolve() if path else page
        assert aim.exists(), target
        if heading:
            assert heading in anchors(aim), target


def test_every_page_that_the_code_names_is_there() -> None:
    for folder in SOURCES:
        for path in (ROOT / folder).rglob("*"):
            if path.suffix in (".py", ".toml"):
                for named in re.findall(r"\bdocs/[\w/-]+\.md\b", path.read_text(encoding="utf-8")):
                    assert (ROOT / named).is_file(), f"{path}: {named}"


def test_every_page_is_reached_from_the_readme() -> None:
    reached, todo = set(), [ROOT / "README.md"]
    while todo:
        page = todo.pop()
        if page in reached:
            continue
        reached.add(page)
        for target in re.findall(r"\]\(([^)\s:]+)\)", prose(page)):
            aim = (page.parent / target.partition("#")[0]).resolve()
            if aim.is_dir():
                todo += aim.glob("*.md")
            elif aim.suffix == ".md":
                todo.append(aim)
    pages = {ROOT / name for name in PAGES if name.startswith("docs/") and not name.startswith("docs/site/")}
    assert pages <= reached
