"""Fixtures that every test may ask for, and which tests may run side by side."""

import functools
import gc
import os
from pathlib import Path
from typing import Final

import pytest
from hypothesis import settings
from xdist.scheduler import LoadScopeScheduling

from harness.basics.cores import own_cores
from harness.basics.store import default_folder
from harness.bench.named_files import SHIPPED
from harness.bench.scene import SceneFile, load_scene
from harness.bench.station_file import Station, load_station
from tests.support.real_data import WHY_NOT, find_shared_data

pytest_plugins = ["tests.support.cpu_limit"]

TESTS: Final = Path(__file__).parent
ROOT: Final = TESTS.parent
WIRES: Final = (
    "wire",
    "drivers",
    "runs/test_faults_on_wires.py",
    "runs/test_killed_while_striking.py",
    "runs/test_leftovers.py",
    "runs/test_own_sensor.py",
    "runs/test_runs_on_wires.py",
    "runs/test_scale_over_wires.py",
    "runs/test_shape_over_wires.py",
    "runs/test_wires_match_process.py",
    "mocks/daq",
    "mocks/ur",
    "mocks/camera/test_gelsight_stream.py",
    "mocks/test_lab_processes.py",
    "mocks/sound_card",
    "harness/bench/test_mock_lab.py",
)
"""Where processes keep each other's deadlines: one at a time, and before all that only computes."""

LONG: Final = (
    "wires",
    "runs/test_wheel.py",
    "runs/test_read_once.py",
    "runs/test_hostile_meshes.py",
    "runs/test_written_at_bc239515.py",
    "hard_cases/test_sound_hard_cases.py",
    "hard_cases/test_hostile_text.py",
    "runs/test_budget.py",
)
"""Groups that take longest: they begin first, so that none is left when the other workers have ended."""

# Kernels are also cached by tests with their own cache.
os.environ.setdefault("NUMBA_CACHE_DIR", str(default_folder() / "kernels"))

# At Python's thresholds, garbage collection takes a fifth of the CPU time of collecting the tests.
gc.set_threshold(50_000, 20, 20)

# One commit gets one verdict; `make hunt` draws other cases every time.
# A case's duration depends on how busy the machine is; tests/support/cpu_limit.py limits CPU time.
settings.register_profile("verdict", derandomize=True, deadline=None, max_examples=40)
settings.register_profile("hunt", derandomize=False, print_blob=True, deadline=None)
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
    return load_scene(SHIPPED / "scenes" / "mug_touch.toml")


@pytest.fixture(scope="session")
def station() -> Station:
    """The mocked bench, as the example says."""
    return load_station(SHIPPED / "stations" / "mock.toml")


class _ByFile(LoadScopeScheduling):  # type: ignore[misc]  # the library is not typed
    """What shares a file shares a worker, and so its fixtures; all that speaks over wires shares one."""

    def _split_scope(self, nodeid: str) -> str:
        return _group(ROOT / nodeid.split("::")[0])

    def _assign_work_unit(self, node: object) -> None:
        first = next((group for group in LONG if group in self.workqueue), None)
        if first is not None:
            self.workqueue.move_to_end(first, last=False)
        super()._assign_work_unit(node)


def pytest_xdist_make_scheduler(config: pytest.Config, log: object) -> _ByFile:
    """How tests are shared out."""
    return _ByFile(config, log)


def pytest_xdist_auto_num_workers() -> int:
    """Count the workers of ``-n auto``: one for each core, and one that mostly waits on wires."""
    return own_cores() + 1


def pytest_collection_finish() -> None:
    """Exempt modules and test items from garbage collection: they stay until the end."""
    gc.freeze()


def pytest_runtest_setup(item: pytest.Item) -> None:
    """A worker that has come to computing gives way to the one with deadlines."""
    if "PYTEST_XDIST_WORKER" in os.environ and _group(item.path) != "wires":
        _give_way()


@functools.cache
def _give_way() -> None:
    os.nice(10)


def _group(path: Path) -> str:
    inside = path.relative_to(TESTS)
    wired = any(inside.is_relative_to(place) for place in WIRES)
    return "wires" if wired else inside.as_posix()
