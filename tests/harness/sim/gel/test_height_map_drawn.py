"""Height maps beside those of MuJoCo's renderer, which shares nothing with ours but mesh and pose."""

import numpy as np
import pytest
import trimesh

from harness.basics.arrays import FloatArray
from harness.basics.geometry import rotation_about, transform, translation
from harness.basics.mesh import Mesh
from harness.bench.sensor import GELSIGHT_R15
from harness.objects.household import build
from harness.sim.gel.height_map import RasterMesh, height_maps
from harness.sim.gel.press_pose import contact_place, gel_from_object
from tests.oracles.mujoco_depth import CannotDraw, gaps_drawn

SENSOR = GELSIGHT_R15
WANTED = 0.2e-6
FACE = 4e-3
"""Metres from the middle of the slab to its face."""


def _presses(mesh: Mesh, count: int) -> FloatArray:
    """Anywhere, tilted to 15 degrees, half a millimetre to two deep."""
    rng = np.random.default_rng(8)
    chosen = rng.choice(len(mesh.faces), count, p=mesh.face_areas / mesh.face_areas.sum())
    return np.array(
        [
            gel_from_object(
                contact_place(mesh, mesh.corners[face].mean(axis=0)),
                rng.uniform(0.5e-3, 2e-3),
                rng.uniform(0.0, np.radians(15.0)),
                *rng.uniform(0.0, 2.0 * np.pi, 2),
            )
            for face in chosen
        ]
    )


def _slab() -> tuple[Mesh, FloatArray]:
    """A slab wider than the window, leant by up to 30 degrees about its middle."""
    box = trimesh.creation.box(extents=(80e-3, 80e-3, 2.0 * FACE))
    axes = np.array([[1.0, 0.0, 0.0], [0.6, 0.8, 0.0], [-0.8, 0.6, 0.0]])
    turns = [rotation_about(axis, angle) for axis, angle in zip(axes, (0.0, 0.2, 0.5), strict=True)]
    poses = [transform(turn, np.array([0.3e-3, -0.2e-3, 3e-3])) for turn in turns]
    return Mesh(np.asarray(box.vertices), np.asarray(box.faces)), np.array(poses)


def _slab_true(poses: FloatArray) -> FloatArray:
    """Where every pixel's line meets the slab's face, by the plane's equation."""
    x = (np.arange(SENSOR.columns) + 0.5 - SENSOR.columns / 2) * SENSOR.pitch
    y = (np.arange(SENSOR.rows) + 0.5 - SENSOR.rows / 2) * SENSOR.pitch
    normal = poses[:, :3, 2]
    middle = poses[:, :3, 3] - FACE * normal
    level = (normal * middle).sum(axis=1)[:, None, None]
    across = normal[:, 0, None, None] * x + normal[:, 1, None, None] * y[:, None]
    return np.asarray((level - across) / normal[:, 2, None, None])


def test_maps_are_those_of_mujocos_renderer() -> None:
    """On planes, whose depth is known, the renderer errs by far less than what is held against ours."""
    slab, leant = _slab()
    mug = build("mug", 2e-3)
    presses = _presses(mug, 12)
    try:
        (planes, drawn), _ = gaps_drawn([(slab, leant), (mug, presses)], SENSOR)
    except CannotDraw as why:
        pytest.skip(f"MuJoCo draws nothing on this machine: {why}")
    assert np.abs(planes - _slab_true(leant)).max() < 0.1 * WANTED

    raster = RasterMesh(mug)
    ours = height_maps(raster, presses, SENSOR)
    seen = np.isfinite(ours) & np.isfinite(drawn)
    assert (np.isfinite(ours) != np.isfinite(drawn)).mean() < 1e-4
    assert seen.mean() > 0.3
    apart = np.abs(ours[seen] - drawn[seen])
    assert np.percentile(apart, 99.0) < WANTED
    # An edge or two may run through a pixel's centre; then rounding says which face is met.
    assert (apart > 10e-6).mean() < 1e-4

    aside = height_maps(raster, translation(np.array([0.02 * SENSOR.pitch, 0.0, 0.0])) @ presses, SENSOR)
    both = np.isfinite(aside) & np.isfinite(drawn)
    assert np.percentile(np.abs(aside[both] - drawn[both]), 99.0) > WANTED
