"""An object whose modes are known waves through space, so that a network can be right or wrong."""

import numpy as np
import pytest
import trimesh

from harness.basics.arrays import FloatArray
from harness.sim.modal.modes import Modes

MODES = 6


def wavy(points: FloatArray) -> FloatArray:
    """``(n, MODES, 3)``: plane waves of 30 to 80 rad/m, each with a direction of its own."""
    random = np.random.default_rng(7)
    directions = random.normal(size=(MODES, 3))
    directions /= np.linalg.norm(directions, axis=1)[:, None]
    vectors = directions * np.linspace(30.0, 80.0, MODES)[:, None]
    swing = random.normal(size=(MODES, 3))
    return np.sin(points @ vectors.T + np.arange(MODES))[:, :, None] * swing


def modes_on(points: FloatArray, faces: np.ndarray[tuple[int, ...], np.dtype[np.int64]]) -> Modes:
    """The waves at nodes of a surface, with frequencies far apart."""
    mesh = trimesh.Trimesh(points, faces, process=False)
    return Modes(
        frequencies=np.linspace(500.0, 5000.0, MODES),
        points=points,
        normals=np.array(mesh.vertex_normals, dtype=np.float64),
        faces=np.asarray(faces, dtype=np.int64),
        shapes=wavy(points),
        limit=6000.0,
        mass=0.3,
        rigid=6,
        nodes=len(points),
        elements=1,
        residual=0.0,
        seconds={},
    )


@pytest.fixture
def egg() -> Modes:
    """642 nodes on an ellipsoid of 60 x 80 x 100 mm."""
    ball = trimesh.creation.icosphere(subdivisions=3)
    points = np.asarray(ball.vertices, dtype=np.float64) * [0.03, 0.04, 0.05]
    return modes_on(points, np.asarray(ball.faces, dtype=np.int64))
