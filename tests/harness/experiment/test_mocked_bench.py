"""A mocked bench by its cables or without them: the run says which, and goes on with the same."""

from pathlib import Path
from typing import Any

import pytest

from experiments.contact_localization.experiment import EXPERIMENT
from harness.basics.errors import WrongUse
from harness.bench.station_file import Station, load_station, station_path
from harness.experiment.begin import begin
from harness.experiment.perform import IN_PROCESS, WIRES, describe_bench, perform_on_bench
from harness.recording.recording import Recording
from harness.recording.run_folder import RunFiles
from harness.recording.session import Quiet
from tests.support.whole_run import touch_scene


class Stops(Quiet):
    """Ctrl-C after a step."""

    def ended(self, step: Any, seconds: float) -> None:
        raise KeyboardInterrupt


@pytest.fixture
def no_wires(monkeypatch: pytest.MonkeyPatch) -> None:
    def opened(*_: object) -> None:
        raise AssertionError("a bench in process opens no wire")

    monkeypatch.setattr("harness.experiment.perform.open_station", opened)


def test_a_run_in_process_opens_no_wire_and_goes_on_without_one(
    tmp_path: Path, station: Station, no_wires: None
) -> None:
    scene = touch_scene(contacts=2)
    begin(EXPERIMENT, scene, station, 3, None, tmp_path / "run", IN_PROCESS)
    recording = Recording(tmp_path / "run")
    assert recording.header.mock is not None
    assert recording.header.mock["bench"] == IN_PROCESS
    with pytest.raises(KeyboardInterrupt):
        perform_on_bench(EXPERIMENT, RunFiles(recording), Stops())
    assert recording.committed == 1
    assert perform_on_bench(EXPERIMENT, RunFiles(Recording(tmp_path / "run")), Quiet()).complete
    assert recording.committed == 2


def test_a_mocked_run_is_in_process_by_default(tmp_path: Path, station: Station, no_wires: None) -> None:
    recording = begin(EXPERIMENT, touch_scene(contacts=1), station, 3, None, tmp_path / "run").recording
    assert "in this process" in describe_bench(recording)
    assert perform_on_bench(EXPERIMENT, RunFiles(recording), Quiet()).complete


def test_a_run_takes_the_wires_on_request(tmp_path: Path, station: Station, no_wires: None) -> None:
    begun = begin(EXPERIMENT, touch_scene(contacts=1), station, 3, None, tmp_path / "run", WIRES)
    recording = begun.recording
    assert "at the far end of its cable" in describe_bench(recording)
    with pytest.raises(AssertionError, match="opens no wire"):
        perform_on_bench(EXPERIMENT, RunFiles(recording), Quiet())


@pytest.mark.parametrize(("gap", "bench"), [("none", None), (None, IN_PROCESS)])
def test_a_real_bench_has_no_gap_and_no_process_of_ours(
    gap: str | None, bench: str | None, tmp_path: Path
) -> None:
    real = load_station(station_path("example_bench"))
    option = "--gap" if bench is None else "--bench"
    with pytest.raises(WrongUse, match=option):
        begin(EXPERIMENT, touch_scene(contacts=1), real, 3, gap, tmp_path / "run", bench)
    assert not (tmp_path / "run").exists()
