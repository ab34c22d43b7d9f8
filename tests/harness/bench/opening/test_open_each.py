"""Instruments opened each by itself: what opens is shown, what does not is named, and nothing else stops."""

from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from harness.basics.errors import BenchFault, ProtectiveStop, TouchstoneError, WrongUse
from harness.bench.device import ARM, Channel, Health, Reading
from harness.bench.instruments import section as section_module
from harness.bench.instruments.section import KINDS
from harness.bench.station import RunContext, check_bench, open_station, scene_of_all
from harness.bench.station_file import Station, load_station, station_path
from harness.commands import check as command
from harness.commands.camera import camera as photograph
from harness.objects.household import build


class Fake:
    """Stands for a driver; ``fails`` names what does not work."""

    log: list[str]
    fails: dict[str, TouchstoneError]

    def __init__(self, name: str, **_: object) -> None:
        self.name = name

    def open(self) -> None:
        self._do("open")

    def close(self) -> None:
        self._do("close")

    def read(self, count: int, timeout: float) -> Reading:
        self._do("read")
        return Reading(
            Channel("x", "count", (1,), "uint8"), np.arange(count, dtype=np.float64), np.zeros((count, 1))
        )

    def health(self) -> Health:
        return Health(self.name, "", 1.0, 0, None)

    def state(self) -> Any:
        return type("State", (), {"safety": "normal"})

    def _do(self, verb: str) -> None:
        self.log.append(f"{self.name} {verb}")
        if f"{self.name} {verb}" in self.fails:
            raise self.fails[f"{self.name} {verb}"]


class FakeArm(Fake):
    """Stands for the arm's driver."""

    def stop(self) -> None:
        self._do("stop")


@pytest.fixture(autouse=True)
def fakes(monkeypatch: pytest.MonkeyPatch) -> type[Fake]:
    Fake.log, Fake.fails = [], {}
    fakes = {
        KINDS["ur"].driver: partial(FakeArm, "arm"),
        KINDS["gelsight-http"].driver: partial(Fake, "gel"),
        KINDS["camera-http"].driver: partial(Fake, "camera"),
    }
    monkeypatch.setattr(section_module, "loaded", fakes.__getitem__)
    return Fake


@pytest.fixture
def station() -> Station:
    bench = load_station(station_path("example_bench"))
    return bench.model_copy(update={"hammer": None, "microphone": None})


def context(folder: Path) -> RunContext:
    return RunContext(folder / "truth.json", build("mug"))


def test_what_does_not_open_is_named_and_the_rest_is_read(
    tmp_path: Path, station: Station, fakes: type[Fake]
) -> None:
    fakes.fails = {"arm open": BenchFault("no answer; check the cable"), "camera read": BenchFault("dark")}
    with open_station(station, scene_of_all(station), context(tmp_path), each=True) as bench:
        assert bench.find(ARM) is None
        with pytest.raises(BenchFault, match="no answer; check the cable"):
            bench.get(ARM)
        found = check_bench(bench)
    assert [health.name for health in found.instruments] == ["gel"]
    assert {name: str(error) for name, error in found.failures.items()} == {
        "arm": "no answer; check the cable",
        "camera": "dark",
    }
    assert found.safety is None
    assert fakes.log[-2:] == ["camera close", "gel close"]


def test_the_arm_is_stopped_before_anything_closes(
    tmp_path: Path, station: Station, fakes: type[Fake]
) -> None:
    with open_station(station, scene_of_all(station), context(tmp_path), each=True):
        begun = len(fakes.log)
    assert fakes.log[begun:] == ["arm stop", "camera close", "gel close", "arm close"]


@pytest.mark.parametrize(
    ("failure", "code"), [(None, 0), (BenchFault("unplugged"), 1), (ProtectiveStop("stopped"), 3)]
)
def test_a_check_s_exit_code_is_that_of_the_worst(
    failure: TouchstoneError | None,
    code: int,
    station: Station,
    fakes: type[Fake],
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    fakes.fails = {} if failure is None else {"arm open": failure}
    monkeypatch.setattr("harness.tasks.bench.load_station", lambda _: station)
    assert command.check("example_bench", seconds=0.0) == code
    out = capsys.readouterr()
    assert "gel" in out.out
    assert failure is None or str(failure) in out.err


def test_a_camera_opens_alone(tmp_path: Path, station: Station, fakes: type[Fake]) -> None:
    with open_station(station, scene_of_all(station), context(tmp_path), only=["gel"]) as bench:
        bench.gel.read(1, 1.0)
    assert fakes.log == ["gel open", "gel read", "gel close"]


@pytest.mark.parametrize(("name", "words"), [("gle", "'gle'.*'gel'"), ("scene", r"\[camera\]")])
def test_a_camera_that_is_not_there_is_wrong_use(
    name: str,
    words: str,
    tmp_path: Path,
    station: Station,
    fakes: type[Fake],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    blind = station.model_copy(update={"camera": None})
    monkeypatch.setattr("harness.tasks.bench.load_station", lambda _: blind)
    with pytest.raises(WrongUse, match=words):
        photograph(name, tmp_path / "live.png", "example_bench")
    assert fakes.log == []
