"""A new kind of instrument is one driver, one section, one mock and one row; nothing else knows of it."""

import sys
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import pytest

from harness.basics.errors import BenchFault, WrongUse
from harness.bench import mock_lab
from harness.bench.device import Health, Reading
from harness.bench.experiments import EXPERIMENTS
from harness.bench.instruments.section import KINDS
from harness.bench.scene import Sensors, scene_from_options
from harness.bench.station import Bench, Checked, check_bench, open_station
from harness.bench.station_file import Station, load_station, station_path
from harness.experiment.begin import begin
from harness.experiment.experiment import Helpers
from harness.experiment.perform import perform_on
from harness.experiment.report_content import ReportTable
from harness.recording.recording import Recording
from harness.recording.run_folder import RunFiles
from harness.recording.session import Quiet
from harness.recording.step_file import Step
from harness.report.run_page import list_instruments
from harness.report.wording import rate
from harness.tasks.bench import StationCheck
from mocks.in_process.bench import in_process_bench
from tests.experiments.toy.experiment import EXPERIMENT
from tests.experiments.toy.test_toy import ROW as TOY
from tests.harness.bench.thermometer.mock import KELVIN
from tests.harness.bench.thermometer.section import ROW, THERMOMETER

TABLE = '\n[instruments.thermometer]\nkind = "thermometer-line"\nserial = "T-7"\n'
LAB = f"""
import sys
sys.path.insert(0, {str(Path(__file__).parents[4])!r})
from harness.bench.instruments.section import KINDS
from tests.harness.bench.thermometer.section import ROW
KINDS["thermometer-line"] = ROW
from mocks.lab import main
sys.exit(main())
"""


@pytest.fixture(scope="module")
def station(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Station]:
    path = tmp_path_factory.mktemp("station") / "warm.toml"
    path.write_text(station_path("mock").read_text(encoding="utf-8") + TABLE, encoding="utf-8")
    with pytest.MonkeyPatch.context() as patch:
        patch.setitem(KINDS, "thermometer-line", ROW)
        patch.setattr(mock_lab, "COMMAND", (sys.executable, "-c", LAB))
        patch.setitem(EXPERIMENTS, "toy", TOY)
        yield load_station(path)


class Performer:
    """Reads the thermometer and the scene camera, and moves nothing."""

    plan_key = "steps"

    def steps(self, recording: Recording) -> Iterator[Step]:
        for index, parameters in enumerate(recording.planned("steps")):
            if index >= recording.committed:
                yield Step(index, "press", parameters)

    def perform(self, _step: Step, bench: Bench) -> Sequence[Reading]:
        return (bench.get(THERMOMETER).read(3, 5.0),)


@dataclass(frozen=True)
class Done:
    checked: Checked
    health: Mapping[str, Health]
    run: RunFiles
    after: BenchFault


@pytest.fixture(scope="module")
def done(station: Station, tmp_path_factory: pytest.TempPathFactory) -> Done:
    def performer(_run: RunFiles, _helpers: Helpers) -> Performer:
        return Performer()

    wanted = scene_from_options("builtin:mug")
    scene = wanted.model_copy(update={"sensors": Sensors(camera=True)})
    recording = begin(EXPERIMENT, scene, station, 3, "none", tmp_path_factory.mktemp("runs") / "r").recording
    run = RunFiles(recording)
    with open_station(run.station, run.scene, run.context) as bench:
        checked = check_bench(bench)
        performed = perform_on(replace(EXPERIMENT, performer=performer), bench, run, Quiet())
        assert bench.lab is not None
        bench.lab.fault("thermometer", "unplug")
        with pytest.raises(BenchFault) as gone:
            bench.get(THERMOMETER).read(50, 5.0)
    return Done(checked, performed.health, run, gone.value)


def test_it_is_read_into_the_steps(done: Done) -> None:
    for step in done.run.recording.steps():
        reading = step.readings["thermometer.temperature"]
        assert reading.values.tolist() == [KELVIN] * 3
        assert reading.channel.unit == "K"


def test_its_health_and_the_scene_camera_s_are_in_the_report(done: Done) -> None:
    assert list(done.health) == ["arm", "gel", "camera", "thermometer"]
    table = list_instruments(done.run, done.health)
    assert isinstance(table, ReportTable)
    named = {row[0]: row for row in table.rows}
    assert named["camera"][3] == rate(done.health["camera"].rate)
    assert named["thermometer"][1] == "thermometer T-7"
    assert named["thermometer"][4] == rate(10.0)
    assert named["thermometer"][2] == str(3 * done.run.recording.committed)


def test_check_states_how_it_does_and_what_it_reads(done: Done) -> None:
    assert [health.name for health in done.checked.instruments] == ["arm", "gel", "camera", "thermometer"]
    assert done.checked.instruments[-1].detail == f"{KELVIN:.1f} K"
    tree = StationCheck.of("thermometer", done.checked).as_json()
    assert tree["thermometer_levels"] == {"temperature_k": KELVIN}
    assert tree["hammer_levels"] is None


def test_its_far_end_takes_faults(done: Done) -> None:
    assert "check its cable" in str(done.after)


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('"thermometer-line"', '"thermometer-lime"', r"instruments\.thermometer.*'thermometer-line'"),
        ('serial = "T-7"', 'serials = "T-7"', r"instruments\.thermometer.*'serials'.*'serial'"),
        ('serial = "T-7"', 'address = "1.2.3.4:5"', r"'instruments\.thermometer\.address'.*mocked bench"),
        ("instruments.thermometer", "instruments.gel", r"instruments\.gel"),
    ],
)
def test_a_mistake_in_its_table_is_named(
    station: Station, tmp_path: Path, old: str, new: str, words: str
) -> None:
    path = tmp_path / "s.toml"
    text = station_path("mock").read_text(encoding="utf-8") + TABLE.replace(old, new)
    path.write_text(text, encoding="utf-8")
    with pytest.raises(WrongUse, match=words):
        load_station(path)


def test_a_bench_without_a_simulation_of_it_names_it(station: Station, done: Done) -> None:
    with pytest.raises(WrongUse, match=r"thermometer.*--bench wires"):
        in_process_bench(done.run.scene, station, done.run.context)
