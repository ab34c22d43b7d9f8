"""One object for every test that only reads it, and one to spoil."""

import shutil
from pathlib import Path

import pytest

from harness.objectfile.file import ObjectFile
from tests.samples.object_bench import egg_file


@pytest.fixture(scope="session")
def egg_object(tmp_path_factory: pytest.TempPathFactory) -> ObjectFile:
    """Read only."""
    return egg_file(tmp_path_factory.mktemp("objects") / "egg")


@pytest.fixture
def spoiled(egg_object: ObjectFile, tmp_path: Path) -> Path:
    """A copy's folder, for a test to damage."""
    shutil.copytree(egg_object.folder, tmp_path / "egg")
    return tmp_path / "egg"
