"""The mocked bench without sockets, in simulated time: for tables of many runs.

The same world, the same pictures and the same JPEG bytes as on the wires. Time is the
simulated bench clock, from zero.
"""

from typing import TYPE_CHECKING

import cv2
import numpy as np

from harness.basics.errors import BenchFault, WrongUse
from harness.bench.device import Health, Microphone
from harness.bench.gap import load_gap
from harness.bench.reading import Channel, Reading
from harness.bench.scene import SceneFile
from harness.bench.station import Bench, RunContext
from harness.bench.station_file import Station
from mocks.camera.gelsight_stream import encode
from mocks.in_process.arm import InProcessArm
from mocks.in_process.simulated_motion import Stage
from mocks.lab_scene import nominal_bench
from mocks.ur.hooks import LEFT_ABOVE
from mocks.world.sound_of_run import strikes_of
from mocks.world.truth import TruthFile
from mocks.world.world import World

if TYPE_CHECKING:
    from mocks.daq.strike_counts import StrikeCounts
    from mocks.in_process.hammer import InProcessHammer

PACKET_RATE = 25.0
"""Hz of the arm's history: one packet for each frame of the gel is all that an estimate reads."""


class InProcessGel:
    """A ``TactileCamera`` that sees the world where the arm is.

    Args:
        world: makes the pictures.
        arm: says where the flange is.
        stage: simulated time, step and sample.
        rate: frames a second.
    """

    def __init__(self, world: World, arm: InProcessArm, stage: Stage, rate: float = 25.0) -> None:
        self._world = world
        self._arm = arm
        self._stage = stage
        self._rate = rate
        sensor = world.sensor
        self._channel = Channel("gel.image", "count", (sensor.rows, sensor.columns, 3), "uint8", "gel", rate)

    def open(self) -> None:
        """Nothing to connect."""

    def close(self) -> None:
        """Nothing to release."""

    def read(self, count: int, timeout: float) -> Reading:
        """The next ``count`` frames of simulated time."""
        if count / self._rate > timeout:
            raise BenchFault(f"gel: {count} frames take {count / self._rate:g} s, more than {timeout:g} s")
        first = int(np.floor(self._stage.time * self._rate + 1e-9)) + 1
        times = np.arange(first, first + count) / self._rate
        pose = self._arm.state().base_from_flange
        jpeg = encode(self._world.tactile_image(pose, self._stage.step, self._stage.sample))
        image = cv2.imdecode(np.frombuffer(jpeg, np.uint8), cv2.IMREAD_COLOR)
        values = np.repeat(np.asarray(image)[None, ..., ::-1], count, axis=0)
        self._stage.time = float(times[-1])
        return Reading(self._channel, times, values, (jpeg,) * count)

    def health(self) -> Health:
        """Every frame, on time."""
        return Health("gel", f"{self._world.sensor.name} in process", self._rate, 0, 0.0, "simulated time")


def in_process_bench(scene: SceneFile, station: Station, run: RunContext) -> Bench:
    """The bench that ``open_station`` opens over every wire, without one; there is nothing to close.

    Args:
        scene: what the world shows.
        station: a mocked one.
        run: the run this is for; the truth is written where it says.

    Raises:
        WrongUse: a station that is not mocked, or a scene that asks for the camera.
    """
    if station.mock is None:
        raise WrongUse("only a station with [mock] can be simulated in process; open this one over its wires")
    if scene.sensors.camera:
        raise WrongUse(
            "the bench in process has no scene camera; run over the wires, or leave the camera out"
        )
    mesh = None if scene.object.builtin is not None else run.mesh
    nominal = nominal_bench(scene, station, mesh, scene.base_from_object(run.mesh))
    gap = load_gap(run.gap or station.mock.gap)
    world = World(nominal, gap, run.seed)
    strikes = strikes_of(world, scene, station, gap, run.seed)
    truth = TruthFile(run.truth, world, run.seed, None if strikes is None else strikes.sound)
    stage = Stage()
    arm = InProcessArm(station.arm.model, np.array(LEFT_ABOVE), world, stage, PACKET_RATE)

    def mark(step: int, sample: int) -> None:
        stage.step, stage.sample = step, sample
        if sample >= 0:
            truth.append(arm.state().base_from_flange, step, sample)

    hammer = None if strikes is None else _hammer(strikes, arm, station, stage)
    microphone = None
    if strikes is not None and hammer is not None and station.own_microphone is not None:
        microphone = _microphone(strikes, hammer, station, stage)
    gel = InProcessGel(world, arm, stage)
    return Bench(arm, gel, None, station, hammer, mark, stage.pause, microphone=microphone)


def _hammer(strikes: "StrikeCounts", arm: InProcessArm, station: Station, stage: Stage) -> "InProcessHammer":
    from mocks.in_process.hammer import InProcessHammer  # by runs that are to be heard, and by no others

    assert station.hammer is not None
    assert station.arm.striker_output is not None  # nobody strikes by hand at a mocked bench
    return InProcessHammer(strikes, arm, station.arm.striker_output, stage, station.hammer)


def _microphone(
    strikes: "StrikeCounts", hammer: "InProcessHammer", station: Station, stage: Stage
) -> Microphone:
    from mocks.in_process.microphone import InProcessMicrophone
    from mocks.sound_card.counts import CardConverter

    section, box = station.own_microphone, station.hammer
    assert section is not None
    assert box is not None
    converter = CardConverter.of(box.acquisition)
    made = InProcessMicrophone(strikes.sound, hammer, box.rate, stage, section, converter)
    made.open()
    return made
