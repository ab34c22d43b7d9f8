"""Instruments of a bench opened each by itself: what opens can be looked at, what does not is named."""

import math
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import ExitStack, contextmanager
from dataclasses import asdict, dataclass, replace
from functools import partial
from typing import Any, TypeVar

from harness.basics.errors import BenchFault, TouchstoneError, WrongUse
from harness.basics.files.named_file import nearest
from harness.bench.acquisition import strike_from_readings
from harness.bench.device import Arm, Health, ImpactHammer, Microphone, TactileCamera
from harness.bench.listening import capture
from harness.bench.scene import SceneFile, scene_from_options
from harness.bench.station import (
    Instrument,
    RunContext,
    make_arm,
    make_camera,
    make_gel,
    make_hammer,
    make_microphone,
    wired,
)
from harness.bench.station_file import Station

_Made = TypeVar("_Made", bound=Instrument)


@dataclass(frozen=True)
class Instruments:
    """Those that opened; None where the station has none, the scene needs none, or it did not open."""

    arm: Arm | None  #: which nothing moves.
    gel: TactileCamera | None  #: on its flange.
    camera: TactileCamera | None  #: that looks on.
    hammer: ImpactHammer | None  #: that strikes.
    microphone: Microphone | None  #: with a clock of its own.
    failures: Mapping[str, TouchstoneError]  #: by name, why one did not open.


def scene_of_all(station: Station, scene: SceneFile | None = None) -> SceneFile:
    """A scene that asks for every instrument of a station; of the mug where none is given."""
    scene = scene or scene_from_options("builtin:mug")
    has = {"sound": station.hammer is not None, "camera": station.camera is not None}
    return scene.model_copy(update={"sensors": scene.sensors.model_copy(update=has)})


@contextmanager
def open_each(station: Station, scene: SceneFile, run: RunContext) -> Iterator[Instruments]:
    """Open what opens; on exit close it and end the mocked lab. Nothing moves.

    Args:
        station: to open.
        scene: says whether camera and hammer are wanted, and what a mocked world shows.
        run: what a mocked world must know.

    Raises:
        TouchstoneError: the mocked lab did not start.
    """
    with ExitStack() as stack:
        where, _ = wired(stack, station, scene, run)
        failures: dict[str, TouchstoneError] = {}

        def opened(name: str, make: Callable[[Station], _Made | None]) -> _Made | None:
            try:
                instrument = make(where)
                if instrument is not None:
                    instrument.open()
                    stack.callback(instrument.close)
            except TouchstoneError as error:
                failures[name] = error
                return None
            return instrument

        arm, sound = opened("arm", make_arm), scene.sensors.sound
        if arm is not None:
            stack.callback(arm.stop)
        yield Instruments(
            arm=arm,
            gel=opened("gel", make_gel),
            camera=opened("camera", make_camera) if scene.sensors.camera else None,
            hammer=opened("hammer", make_hammer) if sound else None,
            microphone=opened("microphone", make_microphone) if sound else None,
            failures=failures,
        )


CAMERAS: Mapping[str, Callable[[Station], TactileCamera | None]] = {"gel": make_gel, "scene": make_camera}
"""By the name that ``touchstone camera`` takes."""


@contextmanager
def open_camera(name: str, station: Station, scene: SceneFile, run: RunContext) -> Iterator[TactileCamera]:
    """One camera of a station and nothing else, so that it is seen while the rest is still in its boxes.

    Args:
        name: ``gel`` or ``scene``.
        station: whose.
        scene: what a mocked world shows.
        run: what a mocked world must know.

    Raises:
        WrongUse: no such camera, or the station has none.
        BenchFault: it did not open; the cable to look at is named.
    """
    if name not in CAMERAS:
        raise WrongUse(f"no camera {name!r}; {nearest(name, CAMERAS)}")
    with ExitStack() as stack:
        where, _ = wired(stack, station, scene, run)
        camera = CAMERAS[name](where)
        if camera is None:
            raise WrongUse(f"the station {station.title!r} has no [camera]; add one to its file")
        camera.open()
        stack.callback(camera.close)
        yield camera


_LISTEN = 0.5
"""s."""

_ATTEMPTS = 3
"""Times that is listened where samples of the sound were lost: a computer may be busy for a moment."""

_HEARING = 20e-6
"""Pa, the reference of sound pressure levels (ISO 1683)."""


@dataclass(frozen=True)
class RestLevels:
    """What the hammer's box reads while nothing is struck."""

    force_rms_n: float  #: N, about its mean.
    pressure_rms_pa: float  #: Pa, about its mean.
    sound_level_db: float  #: of the pressure, over 20 uPa.


@dataclass(frozen=True)
class Checked:
    """How the instruments of a bench do."""

    instruments: tuple[Health, ...]  #: those that opened and send something.
    failures: Mapping[str, TouchstoneError]  #: by name, why the others do not.
    safety: str | None  #: the arm's; None where the arm did not open.
    levels: RestLevels | None  #: of the hammer's box; None where there is none or it failed.

    def as_json(self) -> dict[str, Any]:
        """For ``--json``."""
        return {
            "safety": self.safety,
            "instruments": [asdict(health) for health in self.instruments],
            "failures": {name: str(error) for name, error in self.failures.items()},
            "hammer_levels": None if self.levels is None else asdict(self.levels),
        }


def checked(bench: Instruments, station: Station) -> Checked:
    """Read each instrument that opened; one that sends nothing fails alone."""
    found: list[Health] = []
    failures = dict(bench.failures)

    def attempt(name: str, read: Callable[[], Iterable[Health]]) -> None:
        try:
            found.extend(read())
        except TouchstoneError as error:
            failures[name] = error

    safety, levels = None, None
    if bench.arm is not None:
        arm = bench.arm
        attempt("arm", lambda: [arm.health()])
        safety = arm.state().safety
    for name, camera in (("gel", bench.gel), ("camera", bench.camera)):
        if camera is not None:
            attempt(name, partial(_seen, camera))
    if bench.hammer is not None and "microphone" not in failures:
        try:
            levels = rest_levels(bench.hammer, bench.microphone, station)
        except TouchstoneError as error:
            failures["hammer"] = error
        else:
            attempt("hammer", partial(_heard, bench.hammer, bench.microphone, levels))
    return Checked(tuple(found), failures, safety, levels)


def _seen(camera: TactileCamera) -> list[Health]:
    camera.read(1, timeout=3.0)
    return [camera.health()]


def rest_levels(hammer: ImpactHammer, microphone: Microphone | None, station: Station) -> RestLevels:
    """Listen for a moment with nothing fired.

    Raises:
        BenchFault: the box failed.
        DataRefused: a channel rests where its calibration says that it cannot.
    """
    assert station.hammer is not None
    for _ in range(_ATTEMPTS):
        readings = capture(hammer, microphone, lambda: None, 0.0, _LISTEN, 0.0)
        by_name = {reading.channel.name: reading for reading in readings}
        rest = strike_from_readings(by_name, station.hammer.acquisition)
        if not rest.lost:
            break
    else:
        raise BenchFault(f"the microphone cannot be used: {rest.lost}; close what else runs, or try again")
    pressure = float(rest.pressure.std())
    # A converter that reads one count for ever is broken, not silent.
    level = 20.0 * math.log10(pressure / _HEARING) if pressure > 0.0 else -math.inf
    if not math.isfinite(level):
        raise BenchFault("the microphone reads the same count for ever; check its cable and its supply")
    return RestLevels(float(rest.force.std()), pressure, level)


def _heard(hammer: ImpactHammer, microphone: Microphone | None, levels: RestLevels) -> list[Health]:
    """How the hammer does and, where it has an instrument of its own, the microphone; each with its level."""
    force, sound = f"{levels.force_rms_n:.3f} N rms", f"{levels.sound_level_db:.0f} dB SPL"
    if microphone is None:
        return [_with_level(hammer.health(), f"{force}, {sound}")]
    return [_with_level(hammer.health(), force), _with_level(microphone.health(), sound)]


def _with_level(health: Health, level: str) -> Health:
    said = f"rest {level}"
    return replace(health, detail=f"{said}; {health.detail}" if health.detail else said)
