"""The house is as ARCHITECTURE.md says: its rooms are there, none holds too much, its rows resolve."""

import ast
import re
from pathlib import Path

import pytest

from harness.bench.experiments import EXPERIMENTS, ExperimentRow, loaded
from harness.bench.scene import Section
from harness.experiment.experiment import Experiment

ROOT = Path(__file__).parents[2]
PRODUCT = ("harness", "drivers", "mocks", "experiments", "calibration")
MOST = 25


def rooms() -> list[Path]:
    return sorted({path.parent for top in PRODUCT for path in (ROOT / top).rglob("*.py")})


@pytest.mark.parametrize("room", rooms(), ids=lambda path: path.relative_to(ROOT).as_posix())
def test_a_room_holds_at_most_25_modules_and_says_what_it_is(room: Path) -> None:
    modules = [path for path in room.glob("*.py") if path.name != "__init__.py"]
    assert len(modules) <= MOST
    assert (room / "__init__.py").read_text().startswith('"""')


def test_fields_are_documented_where_they_stand() -> None:
    sources = [path for top in (*PRODUCT, "tests") for path in (ROOT / top).rglob("*.py")]
    heading = "Attributes" + ":"
    assert [path for path in sources if heading in path.read_text().split()] == []


def test_every_room_that_the_page_names_is_there() -> None:
    page = (ROOT / "ARCHITECTURE.md").read_text()
    named = re.findall(r"`((?:harness|drivers|mocks|tests|calibration)/[a-z_/]*)(?:\{([a-z_,]+)\})?/?`", page)
    assert len(named) > 15
    for folder, inner in named:
        for name in inner.split(",") if inner else [""]:
            path = ROOT / folder / name
            assert path.is_dir() or path.with_suffix(".py").is_file(), path


@pytest.mark.parametrize("name", EXPERIMENTS)
def test_every_row_of_the_table_of_experiments_resolves(name: str) -> None:
    row: ExperimentRow = EXPERIMENTS[name]
    if row.value is None:
        assert row.command != "replay"
        return
    experiment = loaded(row.value)
    assert isinstance(experiment, Experiment)
    assert experiment.name == name
    assert row.section is not None
    assert row.model is not None
    section = loaded(row.model)
    assert issubclass(section, Section)
    assert section.table == row.section
    assert experiment.section is section


def test_no_two_public_classes_share_a_name() -> None:
    homes: dict[str, list[str]] = {}
    for room in rooms():
        for path in room.glob("*.py"):
            for node in ast.parse(path.read_text(encoding="utf-8")).body:
                if isinstance(node, ast.ClassDef) and not node.name.startswith("_"):
                    homes.setdefault(node.name, []).append(path.relative_to(ROOT).as_posix())
    assert {name: paths for name, paths in homes.items() if len(paths) > 1} == {}
