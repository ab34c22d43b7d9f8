"""The mocked bench without sockets, in simulated time: for tables of many runs.

The same world, the same pictures and the same JPEG bytes as on the wires. Time is the
simulated bench clock, from zero.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from harness.basics.arrays import ByteArray, FloatArray
from harness.basics.errors import BenchFault, WrongUse
from harness.bench.device import Channel, Health, Instrument, Reading
from harness.bench.experiments import loaded
from harness.bench.gap import load_gap
from harness.bench.instruments.section import KINDS
from harness.bench.scene import SceneFile
from harness.bench.station import LOOK, PRESS, STRIKE, Bench, RunContext
from harness.bench.station_file import Station
from harness.picture.image_file import decode_jpeg
from mocks.camera.gelsight_stream import encode
from mocks.in_process.arm import InProcessArm, Stage
from mocks.lab import TruthFile
from mocks.lab_scene import nominal_bench, strikes_of
from mocks.ur.hooks import LEFT_ABOVE
from mocks.world.gap_draw import GapDraw
from mocks.world.world import World

if TYPE_CHECKING:
    from mocks.daq.strike_counts import StrikeCounts
    from mocks.in_process.hammer import InProcessHammer

PACKET_RATE = 25.0
"""Hz of the arm's history: one packet for each frame of the gel is all that an estimate reads."""


class InProcessCamera:
    """A camera, the gel's or the scene's, that sees the world where the arm is.

    Args:
        name: of the instrument; its channel is ``NAME.image``.
        identity: its make.
        shape: ``(rows, columns)`` of its pictures.
        look: makes one, of the flange's pose, the step and the sample.
        arm: says where the flange is.
        stage: simulated time, step and sample.
        rate: frames a second.
    """

    def __init__(
        self,
        name: str,
        identity: str,
        shape: tuple[int, int],
        look: Callable[[FloatArray, int, int], ByteArray],
        arm: InProcessArm,
        stage: Stage,
        rate: float = 25.0,
    ) -> None:
        self._name, self._identity = name, identity
        self._look = look
        self._arm = arm
        self._stage = stage
        self._rate = rate
        self._channel = Channel(f"{name}.image", "count", (*shape, 3), "uint8", name, rate)

    def open(self) -> None:
        """Nothing to connect."""

    def close(self) -> None:
        """Nothing to release."""

    def read(self, count: int, timeout: float) -> Reading:
        """The next ``count`` frames of simulated time."""
        if count / self._rate > timeout:
            raise BenchFault(
                f"{self._name}: {count} frames take {count / self._rate:g} s, more than {timeout:g} s"
            )
        first = int(np.floor(self._stage.time * self._rate + 1e-9)) + 1
        times = np.arange(first, first + count) / self._rate
        pose = self._arm.state().base_from_flange
        jpeg = encode(self._look(pose, self._stage.step, self._stage.sample))
        values = np.repeat(decode_jpeg(jpeg)[None], count, axis=0)
        self._stage.time = float(times[-1])
        return Reading(self._channel, times, values, (jpeg,) * count)

    def health(self) -> Health:
        """Every frame, on time."""
        return Health(self._name, f"{self._identity} in process", self._rate, 0, 0.0, "simulated time")


@dataclass(frozen=True, eq=False)
class SimulatedLab:
    """Resources that the instruments of a bench in process share; ``BuildInstrument`` is called with it."""

    world: World  #: behind all of them.
    stage: Stage  #: simulated time, step and sample.
    station: Station  #: whose instruments are simulated.
    arm: InProcessArm  #: carries the gel.
    strikes: "StrikeCounts | None"  #: of the hammer; None where the scene asks for no sound.

    @cached_property
    def hammer(self) -> "InProcessHammer":
        """The hammer; ``WrongUse`` where the station has none that the arm fires."""
        from mocks.in_process.hammer import InProcessHammer  # by runs that are to be heard, and by no others

        section, output = self.station.require_hammer()[0], self.station.arm.striker_output
        if self.strikes is None or output is None:
            raise WrongUse("a hammer in process needs a scene with sound and the arm's striker_output")
        return InProcessHammer(self.strikes, self.arm, output, self.stage, section)


BuildInstrument = Callable[[str, SimulatedLab], Instrument]
"""Builds the instrument of this name; ``InstrumentKind.in_process`` names one."""


def build_arm(_name: str, lab: SimulatedLab) -> Instrument:
    """Return the arm."""
    return lab.arm


def build_gel(name: str, lab: SimulatedLab) -> Instrument:
    """Build the tactile camera."""
    sensor = lab.world.sensor
    shape = sensor.rows, sensor.columns
    return InProcessCamera(name, sensor.name, shape, lab.world.tactile_image, lab.arm, lab.stage)


def build_camera(name: str, lab: SimulatedLab) -> Instrument:
    """Build the scene camera; ``WrongUse`` where the station has none."""
    section = lab.station.camera
    if section is None:
        raise WrongUse(f"the station {lab.station.title!r} has no [camera]; add one to its file")
    shape = section.rows, section.columns
    return InProcessCamera(name, "scene camera", shape, lab.world.scene_image, lab.arm, lab.stage)


def build_hammer(_name: str, lab: SimulatedLab) -> Instrument:
    """Return the hammer."""
    return lab.hammer


def build_microphone(_name: str, lab: SimulatedLab) -> Instrument:
    """Build a microphone on a sound card, which hears the hammer; ``WrongUse`` where the station has none."""
    from mocks.in_process.microphone import InProcessMicrophone
    from mocks.sound_card.card import CardConverter

    section, box = lab.station.own_microphone, lab.station.require_hammer()[0]
    if section is None or lab.strikes is None:
        raise WrongUse(f"the station {lab.station.title!r} has no microphone on a sound card")
    converter = CardConverter.of(box.acquisition)
    return InProcessMicrophone(lab.strikes.sound, lab.hammer, box.rate, lab.stage, section, converter)


def in_process_bench(scene: SceneFile, station: Station, run: RunContext) -> Bench:
    """Build the bench that ``open_station`` opens over every wire, without one; there is nothing to close.

    Args:
        scene: what the world shows.
        station: a mocked one.
        run: the run this is for; the truth is written where it says.

    Raises:
        WrongUse: a station that is not mocked, or an instrument that only the mocked lab has.
    """
    if station.mock is None:
        raise WrongUse("only a station with [mock] can be simulated in process; open this one over its wires")
    mesh = None if scene.object.builtin is not None else run.mesh
    gap = load_gap(run.gap or station.mock.gap)
    draw = GapDraw(gap, run.seed)
    nominal = nominal_bench(scene, station, mesh, scene.base_from_object(run.mesh), draw)
    world = World(nominal, gap, run.seed)
    strikes = strikes_of(world, scene, station, gap, run.seed)
    truth = TruthFile(run.truth, world, run.seed, run.run_id, None if strikes is None else strikes.sound)
    stage = Stage()
    arm = InProcessArm(station.arm.model, np.array(LEFT_ABOVE), world, stage, PACKET_RATE)

    def mark(step: int, sample: int) -> None:
        stage.step, stage.sample = step, sample
        if sample in (PRESS, STRIKE):
            truth.append(arm.state().base_from_flange, step, sample)
        elif sample == LOOK:
            truth.looked()

    lab = SimulatedLab(world, stage, station, arm, strikes)
    instruments: dict[str, Instrument] = {}
    for name, section in station.sections_for(scene.sensors).items():
        build = KINDS[section.kind].in_process
        if build is None:
            raise WrongUse(
                f"the {name} ({section.kind}) is not simulated in process; run with --bench wires, or leave "
                "it out of the station"
            )
        instruments[name] = loaded(build)(name, lab)
        instruments[name].open()
    return Bench(station, instruments, mark, stage.pause, simulated_clock=lambda: stage.time)
