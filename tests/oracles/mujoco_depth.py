"""MuJoCo's renderer as the oracle of height maps: an orthographic depth image, without a display.

It shares nothing with ours but mesh and pose: OpenGL transforms and fills the triangles, in single precision.
That is done in a process of its own: which of EGL and OSMesa draws is settled when MuJoCo is imported.
"""

import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import mujoco
import numpy as np

from harness.basics.arrays import FloatArray
from harness.basics.mesh import Mesh
from harness.bench.sensor import TactileSensor
from harness.sim.gel.height_map import SEARCH_DEPTH, STAND_OFF

_BACKENDS = ("egl", "osmesa")

NEAR = 1e-3
"""Metres from the eye, which is ``STAND_OFF`` behind the gel: nothing nearer is drawn."""

_FACING = (0.0, 1.0, 0.0, 0.0)
"""Half a turn about x: a camera looks along its -z with y up, the gel along its z with y down the rows."""

_PATIENCE = 100.0


class CannotDraw(Exception):
    """Neither EGL nor OSMesa draws here; says why."""


def gaps_drawn(
    scenes: Sequence[tuple[Mesh, FloatArray]], sensor: TactileSensor
) -> tuple[list[FloatArray], float]:
    """What ``height_maps`` gives of each mesh at its ``(n, 4, 4)`` poses, and CPU seconds a map.

    Raises:
        CannotDraw: on this machine.
    """
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        arrays: dict[str, Any] = {}
        for k, (mesh, poses) in enumerate(scenes):
            arrays |= {f"vertices{k}": mesh.vertices, f"faces{k}": mesh.faces, f"poses{k}": poses}
        window = (sensor.rows, sensor.columns, sensor.pitch)
        np.savez(folder / "scenes.npz", count=len(scenes), window=window, **arrays)
        reasons = []
        for backend in _BACKENDS:
            reason = _attempt(folder, backend)
            if not reason:
                with np.load(folder / "gaps.npz") as found:
                    return [found[f"gap{k}"] for k in range(len(scenes))], float(found["seconds"])
            reasons.append(f"{backend}: {reason}")
        raise CannotDraw("; ".join(reasons))


def _attempt(folder: Path, backend: str) -> str:
    """Draw in a child process; the reason why it failed, or nothing."""
    paths = os.pathsep.join([str(Path(__file__).parents[2]), *sys.path])
    # One thread, as ours: Mesa's own rasteriser takes all there are.
    environment = {**os.environ, "MUJOCO_GL": backend, "LP_NUM_THREADS": "1", "PYTHONPATH": paths}
    command = [sys.executable, __file__, str(folder)]
    done = subprocess.run(
        command, env=environment, capture_output=True, text=True, timeout=_PATIENCE, check=False
    )
    return "" if done.returncode == 0 else (done.stderr.strip().splitlines() or ["no reason given"])[-1]


def _draw_all(folder: Path) -> None:
    """In the child: what ``gaps_drawn`` left in the folder."""
    found: dict[str, Any] = {}
    seconds, maps = 0.0, 0
    with np.load(folder / "scenes.npz") as given:
        rows, columns, pitch = given["window"]
        for k in range(int(given["count"])):
            model = _model(given[f"vertices{k}"], given[f"faces{k}"], int(rows), int(columns), float(pitch))
            poses = given[f"poses{k}"]
            with mujoco.Renderer(model, int(rows), int(columns)) as renderer:
                renderer.enable_depth_rendering()
                data = mujoco.MjData(model)
                _gap(renderer, data, poses[0])
                began = time.process_time()
                found[f"gap{k}"] = np.array([_gap(renderer, data, pose) for pose in poses])
                seconds, maps = seconds + time.process_time() - began, maps + len(poses)
    np.savez(folder / "gaps.npz", seconds=seconds / maps, **found)


def _model(vertices: FloatArray, faces: FloatArray, rows: int, columns: int, pitch: float) -> mujoco.MjModel:
    spec = mujoco.MjSpec()
    spec.visual.global_.offwidth, spec.visual.global_.offheight = columns, rows
    spec.visual.quality.offsamples = 0  # one line through the centre of a pixel
    spec.stat.extent = 1.0  # so that near and far are metres
    spec.visual.map.znear, spec.visual.map.zfar = NEAR, STAND_OFF + SEARCH_DEPTH
    shell = mujoco.mjtMeshInertia.mjMESH_INERTIA_SHELL
    spec.add_mesh(name="object", uservert=vertices.ravel(), userface=faces.ravel(), inertia=shell)
    body = spec.worldbody.add_body(name="object", mocap=True)
    body.add_geom(type=mujoco.mjtGeom.mjGEOM_MESH, meshname="object", contype=0, conaffinity=0)
    camera = spec.worldbody.add_camera(name="gel", pos=[0.0, 0.0, -STAND_OFF], quat=_FACING)
    camera.proj, camera.fovy = mujoco.mjtProjection.mjPROJ_ORTHOGRAPHIC, rows * pitch
    return spec.compile()


def _gap(renderer: mujoco.Renderer, data: mujoco.MjData, pose: FloatArray) -> FloatArray:
    turn = np.empty(4)
    mujoco.mju_mat2Quat(turn, np.ascontiguousarray(pose[:3, :3]).ravel())
    data.mocap_pos[0], data.mocap_quat[0] = pose[:3, 3], turn
    mujoco.mj_forward(renderer.model, data)
    renderer.update_scene(data, "gel")
    depth = renderer.render().astype(np.float64)
    nothing = depth >= np.float32(STAND_OFF + SEARCH_DEPTH)
    return np.where(nothing, np.inf, depth - STAND_OFF)


if __name__ == "__main__":
    _draw_all(Path(sys.argv[1]))
