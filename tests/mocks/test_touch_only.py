"""A run without sound loads no mode, no room, no microphone and no box; one with sound does."""

import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
OF_SOUND = (
    "harness.sim.modal.modal",
    "harness.sim.sound.room",
    "mocks.world.sound",
    "mocks.daq.strike_counts",
    "mocks.daq.box",
)

BENCH = """
from pathlib import Path
from harness.basics.mesh import Mesh
from harness.bench.scene import scene_from_options
from harness.effects.scene_object import known_object
from harness.bench.station import RunContext
from harness.bench.station_file import load_station, station_path
from mocks.in_process.bench import in_process_bench
scene = scene_from_options("builtin:wrench")
context = RunContext(Path("unused.json"), known_object(scene).mesh, 1, "none")
bench = in_process_bench(scene, load_station(station_path("mock")), context)
assert "hammer" not in bench.instruments
"""


PARTS = {
    "the lab": "import mocks.lab",
    "in process": BENCH,
    "sound": "import mocks.daq.strike_counts, mocks.world.instrument, mocks.daq.box",
}


@pytest.fixture(scope="module")
def loaded() -> dict[str, set[str]]:
    """Modules that one process has loaded after each part."""
    program = "".join(f"{part}\nimport sys\nprint(*sys.modules)\n" for part in PARTS.values())
    said = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, check=True, cwd=ROOT
    ).stdout.splitlines()
    return {name: set(line.split()) for name, line in zip(PARTS, said, strict=True)}


@pytest.mark.parametrize("part", ["the lab", "in process"])
def test_a_touch_only_run_loads_nothing_of_sound(loaded: dict[str, set[str]], part: str) -> None:
    assert loaded[part].isdisjoint(OF_SOUND)


def test_what_sound_loads_is_known(loaded: dict[str, set[str]]) -> None:
    assert loaded["sound"] >= set(OF_SOUND)
