"""Fixtures that every test may ask for."""

from pathlib import Path

import pytest
from hypothesis import settings
from real_data import WHY_NOT, find_shared_data

from harness.scene import SceneFile, load_scene
from harness.station_file import Station, load_station

ROOT = Path(__file__).parents[1]

# One commit gets one verdict; `make hunt` draws other cases every time.
settings.register_profile("verdict", derandomize=True)
settings.register_profile("hunt", derandomize=False, print_blob=True)
settings.load_profile("verdict")


@pytest.fixture(scope="session")
def shared_data() -> Path:
    """Real meshes, presses and recordings; the test is skipped with a reason where they are absent."""
    folder = find_shared_data()
    if folder is None:
        pytest.skip(WHY_NOT)
    return folder


@pytest.fixture(scope="session")
def scene() -> SceneFile:
    """The mug to be touched, as the example says."""
    return load_scene(ROOT / "scenes" / "mug_touch.toml")


@pytest.fixture(scope="session")
def station() -> Station:
    """The mocked bench, as the example says."""
    return load_station(ROOT / "stations" / "mock.toml")
