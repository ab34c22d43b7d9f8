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


def loaded_after(program: str) -> set[str]:
    said = subprocess.run(
        [sys.executable, "-c", program + "\nimport sys\nprint(*sys.modules)"],
        capture_output=True,
        text=True,
        check=True,
        cwd=ROOT,
    )
    return set(said.stdout.split())


@pytest.mark.parametrize("program", [BENCH, "import mocks.lab"], ids=["in process", "the lab"])
def test_a_touch_only_run_loads_nothing_of_sound(program: str) -> None:
    assert loaded_after(program).isdisjoint(OF_SOUND)


def test_what_sound_loads_is_known() -> None:
    assert loaded_after("import mocks.daq.strike_counts, mocks.world.instrument, mocks.daq.box") >= set(
        OF_SOUND
    )
