"""Hostile text files are refused in one sentence, within 2 GiB and a minute of computing each."""

import json
import subprocess
import sys

import pytest

from tests.hard_cases.hostile_text import CPU_SECONDS, FILES, write_files


@pytest.fixture(scope="module")
def read(tmp_path_factory: pytest.TempPathFactory) -> dict[str, tuple[str, float]]:
    folder = tmp_path_factory.mktemp("hostile")
    write_files(folder)
    words = [sys.executable, "-m", "tests.hard_cases.hostile_text", str(folder)]
    ended = subprocess.run(words, capture_output=True, text=True, timeout=900, check=False)
    assert ended.returncode == 0, ended.stderr[-2000:]
    found: dict[str, tuple[str, float]] = json.loads(ended.stdout)
    return found


@pytest.mark.parametrize("name", [*FILES, "damaged.obj"])
def test_a_hostile_text_is_refused_in_one_sentence(name: str, read: dict[str, tuple[str, float]]) -> None:
    said, seconds = read[name]
    assert said.startswith("refused: ")
    assert name in said
    assert name != "bomb.obj" or "more than 400,000 vertices" in said
    assert len(said) < 300
    assert "\n" not in said
    assert seconds < CPU_SECONDS
