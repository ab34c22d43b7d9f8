"""Hostile glTF, 3MF and COLLADA files: each is refused in one sentence, within 2 GiB and 60 s."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from tests.support.hostile_meshes import FILES, MEMORY, SECONDS

LIMITS = {"vertices.3mf": "more than 300,000 vertices", "triangles.3mf": "at most 200,000 are read"}
"""Limits that a file must meet first; others would refuse it too."""


@pytest.fixture(scope="module")
def readings(tmp_path_factory: pytest.TempPathFactory) -> dict[str, dict[str, object]]:
    """Result of reading each file, by its name."""
    folder = tmp_path_factory.mktemp("hostile") / "files"
    # Every thread of a linear algebra library takes address space of its own.
    environment = {**os.environ, "OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"}
    done = subprocess.run(
        [sys.executable, "-m", "tests.support.hostile_meshes", str(folder), "--read"],
        capture_output=True,
        text=True,
        check=True,
        timeout=600,
        cwd=Path(__file__).parents[2],
        env=environment,
    )
    return {line["name"]: line for line in map(json.loads, done.stdout.splitlines())}


@pytest.mark.parametrize("name", FILES)
def test_a_hostile_file_is_refused_in_one_sentence(readings: dict[str, dict[str, object]], name: str) -> None:
    reading = readings[name]
    assert "status" not in reading, "the process died of its limits"
    errors = reading["errors"]
    assert isinstance(errors, list)
    for kind, text in errors:
        assert kind == "refused", f"{kind}: {text}"
        assert Path(name).name in text
        assert LIMITS.get(name, "") in text
        assert "\n" not in text
        assert text.isprintable()
        assert len(text) < 400
    assert float(str(reading["seconds"])) < SECONDS
    assert float(str(reading["peak"])) < MEMORY
