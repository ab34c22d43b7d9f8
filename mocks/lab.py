"""The mocked bench: ``python -m mocks.lab``, one process for each instrument, on an address of its own.

It answers JSON lines on standard output with one for each on standard input:

``{"mark": {"step": 3, "sample": 0}}``
    The run is at this step and sample. From sample 0 on, the truth of the step is written: of the
    press at sample 0, of a strike from where the arm is at sample 1.
``{"fault": {"instrument": "gel", "kind": "stall", "seconds": 2}}``
    Something goes wrong (``mocks.faults``).

The first line out says where the instruments are: ``{"ready": true, "arm": ADDRESS, "gel": URL,
"camera": URL or null, "hammer": PATH of its box's port or null, "microphone": {"device": NAME, "environment":
what a program must have in its own to open it} or null}``, or ``{"ready": false, "error": ...}``.
End of file ends everything.
"""

import argparse
import json
import os
import select
import signal
import sys
import time
from collections.abc import Callable, Hashable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import cv2
import numpy as np

from harness.basics.arrays import ByteArray, FloatArray
from harness.basics.clock import now
from harness.basics.errors import TouchstoneError, WrongUse
from harness.basics.geometry import frame_facing, inverse, transform
from harness.bench.gap import load_gap
from harness.bench.kinematics import forward
from harness.bench.station import BARE, LOOK, PRESS, STRIKE
from harness.bench.station_sections import ArmSection
from mocks.camera.gelsight_stream import MjpegServer
from mocks.faults import parse
from mocks.lab_processes import CAMERA_PORT, GEL_PORT, ChildPipe, LabChild, free_address, keep_time
from mocks.lab_scene import read_lab_scene, strikes_of
from mocks.shared_pose import SharedPose, StepMark
from mocks.ur.hooks import LEFT_ABOVE, ControllerConfig
from mocks.ur.serve import serve
from mocks.world.gap_draw import GapDraw
from mocks.world.truth import TruthFile
from mocks.world.world import NominalBench, World


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


def stream(address: str, port: int, view: CameraView, rate: float, line: ChildPipe) -> None:
    """Serve a view as MJPEG until the lab is gone.

    Args:
        address: loopback.
        port: of the stream.
        view: what is to be seen.
        rate: frames a second.
        line: to the lab.
    """
    server = MjpegServer(address, port, view, rate)
    line.ready()

    def should_stop() -> bool:
        fault = line.fault()
        if fault is not None:
            server.fault.set(fault)
        return line.should_stop()

    server.serve(should_stop)


if TYPE_CHECKING:
    from mocks.daq.strike_counts import StrikeCounts
    from mocks.sound_card.card import SoundCard
    from mocks.sound_card.strike_on_card import Wire

READY_TIMEOUT = 30.0
DRIFT_PPM = 40.0
"""Parts in a million by which the hammer's box samples faster than nominal: a common crystal."""
GEL_RATE = 25.0
CAMERA_RATE = 10.0
SHOWN_TIMEOUT = 0.5
TOOL_OUTPUTS = 16
"""The first of the tool's digital outputs among all of them."""

_GEL, _CAMERA = 0, 1
_ORPHAN_CHECK = 0.5


class Lab:
    """The instruments' processes and what is said to them.

    Args:
        world: behind all of them.
        controller: runs the arm's controller at an address until its line says stop.
        shared: what the processes share.
        truth: where the truth is written.
        address: loopback, of all the instruments.
        camera: whether there is a scene camera.
        strikes: of the hammer; None where the scene asks for no sound.
        card: of a microphone that the hammer's box does not read, and how it is wired; None without.
    """

    def __init__(
        self,
        world: World,
        controller: Callable[[str, ChildPipe], None],
        shared: SharedPose,
        truth: TruthFile,
        address: str,
        camera: bool,
        strikes: "StrikeCounts | None",
        card: "tuple[SoundCard, Wire] | None" = None,
    ) -> None:
        self._shared = shared
        self._truth = truth
        self._address = address
        self._has_camera = camera
        self._children = {"arm": LabChild("arm", lambda line: controller(address, line))}
        gel = CameraView(shared, _GEL, world.tactile_image)
        self._children["gel"] = LabChild("gel", lambda line: stream(address, GEL_PORT, gel, GEL_RATE, line))
        if camera:
            seen = CameraView(shared, _CAMERA, world.scene_image)
            self._children["camera"] = LabChild(
                "camera", lambda line: stream(address, CAMERA_PORT, seen, CAMERA_RATE, line)
            )
        self._hammer_port: str | None = None
        self._card = None if card is None else card[0]
        if strikes is not None:
            self._plug_in(strikes, card)

    def wait_ready(self) -> Mapping[str, Any]:
        """Where the instruments are, once all of them answer; ``BenchFault`` where one does not."""
        for child in self._children.values():
            child.wait_ready(READY_TIMEOUT)
        camera = f"http://{self._address}:{CAMERA_PORT}/?action=stream" if self._has_camera else None
        gel = f"http://{self._address}:{GEL_PORT}/?action=stream"
        where = {"arm": self._address, "gel": gel, "camera": camera, "hammer": self._hammer_port}
        card = self._card
        heard = None if card is None else {"device": card.microphone, "environment": card.environment}
        return {"ready": True, **where, "microphone": heard}

    def answer(self, line: str) -> Mapping[str, Any]:
        """Do what one line of JSON asks; an answer with the key ``error`` where it cannot be done."""
        try:
            request = json.loads(line)
            match request:
                case {"mark": {"step": int(step), "sample": int(sample)}} if len(request) == 1:
                    return {"marked": self._mark(step, sample)}
                case {"fault": dict(cue)} if len(request) == 1:
                    return {"begun": self._cue(cue)}
        except json.JSONDecodeError as error:
            return {"error": f"not a line of JSON: {error}"}
        except TouchstoneError as error:
            return {"error": str(error)}
        return {"error": f"the lab knows mark (step, sample) and fault, not {line.strip()!r}"}

    def close(self) -> None:
        """End every process."""
        for child in self._children.values():
            child.kill()
        if self._card is not None:
            self._card.stop()

    def _plug_in(self, strikes: "StrikeCounts", card: "tuple[SoundCard, Wire] | None") -> None:
        """Begin the hammer's box: the last child, so that nobody else holds its end of the cable."""
        from mocks.daq.box import DaqBox, Source  # by runs that are to be heard, and by no others
        from mocks.daq.strike_counts import StrikesOnBox

        source: Source
        if card is None:
            source = StrikesOnBox(strikes, lambda: self._shared.firing)
        else:
            from mocks.sound_card.strike_on_card import StrikesOnCard

            source = StrikesOnCard(strikes, lambda: self._shared.firing, *card, lambda: box.scan())
            source.begin()
        box = DaqBox(source, drift_ppm=DRIFT_PPM)
        self._hammer_port = box.port
        self._children["hammer"] = LabChild("hammer", box.serve)
        box.leave()

    def _mark(self, step: int, sample: int) -> Mapping[str, int]:
        """Set the step and sample, and wait until the gel has shown them."""
        mark = StepMark(self._shared.mark.number + 1, step, sample)
        self._shared.set_mark(mark)
        if sample in (PRESS, STRIKE):
            self._truth.append(self._shared.base_from_flange, step, sample)
        elif sample == LOOK:
            self._truth.looked()
        end = now() + SHOWN_TIMEOUT
        viewer = _CAMERA if sample in (LOOK, BARE) and self._has_camera else _GEL
        while self._shared.shown(viewer) < mark.number and now() < end:
            time.sleep(2e-3)
        return {"step": step, "sample": sample}

    def _cue(self, cue: Mapping[str, object]) -> Mapping[str, object]:
        fault = parse(cue)
        if fault.instrument == "microphone" and self._card is not None:
            self._card.unplug()
            return dict(cue)
        if fault.instrument not in self._children:
            raise WrongUse(f"this bench has no {fault.instrument}")
        self._children[fault.instrument].cue(fault)
        return dict(cue)


def _lines(descriptor: int, orphaned: Callable[[], bool]) -> Iterator[str]:
    """Lines from a pipe, until it ends or whoever started the lab is gone."""
    waiting = b""
    while not orphaned():
        if not select.select([descriptor], [], [], _ORPHAN_CHECK)[0]:
            continue
        arrived = os.read(descriptor, 1 << 16)
        if not arrived:
            return
        *lines, waiting = (waiting + arrived).split(b"\n")
        yield from (line.decode() for line in lines if line.strip())


def _say(answer: Mapping[str, Any]) -> None:
    sys.stdout.write(json.dumps(answer, allow_nan=False) + "\n")
    sys.stdout.flush()


def _compile(world: World, bench: NominalBench, away: FloatArray) -> None:
    """Run every kernel once, before the fork: compiled in an instrument's process it would hold that up."""
    normal = bench.mesh.face_normals[0]
    gel = transform(frame_facing(-normal, 0.0), bench.mesh.corners[0].mean(axis=0) - 1e-3 * normal)
    pressed = bench.base_from_object @ gel @ inverse(bench.flange_from_gel)
    for pose in (away, pressed):
        world.contact_wrench(pose, 0)
        world.tactile_image(pose, 0, 0)
        world.penetration(pose, 0)
        world.true_contact(pose, 0)


def _controller(
    world: World, arm: ArmSection, shared: SharedPose, seed: int
) -> Callable[[str, ChildPipe], None]:
    """What the arm's process does."""
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

    def run(address: str, line: ChildPipe) -> None:
        keep_time()
        serve(
            ControllerConfig(host=address, model=arm.model, seed=seed, joints=LEFT_ABOVE),
            Push(),
            publish,
            line.should_stop,
            step=lambda: shared.mark.step,
            cues=line.fault,
            on_ready=line.ready,
            on_outputs=outputs,
        )

    return run


def _begin(arguments: argparse.Namespace) -> Lab:
    """Build the world, and begin a process for each instrument."""
    cv2.setNumThreads(0)  # threads of the parent are lost in a fork
    gap = load_gap(arguments.gap)
    told = read_lab_scene(arguments.scene, GapDraw(gap, arguments.seed))
    world = World(told.bench, gap, arguments.seed)
    strikes = strikes_of(world, told.scene, told.station, gap, arguments.seed)
    card = None
    if strikes is not None and told.station.own_microphone is not None:
        from mocks.sound_card.strike_on_card import (
            plug_in_card,  # by runs that are heard by one, and by no others
        )

        card = plug_in_card(told.station, arguments.scene.parent)
    start = forward(told.station.arm.model, np.array(LEFT_ABOVE))
    _compile(world, told.bench, start)
    shared, sound = SharedPose(start), None if strikes is None else strikes.sound
    return Lab(
        world,
        _controller(world, told.station.arm, shared, arguments.seed),
        shared,
        TruthFile(arguments.truth, world, arguments.seed, arguments.run, sound),
        free_address(),
        told.bench.camera is not None,
        strikes,
        card,
    )


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="python -m mocks.lab", description="The mocked bench.")
    parser.add_argument("--scene", type=Path, required=True, help="the bench, as JSON")
    parser.add_argument("--seed", type=int, required=True, help="of the run, zero or more")
    parser.add_argument(
        "--gap", required=True, help="a gap file, or the name of a shipped one: default, none"
    )
    parser.add_argument("--run", default="", help="identity of the run, which the truth repeats")
    parser.add_argument("--truth", type=Path, required=True, help="where to write what really happened")
    return parser


def main() -> int:
    """Run the lab until standard input ends; the exit status."""
    arguments = _parser().parse_args()
    parent = os.getppid()
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is the run's to answer; it closes our input
    try:
        lab = _begin(arguments)
    except TouchstoneError as error:
        _say({"ready": False, "error": str(error)})
        return error.exit_code
    try:
        _say(lab.wait_ready())
        for line in _lines(sys.stdin.fileno(), lambda: os.getppid() != parent):
            _say(lab.answer(line))
    except TouchstoneError as error:
        _say({"ready": False, "error": str(error)})
        return error.exit_code
    except BrokenPipeError:
        return 0
    finally:
        lab.close()
    return 0


if __name__ == "__main__":
    sys.exit(main())
