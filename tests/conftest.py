"""Fixtures that every test may ask for."""

from pathlib import Path

import pytest
from real_data import WHY_NOT, find_shared_data


@pytest.fixture(scope="session")
def shared_data() -> Path:
    """Real meshes, presses and recordings; the test is skipped with a reason where they are absent."""
    folder = find_shared_data()
    if folder is None:
        pytest.skip(WHY_NOT)
    return folder
