"""A picture of the bench, drawn by MuJoCo without a display where the machine can.

Drawing happens in a process of its own: the choice between EGL and OSMesa is made when MuJoCo is
imported, and a broken graphics driver must not take a run with it. Nothing else needs it.
"""

import json
import os
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import mujoco
import numpy as np

from harness.basics.arrays import ByteArray, FloatArray
from harness.twin.bench import TwinBench

BACKENDS: Final = ("egl", "osmesa")
HIDDEN: Final = 4  # a group of geoms that is not drawn
PATIENCE: Final = 60.0  # s for one attempt


@dataclass(frozen=True)
class View:
    """Where the picture is taken from.

    Attributes:
        look_at: m in base.
        distance: m.
        azimuth: degrees about the vertical.
        elevation: degrees, negative from above.
        width: pixels.
        height: pixels.
    """

    look_at: tuple[float, float, float] = (-0.25, 0.0, 0.32)
    distance: float = 1.35
    azimuth: float = 75.0
    elevation: float = -14.0
    width: int = 1280
    height: int = 720


@dataclass(frozen=True, eq=False)
class Picture:
    """What was drawn, or why nothing was.

    Attributes:
        image: ``(height, width, 3)`` 8-bit red, green, blue; None where drawing failed.
        reason: why; empty where there is an image.
    """

    image: ByteArray | None
    reason: str = ""


def picture(bench: TwinBench, joints: FloatArray, view: View | None = None) -> Picture:
    """Draw the arm in a posture of ``(6,)`` rad, with the object as it is, not its hull."""
    view = view or View()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        mujoco.mj_saveModel(_drawable(bench, view), str(folder / "bench.mjb"))
        request = {"joints": list(map(float, joints)), "view": view.__dict__}
        (folder / "request.json").write_text(json.dumps(request))
        reasons = []
        for backend in BACKENDS:
            reason = _attempt(folder, backend)
            if not reason:
                return Picture(np.load(folder / "image.npy", allow_pickle=False))
            reasons.append(f"{backend}: {reason}")
    needed = "install libegl1 and libgl1-mesa-dri, or libosmesa6"
    return Picture(None, f"no picture of the bench ({'; '.join(reasons)}); {needed}")


def _drawable(bench: TwinBench, view: View) -> mujoco.MjModel:
    spec = bench.spec.copy()
    spec.visual.global_.offwidth, spec.visual.global_.offheight = view.width, view.height
    spec.visual.headlight.ambient = [0.35, 0.35, 0.35]
    spec.add_texture(
        name="sky",
        type=mujoco.mjtTexture.mjTEXTURE_SKYBOX,
        builtin=mujoco.mjtBuiltin.mjBUILTIN_GRADIENT,
        rgb1=[0.93, 0.94, 0.96],
        rgb2=[0.75, 0.79, 0.84],
        width=64,
        height=384,
    )
    spec.geom("object").group = HIDDEN
    mesh, pose = bench.solid.mesh, bench.base_from_object
    spec.add_mesh(
        name="surface",
        uservert=mesh.vertices.ravel(),
        userface=mesh.faces.ravel(),
        inertia=mujoco.mjtMeshInertia.mjMESH_INERTIA_SHELL,
    )
    turn = np.empty(4)
    mujoco.mju_mat2Quat(turn, np.ascontiguousarray(pose[:3, :3]).ravel())
    spec.worldbody.add_geom(
        name="surface",
        type=mujoco.mjtGeom.mjGEOM_MESH,
        meshname="surface",
        pos=pose[:3, 3],
        quat=turn,
        contype=0,
        conaffinity=0,
        rgba=spec.geom("object").rgba,
    )
    spec.worldbody.add_light(pos=[0.5, 0.8, 2.0], dir=[-0.4, -0.4, -1.0], diffuse=[0.6, 0.6, 0.6])
    return spec.compile()


def _attempt(folder: Path, backend: str) -> str:
    """Draw in a child process; the reason why it failed, or nothing."""
    command = [sys.executable, "-m", "harness.twin.picture", str(folder)]
    environment = {**os.environ, "MUJOCO_GL": backend, "PYTHONPATH": os.pathsep.join(sys.path)}
    try:
        done = subprocess.run(
            command, env=environment, capture_output=True, text=True, timeout=PATIENCE, check=False
        )
    except subprocess.TimeoutExpired:
        return f"no picture after {PATIENCE:g} s"
    if done.returncode == 0:
        return ""
    lines = done.stderr.strip().splitlines()
    return lines[-1] if lines else f"ended with status {done.returncode}"


def _draw(folder: Path) -> None:
    """In the child: what ``picture`` left in the folder, into ``image.npy``."""
    request = json.loads((folder / "request.json").read_text())
    model = mujoco.MjModel.from_binary_path(str(folder / "bench.mjb"))
    data = mujoco.MjData(model)
    data.qpos[:] = request["joints"]
    mujoco.mj_forward(model, data)  # lights and cameras are placed here; nothing is stepped
    view = View(**request["view"])
    camera = mujoco.MjvCamera()
    camera.lookat[:], camera.distance = view.look_at, view.distance
    camera.azimuth, camera.elevation = view.azimuth, view.elevation
    with mujoco.Renderer(model, view.height, view.width) as renderer:
        renderer.update_scene(data, camera)
        np.save(folder / "image.npy", renderer.render(), allow_pickle=False)


if __name__ == "__main__":
    _draw(Path(sys.argv[1]))
