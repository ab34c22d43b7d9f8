"""The wheel works in any folder: stations, scenes, ObjectFiles and curves are in it, found by name."""

import json
import os
import shutil
import subprocess
import sys
import zipfile
from importlib.metadata import version
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PACKAGES = ("calibration", "drivers", "experiments", "harness", "mocks", "touchstone")

COMMANDS = (
    ("object", "render", "vision", "mug", "--out", "mug.png"),
    ("explain", "objects/mug"),
    ("demo",),
    ("calibrate", "taxim", "--station", "stations/mock.toml", "--ball-radius", "2mm", "--presses", "16"),
    ("init", "lab"),
    ("cd", "lab"),
    (*("run", "contact-localization", "--station", "bench"), *("--scene", "mug", "--contacts", "1")),
    ("explain", "scenes/mug_touch.toml"),
)

PROGRAM = """
import json, os, sys
from pathlib import Path
import harness
from harness.cli import invoke
if not Path(harness.__file__).is_relative_to(sys.argv[1]):
    sys.exit(f"another harness: {harness.__file__}")
for words in json.loads(sys.argv[2]):
    if words[0] == "cd":
        os.chdir(words[1])
    elif invoke([*words, "--json"]) != 0:
        sys.exit(f"touchstone {' '.join(words)} failed")
"""


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The wheel, unpacked."""
    source, out = tmp_path_factory.mktemp("source"), tmp_path_factory.mktemp("wheel")
    for name in PACKAGES:
        shutil.copytree(ROOT / name, source / name, ignore=shutil.ignore_patterns("__pycache__"))
    for name in ("pyproject.toml", "README.md", "LICENSE", "NOTICE"):
        shutil.copy(ROOT / name, source / name)
    # The extra `dev` installs a setuptools that builds it; else pip fetches one.
    own = ["--no-build-isolation"] if int(version("setuptools").partition(".")[0]) >= 77 else []
    command = [
        sys.executable,
        "-m",
        "pip",
        "wheel",
        ".",
        "--no-deps",
        "--quiet",
        "--wheel-dir",
        str(out),
        *own,
    ]
    subprocess.run(command, cwd=source, check=True)
    (wheel,) = out.glob("*.whl")
    with zipfile.ZipFile(wheel) as archive:
        archive.extractall(out / "site")
    return out / "site"


def test_its_first_commands_work_in_an_empty_folder_and_in_a_new_project(site: Path, tmp_path: Path) -> None:
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM, str(site), json.dumps(COMMANDS)],
        cwd=tmp_path,
        env={**os.environ, "PYTHONPATH": str(site)},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr[-3000:]
    assert (tmp_path / "mug.png").is_file()
    assert len(list((tmp_path / "runs").iterdir())) >= 2
    assert len(list((tmp_path / "lab" / "runs").glob("*/result.json"))) == 1
