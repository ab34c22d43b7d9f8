"""A bench that is opened from a station file, its check, and single pictures of its cameras."""

import tempfile
import time
from collections.abc import Collection, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from harness.basics.errors import SafetyStop, WrongUse
from harness.basics.files.named_file import nearest
from harness.basics.result import HIDDEN, JSON_ONLY, JsonValue, Result, json_value
from harness.basics.whole_file import write_bytes_whole
from harness.bench.device import CAMERA, GEL, Health
from harness.bench.scene import SceneFile, scene_from_options
from harness.bench.station import Bench, Checked, RunContext, check_bench, scene_of_all
from harness.bench.station import open_station as open_instruments
from harness.bench.station_file import load_station, station_path
from harness.effects.scene_object import known_object
from harness.picture.image_file import png_bytes

_FRAMES, _FRAME_TIMEOUT = 10, 10.0
"""Frames that are read, of which the last is the picture, and seconds to wait for them."""


@contextmanager
def open_station(
    station: str = "mock",
    scene: SceneFile | None = None,
    only: Collection[str] | None = None,
    each: bool = False,
) -> Iterator[Bench]:
    """Open the instruments of a bench; on exit the arm is stopped first, then all are closed. Nothing moves.

    Args:
        station: name or file.
        scene: selects the instruments, and is what a mocked bench shows; every instrument and a mug if None.
        only: names of the instruments to open; None for all that the scene calls for.
        each: whether instruments that do not open are listed in ``Bench.failures`` and the others stay open.

    Raises:
        BenchFault: an instrument did not open: each is named, with the cable to check.
        SafetyStop: an instrument refused for safety's sake.
    """
    bench_file = load_station(station_path(station))
    shown = scene_of_all(bench_file, scene)
    with tempfile.TemporaryDirectory(prefix="touchstone-bench-") as folder:
        context = RunContext(Path(folder) / "truth.json", known_object(shown).mesh)
        with open_instruments(bench_file, shown, context, only=only, each=each) as bench:
            yield bench


@dataclass(frozen=True)
class StationCheck(Result):
    """Health of every instrument of a bench."""

    station: str
    safety: str | None  #: state of the arm; None if it did not open.
    instruments: tuple[Health, ...] = field(metadata=JSON_ONLY)  #: that opened and send something.
    failures: Mapping[str, str] = field(metadata=JSON_ONLY)  #: by name, why an instrument does not.
    levels: Mapping[str, Mapping[str, float]] = field(metadata=HIDDEN)  #: of instruments at rest, by name.
    exit_code: int = field(metadata=HIDDEN)  #: 0, or that of the worst failure.

    @classmethod
    def of(cls, station: str, checked: Checked) -> "StationCheck":
        """Describe the instruments of a station that were read."""
        unsafe = any(isinstance(error, SafetyStop) for error in checked.failures.values())
        return cls(
            station=station,
            safety=checked.safety,
            instruments=checked.instruments,
            failures={name: str(error) for name, error in checked.failures.items()},
            levels=checked.levels,
            exit_code=SafetyStop.exit_code if unsafe else int(bool(checked.failures)),
        )

    def as_json(self) -> dict[str, JsonValue]:
        """Return the fields, and the levels under ``hammer_levels`` and the like."""
        levels = {f"{name}_levels": json_value(levels) for name, levels in self.levels.items() if levels}
        return {**super().as_json(), "hammer_levels": None, **levels}

    def summary(self) -> tuple[str, ...]:
        """List the instruments that send something."""
        lines = []
        for health in self.instruments:
            latency = "not known" if health.latency is None else f"{1e3 * health.latency:.1f} ms"
            lines.append(
                f"{health.name}: {health.identity}; {health.rate:.1f} Hz, {health.drops} dropped, latency "
                f"{latency}{f'; {health.detail}' if health.detail else ''}"
            )
        return tuple(lines)


def check_station(station: str = "mock", duration: float = 3.0) -> StationCheck:
    """Open every instrument of a bench and measure rate, drops, latency and level. Nothing moves.

    Args:
        station: name or file.
        duration: time to watch each stream, in s.

    Raises:
        TouchstoneError: the mocked lab of a mocked station did not start.
    """
    with open_station(station, each=True) as bench:
        time.sleep(duration)
        checked = check_bench(bench)
    return StationCheck.of(station, checked)


@dataclass(frozen=True)
class TakenPicture(Result):
    """A picture that a camera of a bench took."""

    camera: str  #: ``"gel"`` or ``"scene"``.
    identity: str  #: model and serial number.
    rows: int
    columns: int
    rate_hz: float
    drops: int  #: frames lost since opening.
    detail: str
    picture: Path  #: PNG file.


def take_picture(
    camera: str, out: Path, station: str = "mock", scene: SceneFile | None = None
) -> TakenPicture:
    """Write what a camera of a bench sees now; the arm and all else stay closed.

    Args:
        camera: ``"gel"`` or ``"scene"``.
        out: PNG file to write.
        station: name or file.
        scene: what a mocked bench shows; a mug if None.

    Raises:
        WrongUse: no such camera, or the station has none.
        BenchFault: it did not open; the cable to check is named.
    """
    cameras = {"gel": GEL, "scene": CAMERA}
    if camera not in cameras:
        raise WrongUse(f"no camera {camera!r}; {nearest(camera, cameras)}")
    name = cameras[camera]
    with open_station(station, scene or scene_from_options("builtin:mug"), only=[name]) as bench:
        source = bench.get(name)
        frame = np.asarray(source.read(_FRAMES, timeout=_FRAME_TIMEOUT).values[-1], dtype=np.uint8)
        health = source.health()
    write_bytes_whole(out, png_bytes(frame))
    rows, columns = frame.shape[:2]
    return TakenPicture(camera, health.identity, rows, columns, health.rate, health.drops, health.detail, out)
