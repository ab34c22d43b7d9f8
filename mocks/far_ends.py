"""The far ends of arm, cameras and hammer in the mocked lab, and what they share."""

from collections.abc import Callable, Hashable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from harness.basics.arrays import ByteArray, FloatArray
from harness.basics.errors import WrongUse
from harness.bench.device import MICROPHONE
from harness.bench.experiments import loaded
from harness.bench.instruments.section import KINDS
from harness.bench.scene import SceneFile
from harness.bench.station_file import Station
from mocks.camera.gelsight_stream import MjpegServer
from mocks.faults import CAMERA_FAULTS, HAMMER_FAULTS
from mocks.lab_processes import CAMERA_PORT, GEL_PORT, ChildPipe, FarEnd, LabChild, keep_time
from mocks.shared_pose import SharedPose
from mocks.ur.hooks import LEFT_ABOVE, ControllerConfig
from mocks.ur.serve import KINDS as ARM_FAULTS
from mocks.ur.serve import serve
from mocks.world.world import World

if TYPE_CHECKING:
    from mocks.daq.strike_counts import StrikeCounts

DRIFT_PPM = 40.0
"""Parts in a million by which the hammer's box samples faster than nominal: a common crystal."""
GEL_RATE = 25.0
CAMERA_RATE = 10.0
TOOL_OUTPUTS = 16
"""The first of the tool's digital outputs among all of them."""

GEL_VIEWER, CAMERA_VIEWER = 0, 1
"""Cameras that acknowledge marks, by their cell of ``SharedPose``."""


@dataclass(frozen=True, eq=False)
class LabBench:
    """Resources that the far ends of a mocked lab share; ``StartFarEnd`` is called with it."""

    world: World  #: behind all of them.
    shared: SharedPose  #: memory of all processes.
    scene: SceneFile  #: what is on the table.
    station: Station  #: whose instruments are mocked.
    address: str  #: loopback, of all the instruments.
    seed: int  #: of the run.
    folder: Path  #: of the lab, removed at its end.
    strikes: "StrikeCounts | None"  #: of the hammer; None where the scene asks for no sound.
    ends: dict[str, FarEnd] = field(default_factory=dict)  #: that were started, by instrument.

    def end(self, name: str) -> FarEnd:
        """Return the far end of an instrument, started on the first call; one may need another."""
        if name not in self.ends:
            start: StartFarEnd = loaded(KINDS[self.station.require_section(name).kind].mock)
            self.ends[name] = start(name, self)
        return self.ends[name]


StartFarEnd = Callable[[str, LabBench], FarEnd]
"""Starts the far end of the instrument of this name; ``InstrumentKind.mock`` names one."""


class CameraView:
    """A camera's view of the world at the arm's present pose, step and sample."""

    def __init__(
        self, shared: SharedPose, viewer: int, look: Callable[[FloatArray, int, int], ByteArray]
    ) -> None:
        self._shared = shared
        self._viewer = viewer
        self._look = look
        self._pose = shared.base_from_flange
        self._mark = shared.mark

    def state(self) -> Hashable:
        """Pose, step and sample."""
        self._mark = self._shared.mark
        self._pose = self._shared.base_from_flange
        return self._pose.tobytes(), self._mark.step, self._mark.sample

    def picture(self) -> ByteArray:
        """What the world shows there."""
        return self._look(self._pose, self._mark.step, self._mark.sample)

    def sent(self) -> None:
        """Tell the lab which mark has been shown."""
        self._shared.set_shown(self._viewer, self._mark.number)


def _stream(address: str, port: int, view: CameraView, rate: float, line: ChildPipe) -> None:
    """Serve a view as MJPEG until the lab is gone."""
    server = MjpegServer(address, port, view, rate)
    line.ready()

    def should_stop() -> bool:
        fault = line.fault()
        if fault is not None:
            server.fault.set(fault)
        return line.should_stop()

    server.serve(should_stop)


def start_arm(name: str, lab: LabBench) -> FarEnd:
    """Start the arm's controller."""
    arm, shared, world = lab.station.arm, lab.shared, lab.world
    striker = 0 if arm.striker_output is None else 1 << (TOOL_OUTPUTS + arm.striker_output)
    switched = 0

    class Push:
        def wrench(self, base_from_flange: Sequence[Sequence[float]], _time: float) -> Sequence[float]:
            wrench = world.contact_wrench(np.array(base_from_flange), shared.mark.step)
            return [float(component) for component in wrench]

    def publish(_time: float, _joints: Sequence[float], base_from_flange: Sequence[Sequence[float]]) -> None:
        shared.set_pose(np.array(base_from_flange))

    def outputs(bits: int) -> None:
        nonlocal switched
        if bits & ~switched & striker:
            shared.fire()
        switched = bits

    def run(line: ChildPipe) -> None:
        keep_time()
        serve(
            ControllerConfig(host=lab.address, model=arm.model, seed=lab.seed, joints=LEFT_ABOVE),
            Push(),
            publish,
            line.should_stop,
            step=lambda: shared.mark.step,
            cues=line.fault,
            on_ready=line.ready,
            on_outputs=outputs,
        )

    return LabChild(name, run, lab.address, ARM_FAULTS)


def start_gel(name: str, lab: LabBench) -> FarEnd:
    """Start the stream of the tactile camera."""
    view = CameraView(lab.shared, GEL_VIEWER, lab.world.tactile_image)
    return _start_stream(name, lab.address, GEL_PORT, view, GEL_RATE)


def start_camera(name: str, lab: LabBench) -> FarEnd:
    """Start the stream of the scene camera."""
    view = CameraView(lab.shared, CAMERA_VIEWER, lab.world.scene_image)
    return _start_stream(name, lab.address, CAMERA_PORT, view, CAMERA_RATE)


def _start_stream(name: str, address: str, port: int, view: CameraView, rate: float) -> FarEnd:
    url = f"http://{address}:{port}/?action=stream"
    return LabChild(name, lambda line: _stream(address, port, view, rate, line), url, CAMERA_FAULTS)


def start_hammer(name: str, lab: LabBench) -> FarEnd:
    """Start the hammer's box; a microphone on a sound card is started first."""
    from mocks.daq.box import DaqBox, Source  # by runs that are to be heard, and by no others
    from mocks.daq.strike_counts import StrikesOnBox

    if lab.strikes is None:
        raise WrongUse(
            "the scene asks for no sound, and the hammer of a mocked bench strikes for nothing else"
        )
    source: Source
    if lab.station.own_microphone is None:
        source = StrikesOnBox(lab.strikes, lambda: lab.shared.firing)
    else:
        from mocks.sound_card.card import PluggedCard, StrikesOnCard

        card = lab.end(MICROPHONE)
        if not isinstance(card, PluggedCard):
            raise WrongUse("the mocked hammer plays its sound on a mocked sound card alone")
        source = StrikesOnCard(
            lab.strikes, lambda: lab.shared.firing, card.card, card.wire, lambda: box.scan()
        )
        source.begin()
    box = DaqBox(source, drift_ppm=DRIFT_PPM)
    child = LabChild(name, box.serve, box.port, HAMMER_FAULTS)
    box.leave()
    return child
