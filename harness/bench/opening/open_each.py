"""Instruments of a bench opened each by itself: what opens can be looked at, what does not is named."""

from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from typing import Protocol, TypeVar

from harness.basics.errors import TouchstoneError, WrongUse
from harness.basics.files.named_file import nearest
from harness.bench.device import Arm, ImpactHammer, Microphone, TactileCamera
from harness.bench.scene import SceneFile, scene_from_options
from harness.bench.station import (
    RunContext,
    make_arm,
    make_camera,
    make_gel,
    make_hammer,
    make_microphone,
    wired,
)
from harness.bench.station_file import Station


class _Instrument(Protocol):
    def open(self) -> None: ...

    def close(self) -> None: ...


_Made = TypeVar("_Made", bound=_Instrument)


@dataclass(frozen=True)
class Instruments:
    """Those that opened; None where the station has none, the scene needs none, or it did not open.

    Attributes:
        arm: which nothing moves.
        gel: on its flange.
        camera: that looks on.
        hammer: that strikes.
        microphone: with a clock of its own.
        failures: by name, why one did not open.
    """

    arm: Arm | None
    gel: TactileCamera | None
    camera: TactileCamera | None
    hammer: ImpactHammer | None
    microphone: Microphone | None
    failures: Mapping[str, TouchstoneError]


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
