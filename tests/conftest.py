"""Fixtures that every test may ask for."""

import os
from pathlib import Path

import pytest

_CANDIDATES = (Path(__file__).parents[2] / "shared" / "data",)


def find_shared_data() -> Path | None:
    """The folder of real data, from TOUCHSTONE_DATA or beside the checkout; None where absent."""
    named = os.environ.get("TOUCHSTONE_DATA")
    candidates = (Path(named),) if named else _CANDIDATES
    return next((folder for folder in candidates if (folder / "MANIFEST.md").exists()), None)


@pytest.fixture(scope="session")
def shared_data() -> Path:
    """Real meshes, presses and recordings; the test is skipped with a reason where they are absent."""
    folder = find_shared_data()
    if folder is None:
        pytest.skip("real data not found: put it at ../shared/data or name its folder in TOUCHSTONE_DATA")
    return folder
