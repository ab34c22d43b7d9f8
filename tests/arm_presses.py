"""Calibrations by the arm for tests: on the bench in process, in simulated time."""

from pathlib import Path

from whole_run import Quiet

from calibration.taxim.arm_plan import PressSettings
from calibration.taxim.arm_session import BALL, Begun, ball_scene, begin, perform_on
from harness.recording import Recording
from harness.run_folder import RunFiles
from harness.station import Bench, RunContext
from harness.station_file import load_station, station_path
from mocks.in_process import in_process_bench

RADIUS = 2e-3


def begun(folder: Path, presses: int = 15, seed: int = 1, gap: str | None = None) -> Begun:
    """Planned and rehearsed on the mocked station; nothing has moved."""
    station = load_station(station_path("mock"))
    return begin(ball_scene(RADIUS), station, PressSettings(presses=presses), seed, gap, folder)


def opened(recording: Recording) -> Bench:
    """The run's bench, in process."""
    run = RunFiles(recording)
    assert run.scene.object.builtin == BALL
    mock = recording.header.mock
    assert mock is not None
    context = RunContext(recording.truth_path, run.mesh, recording.header.seed, mock["gap"])
    return in_process_bench(run.scene, run.station, context)


def performed(folder: Path, presses: int = 15, seed: int = 1, gap: str | None = None) -> Recording:
    """A whole run."""
    recording = begun(folder, presses, seed, gap).recording
    complete, _ = perform_on(opened(recording), recording, Quiet())
    assert complete
    return recording
