"""The mocked bench: ``python -m mocks.lab``, one process for each instrument, on an address of its own.

It answers JSON lines on standard output with one for each on standard input:

``{"mark": {"step": 3, "sample": 0}}``
    The run is at this step and sample. From sample 0 on, the truth of the step is written: of the
    press at sample 0, of a strike from where the arm is at sample 1.
``{"fault": {"instrument": "gel", "kind": "stall", "seconds": 2}}``
    Something goes wrong (``mocks.faults``).

The first line out states where the instruments are: ``{"ready": true, "addresses": {NAME: ADDRESS, ...},
"environment": what a program must have in its own to open them}``, or ``{"ready": false, "error": ...}``.
End of file ends everything.
"""

import argparse
import json
import os
import select
import signal
import sys
import time
from collections.abc import Callable, Iterator, Mapping
from hashlib import sha256
from pathlib import Path
from typing import TYPE_CHECKING, Any

import cv2
import numpy as np

from harness.basics.arrays import FloatArray
from harness.basics.clock import now
from harness.basics.errors import TouchstoneError
from harness.basics.geometry import apply, frame_facing, inverse, transform
from harness.basics.npz_file import write_arrays
from harness.bench.device import CAMERA
from harness.bench.gap import load_gap
from harness.bench.kinematics import forward
from harness.bench.station import BARE, LOOK, PRESS, STRIKE
from harness.recording.truth_file import SCHEMA, read_truth_file, surface_path, write_truth_file
from mocks.far_ends import CAMERA_VIEWER, GEL_VIEWER, LabBench
from mocks.faults import parse
from mocks.lab_processes import free_address
from mocks.lab_scene import read_lab_scene, strikes_of
from mocks.shared_pose import SharedPose, StepMark
from mocks.ur.hooks import LEFT_ABOVE
from mocks.world.gap_draw import GapDraw
from mocks.world.world import NominalBench, World

if TYPE_CHECKING:
    from mocks.world.sound import WorldSound


class TruthFile:
    """``truth.json``: what the world knows, and where each contact really was.

    A step that is performed again, after a resume, replaces what was written of it. Beside it ``truth.npz``
    has the true surface in its true pose: ``vertices``, m in base, and ``faces``.

    Args:
        path: of the file; contacts already in it are kept if it is undamaged and of the same run and world.
        world: whose truth it is.
        seed: of the run.
        run_id: identity of the run; empty where no run is recorded.
        sound: of the run; None where the scene asks for none.
    """

    def __init__(
        self, path: Path, world: World, seed: int, run_id: str = "", sound: "WorldSound | None" = None
    ) -> None:
        self._path = path
        self._world = world
        self._sound = sound
        self._head = {
            "schema": SCHEMA,
            "run_id": run_id,
            "seed": seed,
            "base_from_object": world.base_from_object.tolist(),
            "differences": {
                **world.differences(),
                **({} if sound is None else {"sound": sound.differences()}),
            },
        }
        self._contacts: dict[int, dict[str, Any]] = self._resumed()
        self._surface_sum: str | None = None

    def append(self, base_from_flange: FloatArray, step: int, sample: int) -> None:
        """Write where the press or the strike of ``step`` is, with the flange reported at this pose."""
        if sample == STRIKE and self._sound is not None:
            aim = self._sound.aim(base_from_flange, step, STRIKE)
            self._contacts.setdefault(step, {"step": step})["strike"] = {
                "point_in_object_m": None if aim.met is None else aim.met.nominal.tolist(),
                "direction_in_object": aim.direction_in_object.tolist(),
                "pulse_s": aim.blow.pulse,
                "impulse_n_s": aim.blow.impulse,
                "base_from_flange": base_from_flange.tolist(),
            }
        else:
            self._contacts[step] = {
                "step": step,
                "sample": sample,
                "point_in_object_m": self._world.true_contact(base_from_flange, step).tolist(),
                "penetration_m": self._world.penetration(base_from_flange, step),
                "base_from_flange": base_from_flange.tolist(),
            }
        self._write()

    def looked(self) -> None:
        """Write what is true of the whole run: the scene camera has looked, and nothing was touched."""
        self._write()

    def _write(self) -> None:
        if self._surface_sum is None:
            world, path = self._world, surface_path(self._path)
            vertices = apply(world.base_from_object, world.mesh.vertices)
            write_arrays(path, {"vertices": vertices, "faces": world.mesh.faces})
            self._surface_sum = sha256(path.read_bytes()).hexdigest()
        contacts = [self._contacts[index] for index in sorted(self._contacts)]
        fields = {**self._head, "surface_sha256": self._surface_sum, "contacts": contacts}
        write_truth_file(self._path, fields)

    def _resumed(self) -> dict[int, dict[str, Any]]:
        """The contacts of the same run; none where the file is damaged or of another run."""
        if not self._path.exists():
            return {}
        try:
            written = read_truth_file(self._path)
        except TouchstoneError:
            return {}
        if any(written.get(key) != self._head[key] for key in ("run_id", "seed", "base_from_object")):
            return {}
        return {contact["step"]: contact for contact in written["contacts"]}


READY_TIMEOUT = 30.0
SHOWN_TIMEOUT = 0.5
_ORPHAN_CHECK = 0.5


class Lab:
    """The far ends of the instruments and their commands."""

    def __init__(self, bench: LabBench, truth: TruthFile) -> None:
        self._bench = bench
        self._shared = bench.shared
        self._truth = truth

    def start(self) -> Mapping[str, Any]:
        """Start every instrument that the scene calls for; where they are, once all of them answer.

        Raises:
            BenchFault: one does not.
        """
        for name in self._bench.station.sections_for(self._bench.scene.sensors):
            self._bench.end(name)
        environment: dict[str, str] = {}
        for end in self._bench.ends.values():
            end.wait_ready(READY_TIMEOUT)
            environment |= end.environment
        addresses = {name: end.address for name, end in self._bench.ends.items()}
        return {"ready": True, "addresses": addresses, "environment": environment}

    def answer(self, line: str) -> Mapping[str, Any]:
        """Do what one line of JSON asks; an answer with the key ``error`` where it cannot be done."""
        try:
            request = json.loads(line)
            match request:
                case {"mark": {"step": int(step), "sample": int(sample)}} if len(request) == 1:
                    return {"marked": self._mark(step, sample)}
                case {"fault": dict(cue)} if len(request) == 1:
                    ends = self._bench.ends
                    fault = parse(cue, {name: end.faults for name, end in ends.items()})
                    ends[fault.instrument].cue(fault)
                    return {"begun": dict(cue)}
        except json.JSONDecodeError as error:
            return {"error": f"not a line of JSON: {error}"}
        except TouchstoneError as error:
            return {"error": str(error)}
        return {"error": f"the lab knows mark (step, sample) and fault, not {line.strip()!r}"}

    def close(self) -> None:
        """End every process."""
        for end in self._bench.ends.values():
            end.kill()

    def _mark(self, step: int, sample: int) -> Mapping[str, int]:
        """Set the step and sample, and wait until the gel has shown them."""
        mark = StepMark(self._shared.mark.number + 1, step, sample)
        self._shared.set_mark(mark)
        if sample in (PRESS, STRIKE):
            self._truth.append(self._shared.base_from_flange, step, sample)
        elif sample == LOOK:
            self._truth.looked()
        end = now() + SHOWN_TIMEOUT
        viewer = CAMERA_VIEWER if sample in (LOOK, BARE) and CAMERA in self._bench.ends else GEL_VIEWER
        while self._shared.shown(viewer) < mark.number and now() < end:
            time.sleep(2e-3)
        return {"step": step, "sample": sample}


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


def main() -> int:
    """Run the lab until standard input ends; the exit status."""
    parser = argparse.ArgumentParser(prog="python -m mocks.lab", description="The mocked bench.")
    parser.add_argument("--scene", type=Path, required=True, help="the bench, as JSON")
    parser.add_argument("--seed", type=int, required=True, help="of the run, zero or more")
    parser.add_argument(
        "--gap", required=True, help="a gap file, or the name of a shipped one: default, none"
    )
    parser.add_argument("--run", default="", help="identity of the run, which the truth repeats")
    parser.add_argument("--truth", type=Path, required=True, help="where to write what really happened")
    arguments = parser.parse_args()
    parent = os.getppid()
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is the run's to answer; it closes our input
    try:
        # Build the world; the instruments are not yet started.
        cv2.setNumThreads(0)  # threads of the parent are lost in a fork
        gap = load_gap(arguments.gap)
        told = read_lab_scene(arguments.scene, GapDraw(gap, arguments.seed))
        world = World(told.bench, gap, arguments.seed)
        strikes = strikes_of(world, told.scene, told.station, gap, arguments.seed)
        start = forward(told.station.arm.model, np.array(LEFT_ABOVE))
        _compile(world, told.bench, start)
        bench = LabBench(
            world=world,
            shared=SharedPose(start),
            scene=told.scene,
            station=told.station,
            address=free_address(),
            seed=arguments.seed,
            folder=arguments.scene.parent,
            strikes=strikes,
        )
        sound = None if strikes is None else strikes.sound
        lab = Lab(bench, TruthFile(arguments.truth, world, arguments.seed, arguments.run, sound))
    except TouchstoneError as error:
        _say({"ready": False, "error": str(error)})
        return error.exit_code
    try:
        _say(lab.start())
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
