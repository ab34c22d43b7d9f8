"""The bench, opened: the station's instruments by their kind, all of them or none.

The table of kinds is literal and names its drivers by import strings, loaded on use: nothing
in the core imports what lies above it.
"""

import logging
import os
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import Protocol

from harness.basics.errors import BenchFault, CalibrationRefused, SafetyStop, TouchstoneError, WrongUse
from harness.basics.mesh import Mesh
from harness.bench.device import Arm, ImpactHammer, Microphone, TactileCamera
from harness.bench.experiments import loaded
from harness.bench.gap import gap_path
from harness.bench.mock_lab import LabAddresses, MockLab
from harness.bench.scene import SceneFile
from harness.bench.station_file import Station

INSTRUMENTS = {
    "ur": "drivers.ur.arm:UrArm",
    "gelsight-http": "drivers.camera.http_camera:gelsight",
    "camera-http": "drivers.camera.http_camera:scene_camera",
    "dataq": "drivers.dataq.hammer:DataqHammer",
    "portaudio": "drivers.microphone.microphone:PortAudioMicrophone",
}
"""Instrument kind to driver."""

LIMITS = {"ur": "drivers.ur.safety:SafetyLimits"}
"""Arm kind to the form in which its driver takes the station's limits."""

_LOG = logging.getLogger(__name__)

PRESS, STRIKE, LOOK, BARE = range(4)
"""The samples of a step: the gel pressed on the object, the hammer fired before it, the scene camera's
picture, the same without the object."""


class Mark(Protocol):
    """Says at which step and sample the run is; -1 before the first sample of a step."""

    def __call__(self, step: int, sample: int) -> None:
        """A mocked world draws its errors for that step and sample; a real bench ignores it."""


def _ignore_mark(step: int, sample: int) -> None:
    """What a real bench does with a mark."""


@dataclass(frozen=True)
class Bench:
    """Instruments, open, and what is known of how they are mounted."""

    arm: Arm  #: that moves.
    gel: TactileCamera  #: on its flange.
    camera: TactileCamera | None  #: that looks on; None without.
    station: Station  #: they belong to.
    hammer: ImpactHammer | None = None  #: that strikes; None where the scene asks for no sound.
    mark: Mark = _ignore_mark  #: see ``Mark``.
    pause: Callable[[float], None] = time.sleep  #: waits for so many seconds of the bench's own time.
    lab: MockLab | None = None  #: behind a mocked bench, for cueing faults; None at a real one.
    microphone: Microphone | None = None
    """that hears the strikes on a clock of its own; None where the hammer's box hears them."""
    simulated_clock: Callable[[], float] | None = None
    """returns s of simulated time, by which readings are stamped; None where the readings are stamped by the
    system's monotonic clock."""


@dataclass(frozen=True)
class RunContext:
    """What a mocked bench must know of the run it is opened for."""

    truth: Path  #: where the world writes what is true.
    mesh: Mesh  #: of the object, in metres, as the run is planned with.
    seed: int = 0  #: of the world.
    gap: str | None = None  #: reality gap by name or path; None for the station's own.
    run_id: str = ""  #: identity of the run, which the truth repeats; empty where no run is recorded.


@contextmanager
def open_station(station: Station, scene: SceneFile, run: RunContext) -> Iterator[Bench]:
    """Open every instrument; on exit stop the arm first, close the rest, end the mocked lab.

    Args:
        station: to open.
        scene: says whether the camera is needed, and what a mocked world shows.
        run: the run this is for.

    Raises:
        BenchFault: one or more instruments did not open: each is named, with the cable to check.
        SafetyStop: one of them refused for safety's sake.
    """
    with ExitStack() as stack:
        where, lab = wired(stack, station, scene, run)
        gel = make_gel(where)
        arm = make_arm(where, alarm=lambda: gel.health().failure)
        camera = make_camera(where) if scene.sensors.camera else None
        hammer = make_hammer(where) if scene.sensors.sound else None
        microphone = make_microphone(where) if scene.sensors.sound else None
        _open_all(
            stack, {"arm": arm, "gel": gel, "camera": camera, "hammer": hammer, "microphone": microphone}
        )
        stack.push(_Closing("arm, stopping", arm.stop))
        mark = _ignore_mark if lab is None else lab.mark
        yield Bench(arm, gel, camera, station, hammer, mark, lab=lab, microphone=microphone)


def wired(
    stack: ExitStack, station: Station, scene: SceneFile, run: RunContext
) -> tuple[Station, MockLab | None]:
    """The station with the addresses of its instruments, and the lab behind a mocked one.

    Args:
        stack: ends the lab.
        station: to open.
        scene: what a mocked world shows.
        run: what the lab is for.
    """
    if station.mock is None:
        return station, None
    gap = gap_path(run.gap or station.mock.gap)
    lab = MockLab(scene, station, run.mesh, run.seed, gap, run.truth, run_id=run.run_id)
    stack.callback(lab.close)
    started = lab.start()
    _surround(stack, started.environment)
    return addressed(station, started), lab


def addressed(station: Station, where: LabAddresses) -> Station:
    """A mocked station with the addresses that its lab took."""
    keys = {"arm": "address", "gel": "url", "camera": "url", "hammer": "port", "microphone": "device"}
    sections = {name: getattr(station, name) for name in keys}
    return station.model_copy(
        update={
            name: section.model_copy(update={keys[name]: getattr(where, name)})
            for name, section in sections.items()
            if section is not None
        }
    )


def _surround(stack: ExitStack, environment: Mapping[str, str]) -> None:
    """Have these in this process's environment until the bench is closed: sound libraries look there."""
    before = {name: os.environ[name] for name in environment if name in os.environ}
    os.environ.update(environment)

    def restore() -> None:
        for name in environment:
            os.environ.pop(name, None)
        os.environ.update(before)

    stack.callback(restore)


def make_arm(station: Station, alarm: Callable[[], str] = lambda: "") -> Arm:
    """The arm's driver, not yet open; its limits hold for the flange, the gel's housing and the hammer.

    ``alarm`` says why a motion must end, in words; it is empty while all is well.
    """
    section = station.arm
    made: Arm = loaded(INSTRUMENTS[section.kind])(
        address=section.address,
        model=section.model,
        limits=loaded(LIMITS[section.kind])(**section.safety.model_dump()),
        rate=section.rate,
        tool_points=station.tool_points.tolist(),
        alarm=alarm,
    )
    return made


def make_gel(station: Station) -> TactileCamera:
    """The gel's driver, not yet open."""
    section = station.gel
    made: TactileCamera = loaded(INSTRUMENTS[section.kind])(
        url=section.url, sensor=section.sensor, serial=section.serial, nominal_rate=section.rate
    )
    return made


def make_camera(station: Station) -> TactileCamera | None:
    """The scene camera's driver, not yet open; None for a bench without."""
    section = station.camera
    if section is None:
        return None
    made: TactileCamera = loaded(INSTRUMENTS[section.kind])(
        url=section.url, rows=section.rows, columns=section.columns, serial=section.serial
    )
    return made


def make_hammer(station: Station) -> ImpactHammer:
    """The hammer's driver, not yet open.

    Raises:
        WrongUse: the station has no hammer.
        CalibrationRefused: of the box.
    """
    section = station.hammer
    if section is None:
        raise WrongUse(
            f"the scene asks for sound, and the station {station.title!r} has no [hammer]; add one, or set "
            "sensors.sound = false in the scene"
        )
    calibration = section.acquisition
    made: ImpactHammer = loaded(INSTRUMENTS[section.kind])(
        calibration=calibration if station.own_microphone is None else calibration.without_microphone,
        port=section.port or "",
        serial=section.serial,
        model=section.model,
        rate=section.rate,
        threshold_counts=round(section.threshold / calibration.newtons_per_count),
    )
    return made


def make_microphone(station: Station) -> Microphone | None:
    """The driver of a microphone of its own, not yet open; None where the hammer's box hears the strikes.

    Raises:
        WrongUse: the station has no hammer.
        CalibrationRefused: of the hammer's box, or it is of a microphone on another converter.
    """
    section = station.own_microphone
    if section is None:
        return None
    if station.hammer is None:
        raise WrongUse(
            f"the station {station.title!r} has no [hammer], whose strikes would be heard; add one"
        )
    calibrated = station.hammer.acquisition.microphone_full_scale_counts
    if calibrated != section.full_scale:
        raise CalibrationRefused(
            f"the calibration {station.hammer.calibration!r} is of a microphone whose converter has full "
            f"scale {calibrated}, the station's [microphone] has {section.full_scale}: set its bits, or "
            "calibrate it"
        )
    made: Microphone = loaded(INSTRUMENTS[section.kind])(
        device=section.device,
        rate=round(section.rate or 0.0),
        channels=section.channels or 1,
        channel=section.channel or 0,
        bits=section.bits or 24,
        serial=section.serial,
        latency=section.latency or 0.0,
    )
    return made


def _open_all(stack: ExitStack, instruments: Mapping[str, "Instrument | None"]) -> None:
    failures: dict[str, TouchstoneError] = {}
    for name, instrument in instruments.items():
        if instrument is None:
            continue
        try:
            instrument.open()
        except TouchstoneError as error:
            failures[name] = error
        else:
            stack.push(_Closing(f"{name}, closing", instrument.close))
    if len(failures) == 1:
        raise next(iter(failures.values()))
    if failures:
        listed = "".join(f"\n  - {name}: {error}" for name, error in failures.items())
        unsafe = any(isinstance(error, SafetyStop) for error in failures.values())
        kind = SafetyStop if unsafe else BenchFault
        raise kind(f"{len(failures)} instruments did not open:{listed}")


class Instrument(Protocol):
    """What every instrument is."""

    def open(self) -> None:
        """Connect."""

    def close(self) -> None:
        """Release."""


@dataclass(frozen=True)
class _Closing:
    """One thing to do on the way out, which hides no earlier failure."""

    what: str
    action: Callable[[], None]

    def __call__(
        self, _kind: type[BaseException] | None, error: BaseException | None, _trace: TracebackType | None
    ) -> bool:
        try:
            self.action()
        except TouchstoneError as failure:
            if error is None:
                raise
            _LOG.warning("%s: %s", self.what, failure)
        return False
