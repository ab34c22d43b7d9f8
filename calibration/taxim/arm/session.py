"""A calibration by the arm as a procedure of the bench: its scene, its plan and its presses."""

from functools import partial

import numpy as np

from calibration.taxim.arm.plan import PressSettings, plan_presses
from calibration.taxim.arm.press import BallPresses
from calibration.taxim.arm.record import NAME
from harness.basics.errors import WrongUse
from harness.basics.mesh import Mesh
from harness.bench.scene import SceneFile, scene_from_json
from harness.bench.station_file import Station
from harness.experiment.experiment import Helpers, Planned, Procedure
from harness.objects.targets import BALL_RADIUS
from harness.recording.run_folder import RunFiles
from harness.twin.bench_of import twin_of, way_between

GAP = "target"
"""Of a mocked bench, where no other is asked for: a ball on a rigid stand, a sensor not yet calibrated."""

BALL = "ball"


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


def procedure(settings: PressSettings | None = None) -> Procedure:
    """What the arm does: presses of the ball, and looks at the untouched gel between them.

    Args:
        settings: of presses that are still to be planned; None for a run that is planned.
    """
    return Procedure(
        name=NAME,
        step="step",
        plan=partial(_planned, settings or PressSettings()),
        performer=_performer,
        gap=GAP,
    )


def _planned(settings: PressSettings, scene: SceneFile, station: Station, mesh: Mesh, seed: int) -> Planned:
    radius = BALL_RADIUS * scene.object.drawn_scale
    top = mesh.vertices[int(np.argmax(mesh.vertices[:, 2]))]
    twin, sensor = twin_of(scene, station, mesh), station.gel.sensor
    plan = plan_presses(twin, top, radius, settings, seed)
    described = {
        **plan.to_json(),
        "ball_radius_m": radius,
        "pitch_m": sensor.pitch,
        "sensor": sensor.name,
    }
    return Planned(described.pop("steps"), plan.rehearsal, twin, described)


def _performer(run: RunFiles, helpers: Helpers) -> BallPresses:
    plan = run.recording.header.plan
    ball = float(plan["ball_radius_m"]) / float(plan["pitch_m"])
    return BallPresses(partial(way_between, helpers.twin), ball, say=helpers.say)
