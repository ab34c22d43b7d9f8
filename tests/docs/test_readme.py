"""Every command of the README is run as it stands there, on small stand-ins for the files it names."""

import re
import shlex
from pathlib import Path

import pytest

from harness.cli import invoke
from tests.samples import published_trees
from tests.samples.published_files import write_published
from tests.support.whole_run import in_process_run, touch_scene

ROOT = Path(__file__).parents[2]
README = (ROOT / "README.md").read_text(encoding="utf-8")

ON_A_BENCH = ("run ", "demo ", "check ", "calibrate taxim --station")
MEASURED = ("tables ", "cost ", "replay RUN")
LONG = (*ON_A_BENCH, *MEASURED)
"""Commands that take up to a minute; each has quicker tests of its own."""

IN_ORDER = (
    "sim touch",
    "depth",
    "sim modes",
    "explain",
    "replay",
    "compare",
    "catalogue check",
    "object build",
    "object render",
    "object verify",
    "object import",
)


def commands() -> list[str]:
    """The lines that call the program, without their remarks."""
    lines = [line.partition("#")[0].strip() for line in README.splitlines()]
    return [line.removeprefix("touchstone ") for line in lines if line.startswith("touchstone ")]


QUICK = [line for line in commands() if not line.startswith(LONG)]


@pytest.fixture(scope="module")
def here(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with what the README's names stand for."""
    folder = tmp_path_factory.mktemp("readme")
    in_process_run(folder / "RUN", touch_scene(contacts=2), seed=3)
    (folder / "objects.csv").write_text("name,material,mesh\nbowl,ceramic,builtin:bowl\n", encoding="utf-8")
    return folder


def filled(line: str, shared: Path | None) -> list[str]:
    """The command's words, its names replaced by stand-ins."""
    words = {"CALIBRATION": str(ROOT / "harness/sim/optics/data/gelsight_r15_bench.npz")}
    if shared is not None:
        words["PRESSES"] = str(shared / "tactile" / "objectfolder_calibs" / "dataPack.npz")
    return [words.get(word, word) for word in shlex.split(line)]


def test_the_page_is_short_and_names_its_commands() -> None:
    assert len(README) <= 9000
    assert len(commands()) >= 15
    assert all(
        any(line.startswith(kind) for kind in (*LONG, *IN_ORDER, "calibrate taxim")) for line in commands()
    )


def test_the_snippet_runs() -> None:
    (snippet,) = re.findall(r"^```python\n(.*?)^```", README, flags=re.M | re.S)
    exec(compile(snippet, "README.md", "exec"), {})  # noqa: S102 - our own page


@pytest.mark.parametrize("line", [line for line in QUICK if "PRESSES" not in line and ".pth" not in line])
def test_a_quick_command_answers(line: str, here: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(here)
    assert invoke(filled(line, None)) == 0


@pytest.mark.slow  # measured data that do not change
def test_a_set_of_real_presses_is_calibrated(
    here: Path, shared_data: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (line,) = [line for line in QUICK if "PRESSES" in line]
    monkeypatch.chdir(here)
    assert invoke(filled(line, shared_data)) == 0


def test_a_published_file_is_imported(here: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("onnxscript", reason="the extra `author` is not installed")
    (line,) = [line for line in QUICK if ".pth" in line]
    monkeypatch.chdir(here)
    write_published(published_trees.second(), here / "ObjectFile.pth")
    assert invoke(filled(line, None)) == 0


@pytest.mark.slow
@pytest.mark.parametrize("line", [line for line in commands() if line.startswith(LONG)])
def test_a_long_command_answers(line: str, here: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(here)
    assert invoke(filled(line, None)) == 0
