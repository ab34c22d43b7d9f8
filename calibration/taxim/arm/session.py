"""Begin a calibration by the arm, and perform it on a bench: what the command is made of."""

import datetime as dt
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np

from calibration.taxim.arm.plan import PressPlan, PressSettings, plan_presses
from calibration.taxim.arm.press import BallPresses
from calibration.taxim.arm.record import NAME
from harness.basics.errors import WrongUse
from harness.bench.device import Health
from harness.bench.gap import lasting_name
from harness.bench.scene import SceneFile, scene_from_json
from harness.bench.station import Bench, RunContext, open_station
from harness.bench.station_file import Station
from harness.effects.scene_object import known_object
from harness.objects.targets import BALL_RADIUS
from harness.recording.recording import Recording, require_unused
from harness.recording.run_folder import RunFiles, create_run, station_calibration
from harness.recording.session import Progress, perform
from harness.twin.bench_of import twin_of, way_between

GAP = "target"
"""Of a mocked bench, where no other is asked for: a ball on a rigid stand, a sensor not yet calibrated."""

BALL = "ball"


@dataclass(frozen=True, eq=False)
class Begun:
    """A calibration that is planned, rehearsed and on the disk, and has not moved yet."""

    recording: Recording
    plan: PressPlan


def ball_scene(ball_radius: float, scene: SceneFile | None = None) -> SceneFile:
    """A scene with the ball of this size on the table; at the default place where no scene says another.

    Args:
        ball_radius: m.
        scene: says where it stands; None for the default place.

    Raises:
        WrongUse: a scene of something else.
    """
    if scene is None:
        scene = scene_from_json(
            {"schema": 1, "object": {"mesh": f"builtin:{BALL}"}, "support": {"kind": "clamped"}},
            "the ball's scene",
        )
    if scene.object.builtin != BALL:
        raise WrongUse(
            f"--scene: its object is {scene.object.name}; a gel is calibrated on 'builtin:{BALL}', a ball on "
            "a stem (scenes/ball_target.toml is one)"
        )
    ball = scene.object.model_copy(update={"scale": ball_radius / BALL_RADIUS})
    return scene.model_copy(update={"object": ball})


def begin(
    scene: SceneFile,
    station: Station,
    settings: PressSettings,
    seed: int,
    gap: str | None = None,
    folder: Path | None = None,
) -> Begun:
    """Plan and rehearse every press, and make the run's folder.

    Args:
        scene: from ``ball_scene``.
        station: whose arm and gel.
        settings: of the presses.
        seed: of the places, and of a mocked world.
        gap: reality gap of a mocked bench; ``GAP`` where None.
        folder: of the run; a dated one under ``runs/`` where None.

    Raises:
        WrongUse: settings that cannot be; a gap for a real bench; a folder that holds a run.
        MotionRefused: the rehearsal found a motion that must not be made; nothing was created.
    """
    if folder is not None:
        require_unused(folder)
    mock = None if station.mock is None else {"gap": lasting_name(gap or GAP)}
    if gap is not None and mock is None:
        raise WrongUse("--gap is for a mocked bench; this station is a real one: leave it out")
    mesh = known_object(scene).mesh
    radius = BALL_RADIUS * scene.object.scale
    top = mesh.vertices[int(np.argmax(mesh.vertices[:, 2]))]
    plan = plan_presses(twin_of(scene, station, mesh), top, radius, settings, seed)
    sensor = station.gel.sensor
    told = {
        **plan.to_json(),
        "ball_radius_m": radius,
        "pitch_m": sensor.pitch,
        "sensor": sensor.name,
        "warnings": list(plan.rehearsal.warnings),
    }
    where = folder or _new_folder()
    calibration = station_calibration(station)
    return Begun(create_run(where, NAME, scene, station, mesh, calibration, told, seed, mock), plan)


def perform_on_bench(
    recording: Recording, progress: Progress, say: Callable[[str], None]
) -> tuple[bool, dict[str, Health]]:
    """Open the run's bench and make the presses that are left; False where Ctrl-C ended it early."""
    run = RunFiles(recording)
    mock = recording.header.mock
    gap = None if mock is None else mock["gap"]
    context = RunContext(recording.truth_path, run.mesh, recording.header.seed, gap)
    with open_station(run.station, run.scene, context) as bench:
        return perform_on(bench, recording, progress, say)


def perform_on(
    bench: Bench, recording: Recording, progress: Progress, say: Callable[[str], None] = lambda _: None
) -> tuple[bool, dict[str, Health]]:
    """Make what is left of a run on an open bench; how its instruments did."""
    run = RunFiles(recording)
    plan = recording.header.plan
    twin = twin_of(run.scene, run.station, run.mesh)
    ball = float(plan["ball_radius_m"]) / float(plan["pitch_m"])
    presses = BallPresses(partial(way_between, twin), ball, say=say)
    complete = perform(presses, bench, recording, bench.arm.stop, progress)
    return complete, {"arm": bench.arm.health(), "gel": bench.gel.health()}


def _new_folder() -> Path:
    stamp = dt.datetime.now().astimezone().strftime("%Y%m%d-%H%M%S")
    base = Path("runs") / f"{stamp}-{NAME}"
    candidates = (base, *(base.with_name(f"{base.name}-{k}") for k in range(2, 1000)))
    return next(path for path in candidates if not path.exists())
