"""Stations: files are strict; a bench opens as a whole or not at all, and the arm is stopped first."""

import importlib
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from drivers.microphone.microphone import PortAudioMicrophone
from harness.basics.errors import BenchFault, CalibrationRefused, ProtectiveStop, SafetyStop, WrongUse
from harness.basics.mesh import Mesh
from harness.bench.device import CAMERA, HAMMER, Health
from harness.bench.instruments import arm as arm_module
from harness.bench.instruments import section as section_module
from harness.bench.instruments.section import KINDS
from harness.bench.named_files import SHIPPED
from harness.bench.scene import SceneFile, Sensors, scene_from_options
from harness.bench.station import RunContext, open_station
from harness.bench.station_file import Station, load_station, station_from_json, station_path

STATIONS = sorted((SHIPPED / "stations").glob("*.toml"))
REAL = SHIPPED / "stations" / "example_bench.toml"
MESH = Mesh(np.vstack([np.zeros(3), np.eye(3)]) * 0.1, np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]))


class Instrument:
    """Stands for a driver, and notes what is done to it."""

    log: list[str]
    fails: dict[str, Exception]

    def __init__(self, **options: Any) -> None:
        self.options = options
        marks = {"limits": "arm", "rows": "camera", "threshold_counts": "hammer"}
        self.name = next((name for option, name in marks.items() if option in options), "gel")

    def open(self) -> None:
        self._do("open")

    def close(self) -> None:
        self._do("close")

    def _do(self, verb: str) -> None:
        self.log.append(f"{self.name} {verb}")
        if f"{self.name} {verb}" in self.fails:
            raise self.fails[f"{self.name} {verb}"]


class MovingInstrument(Instrument):
    """An arm."""

    def stop(self) -> None:
        self._do("stop")


@pytest.fixture
def instruments(monkeypatch: pytest.MonkeyPatch) -> type[Instrument]:
    Instrument.log, Instrument.fails = [], {}
    arm = KINDS["ur"].driver
    monkeypatch.setattr(
        section_module, "loaded", lambda target: MovingInstrument if target == arm else Instrument
    )
    monkeypatch.setattr(arm_module, "loaded", lambda _: dict)
    return Instrument


def real() -> Station:
    """The example bench, with a calibration of its box that exists."""
    station = load_station(REAL)
    assert station.hammer is not None
    hammer = station.hammer.model_copy(update={"calibration": "acquisition_bench"})
    return station.model_copy(update={"hammer": hammer})


def opened(folder: Path, camera: bool = True, sound: bool = False) -> Any:
    return open_station(real(), scene(camera, sound), RunContext(folder / "truth.json", MESH))


def scene(camera: bool = True, sound: bool = False) -> SceneFile:
    made = scene_from_options("builtin:mug")
    return made.model_copy(update={"sensors": Sensors(camera=camera, sound=sound)})


def test_a_gel_that_sends_nothing_is_the_arms_alarm(
    instruments: type[Instrument], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    failures = iter(["", "gel sent no whole frame for 0.5 s"])

    def health(_: Instrument) -> Health:
        return Health("gel", "", 25.0, 0, None, failure=next(failures))

    monkeypatch.setattr(Instrument, "health", health, raising=False)
    with opened(tmp_path) as bench:
        assert [bench.arm.options["alarm"]() for _ in range(2)] == ["", "gel sent no whole frame for 0.5 s"]


@pytest.mark.parametrize("path", STATIONS, ids=lambda p: p.stem)
def test_an_example_station_reads_and_survives_json(path: Path) -> None:
    station = load_station(path)
    assert station_from_json(json.loads(station.model_dump_json()), "recording") == station


@pytest.mark.parametrize(
    "target",
    [arm_module.LIMITS, *(target for kind in KINDS.values() for target in vars(kind).values() if target)],
)
def test_every_import_string_of_the_table_resolves(target: str) -> None:
    module, _, name = target.partition(":")
    assert callable(vars(importlib.import_module(module))[name])


@pytest.mark.parametrize("path", STATIONS, ids=lambda p: p.stem)
def test_a_station_makes_the_real_drivers_without_opening_them(path: Path) -> None:
    station = load_station(path)
    mocked = dict.fromkeys(station.sections, "there") if station.mock is not None else {}
    where = real() if station.mock is None else station.with_addresses(mocked)
    built = {name: section.build(where) for name, section in where.sections.items()}
    assert list(built)[:4] == ["arm", "gel", "camera", "hammer"]
    assert vars(vars(built["arm"])["limits"]) == station.arm.safety.model_dump()


def test_the_hammer_s_threshold_is_in_counts_of_its_calibration(instruments: type[Instrument]) -> None:
    station = load_station(station_path("mock"))
    assert station.hammer is not None
    hammer: Any = station.hammer.build(station)
    calibration = hammer.options["calibration"]
    assert hammer.options["threshold_counts"] * calibration.newtons_per_count == pytest.approx(2.0, rel=0.01)
    assert (hammer.options["serial"], hammer.options["port"]) == ("mock-2108", "")


def test_a_scene_with_sound_needs_a_hammer(tmp_path: Path) -> None:
    deaf = load_station(station_path("mock")).model_copy(update={"hammer": None, "microphone": None})
    with pytest.raises(WrongUse, match=r"'mocked bench'.*\[hammer\]"):
        deaf.sections_for(Sensors(sound=True))


def test_the_tool_s_corners_and_the_hammer_s_tip_are_under_the_limits(instruments: type[Instrument]) -> None:
    station = load_station(REAL)
    arm: Any = station.arm.build(station)
    points = np.array(arm.options["tool_points"])
    assert points.shape == (6, 3)
    centre = load_station(REAL).flange_from_gel[:3, 3]
    assert points[1:5].mean(axis=0) == pytest.approx(centre)
    assert np.linalg.norm(points[1:5] - centre, axis=1) == pytest.approx(np.hypot(0.017, 0.015))
    assert points[5] == pytest.approx([0.1039, 0.0, 0.06])


def test_instruments_open_and_the_arm_is_stopped_before_anything_closes(
    tmp_path: Path, instruments: type[Instrument]
) -> None:
    with opened(tmp_path) as bench:
        assert instruments.log == ["arm open", "gel open", "camera open"]
        bench.mark(0, 0)
        assert bench.lab is None
    assert instruments.log[3:] == ["arm stop", "camera close", "gel close", "arm close"]


def test_a_camera_that_the_scene_does_not_call_for_is_not_opened(
    tmp_path: Path, instruments: type[Instrument]
) -> None:
    with opened(tmp_path, camera=False) as bench:
        assert bench.find(CAMERA) is None
        with pytest.raises(WrongUse, match=r"camera.*scene"):
            bench.get(CAMERA)
    assert "camera open" not in instruments.log


def test_the_hammer_is_opened_only_where_the_scene_asks_for_sound(
    tmp_path: Path, instruments: type[Instrument]
) -> None:
    with opened(tmp_path) as bench:
        assert bench.find(HAMMER) is None
    assert not any(line.startswith("hammer") for line in instruments.log)
    instruments.log.clear()
    with opened(tmp_path, sound=True) as bench:
        assert bench.find(HAMMER) is not None
    assert instruments.log == [
        *(f"{name} open" for name in ("arm", "gel", "camera", "hammer")),
        "arm stop",
        *(f"{name} close" for name in ("hammer", "camera", "gel", "arm")),
    ]


def test_every_failure_is_reported_and_what_was_opened_is_closed(
    tmp_path: Path, instruments: type[Instrument]
) -> None:
    instruments.fails = {
        "arm open": BenchFault("no controller at 1.2.3.4; check the network cable"),
        "camera open": BenchFault("no stream; check its cable"),
    }
    with pytest.raises(BenchFault, match="2 instruments") as caught, opened(tmp_path):
        pytest.fail("the bench was opened")
    assert "arm: no controller at 1.2.3.4" in str(caught.value)
    assert "camera: no stream" in str(caught.value)
    assert instruments.log == ["arm open", "gel open", "camera open", "gel close"]


@pytest.mark.parametrize(
    ("failures", "kind"),
    [
        ({"gel open": BenchFault("x")}, BenchFault),
        ({"arm open": ProtectiveStop("x")}, ProtectiveStop),
        ({"arm open": SafetyStop("x"), "gel open": BenchFault("y")}, SafetyStop),
    ],
)
def test_the_exit_code_is_that_of_the_gravest_failure(
    tmp_path: Path, instruments: type[Instrument], failures: dict[str, Exception], kind: type[Exception]
) -> None:
    instruments.fails = failures
    with pytest.raises(kind) as caught, opened(tmp_path):
        pytest.fail("the bench was opened")
    assert type(caught.value) is kind


def test_a_failure_on_the_way_out_hides_none_before_it(
    tmp_path: Path, instruments: type[Instrument], caplog: pytest.LogCaptureFixture
) -> None:
    instruments.fails = {"arm stop": BenchFault("the arm is gone"), "gel close": BenchFault("gel stuck")}
    with pytest.raises(KeyError, match="first"), opened(tmp_path):
        raise KeyError("first")
    assert instruments.log[3:] == ["arm stop", "camera close", "gel close", "arm close"]
    assert "the arm is gone" in caplog.text
    assert "gel stuck" in caplog.text


def test_a_failure_on_the_way_out_of_a_good_run_is_raised_and_the_rest_closed(
    tmp_path: Path, instruments: type[Instrument]
) -> None:
    instruments.fails = {"arm stop": BenchFault("the arm is gone")}
    with pytest.raises(BenchFault, match="the arm is gone"), opened(tmp_path):
        pass
    assert instruments.log[3:] == ["arm stop", "camera close", "gel close", "arm close"]


def changed(old: str, new: str, folder: Path, name: str = "mock") -> Station:
    text = station_path(name).read_text(encoding="utf-8")
    assert old in text
    (folder / "s.toml").write_text(text.replace(old, new, 1), encoding="utf-8")
    return load_station(folder / "s.toml")


@pytest.mark.parametrize(
    ("name", "old", "new", "said"),
    [
        ("mock", 'rate = "500 Hz"', 'adress = "1.2.3.4"', "'arm.adress'.*'address'"),
        ("mock", 'kind = "ur"', 'kind = "urr"', "'arm.kind' = 'urr'"),
        ("mock", 'model = "ur5e"', 'model = "ur5"', "'ur5'.*'ur5e'"),
        ("mock", 'near = "10 mm"', "near = 10", " 10 .*unit"),
        ("mock", 'force_press = "10 N"', 'force_press = "10 kg"', "'10 kg'.*force"),
        ("mock", '"0.02 m"]', '"2 m"]', "workspace_low"),
        ("mock", 'rate = "500 Hz"', 'address = "127.0.0.1"', "mocked bench"),
        ("mock", "[mock]\ngap", "# gap", "'arm.address'"),
        ("example_bench", 'url = "http://gsr', '# url = "', "'gel.url'"),
        ("example_bench", 'serial = "5D3F21A0"', "# serial", "'hammer.port'"),
        ("mock", "striker_output", "striker_outputs", "'arm.striker_outputs'.*'striker_output'"),
        ("mock", "striker_output = 0 ", "# ", "'arm.striker_output'.*hammer.strike = 'arm'"),
        ("mock", "striker_output = 0", "striker_output = 2", "'arm.striker_output' = 2"),
        ("mock", 'stand_off = "6 mm"', 'standoff = "6 mm"', "'hammer.standoff'.*'stand_off'"),
        ("mock", 'strike = "arm"', 'strike = "operator"', "mocked bench"),
        ("mock", 'model = "DI-2108"', 'model = "2108"', "'2108'.*'DI-2108'"),
        (
            "mock",
            'serial = "mock-2108"',
            'port = "/dev/ttyACM0"',
            "mocked bench",
        ),
        ("mock", "[microphone]", "[microphon]", "'microphon'.*'microphone'"),
        ("mock", 'kind = "dataq"\nserial = "mock-378B02"', 'kind = "portaudio"', "'rate'"),
        (
            "mock",
            'kind = "dataq"\nserial = "mock-378B02"',
            'kind = "portaudio"\nrate = "44.0995 kHz"',
            "Hz",
        ),
        (
            "mock",
            'kind = "dataq"\nserial = "mock-378B02"',
            'kind = "portaudio"\nrate = "48 kHz"\ndevice = "hw:0"',
            "mocked bench",
        ),
        (
            "mock",
            'kind = "dataq"\nserial = "mock-378B02"',
            'kind = "portaudio"\nrate = "48 kHz"\nchannels = 2\nchannel = 2',
            "'channel' .*2.* 2",
        ),
        (
            "example_bench",
            'kind = "dataq"\nserial = "378B02-1234"',
            'kind = "portaudio"\nrate = "48 kHz"',
            "'microphone.device'",
        ),
        ("mock", 'serial = "mock-378B02"', 'device = "hw:0"', "'device' .*kind = 'portaudio'"),
        ("mock", "[frames.flange_from_hammer]", "[frames.flange_from_hamer]", "'flange_from_hammer'"),
    ],
)
def test_a_mistake_in_a_station_is_named(tmp_path: Path, name: str, old: str, new: str, said: str) -> None:
    with pytest.raises(WrongUse, match=said):
        changed(old, new, tmp_path, name)


@pytest.mark.parametrize(
    ("left_out", "said"),
    [
        (("hammer", "microphone"), r"'frames.flange_from_hammer' .*\[hammer\]"),
        (("hammer", "flange_from_hammer"), r"\[microphone\] .*\[hammer\]"),
        (("microphone",), r"\[microphone\]"),
        (("flange_from_hammer",), "'frames.flange_from_hammer'"),
    ],
)
def test_a_hammer_is_whole_or_not_there(left_out: tuple[str, ...], said: str) -> None:
    tree = json.loads(load_station(station_path("mock")).model_dump_json(by_alias=True))
    for key in left_out:
        del (tree["frames"] if key in tree["frames"] else tree)[key]
    with pytest.raises(WrongUse, match=said):
        station_from_json(tree, "the test")


def test_a_station_from_before_there_were_hammers_still_reads() -> None:
    tree = json.loads(load_station(station_path("mock")).model_dump_json(by_alias=True))
    del (
        tree["hammer"],
        tree["microphone"],
        tree["frames"]["flange_from_hammer"],
        tree["arm"]["striker_output"],
    )
    station = station_from_json(tree, "an old recording")
    assert (station.hammer, station.flange_from_hammer, len(station.tool_points)) == (None, None, 5)


def test_a_calibration_beside_the_station_is_found(tmp_path: Path) -> None:
    (tmp_path / "mine.npz").write_bytes(b"")
    station = changed('"gelsight_r15_bench"', '"mine.npz"', tmp_path)
    assert station.gel.calibration == str((tmp_path / "mine.npz").resolve())
    assert load_station(station_path("mock")).gel.calibration == "gelsight_r15_bench"


def test_markers_and_shadow_are_the_sensor_s(tmp_path: Path) -> None:
    markers = '[gel.markers]\nrows = 7\ncolumns = 9\nspacing = "2 mm"\nradius = "0.4 mm"\n\n[camera]'
    station = changed("[camera]", markers, tmp_path)
    assert station.gel.sensor.markers is not None
    assert station.gel.sensor.markers.spacing == 2e-3
    assert not station.gel.sensor.casts_shadow
    assert load_station(station_path("mock")).gel.sensor.markers is None


def test_stations_are_found_by_name_or_path(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    assert station_path("mock").name == "mock.toml"
    with pytest.raises(WrongUse, match=r"mok.*'mock'"):
        station_path("mok")
    with pytest.raises(WrongUse, match=r"'a/b\.toml'"):
        station_path("a/b.toml")
    (tmp_path / "stations").mkdir()
    (tmp_path / "stations" / "mine.toml").write_text("", encoding="utf-8")
    assert station_path("mine") == (tmp_path / "stations" / "mine.toml").resolve()


def test_the_camera_of_the_mocked_bench_looks_at_the_object() -> None:
    station = load_station(station_path("mock"))
    assert station.camera is not None
    base_from_camera = station.camera.base_from_camera.matrix
    in_camera = np.linalg.inv(base_from_camera) @ np.array([-0.5, 0.0, 0.3, 1.0])
    pixel = station.camera.focal_length * in_camera[:2] / in_camera[2]
    assert in_camera[2] > 0.0
    assert np.abs(pixel).max() < 5.0
    assert base_from_camera[2, 1] < 0.0  # image rows run downwards


def on_card(**microphone: object) -> Station:
    tree = json.loads(load_station(station_path("mock_sound_card")).model_dump_json(by_alias=True))
    tree["microphone"] |= microphone
    return station_from_json(tree, "the test")


def test_a_microphone_on_a_sound_card_is_made_as_the_station_says() -> None:
    station = on_card(channels=2, channel=1, latency="3 ms")
    assert station.own_microphone is not None
    made = station.own_microphone.build(station)
    assert isinstance(made, PortAudioMicrophone)
    form = made.form
    assert (form.rate, form.bits, form.channels, form.channel, form.latency) == (48000, 24, 2, 1, 0.003)
    assert station.own_microphone == station.microphone
    by_box = load_station(station_path("mock"))
    assert "microphone" not in by_box.sections
    assert by_box.own_microphone is None


def built_microphone(station: Station) -> object:
    return station.sections["microphone"].build(station)


def test_a_calibration_of_a_microphone_on_another_converter_is_refused() -> None:
    with pytest.raises(CalibrationRefused, match=r"8388607.*\[microphone\].*2147483647"):
        built_microphone(on_card(bits=32))
    tree = json.loads(on_card().model_dump_json(by_alias=True))
    tree["hammer"]["calibration"] = "acquisition_bench"
    with pytest.raises(CalibrationRefused, match=r"32767.*8388607"):
        built_microphone(station_from_json(tree, "the test"))


def test_the_box_of_a_hammer_heard_by_a_card_expects_its_second_input_shorted() -> None:
    hammer = on_card().hammer
    assert hammer is not None
    alone = hammer.acquisition.without_microphone
    assert (alone.microphone_offset, alone.microphone_full_scale_counts) == (0.0, alone.full_scale_counts)
    assert alone.newtons_per_count == hammer.acquisition.newtons_per_count
