"""Where an object is changes neither its volume, its walls nor its hull."""

import numpy as np
import pytest

from harness.basics.arrays import FloatArray
from harness.basics.mesh import Mesh, closed_hull, signed_volume
from harness.sim.solid.walls import enclosed_volume, thin_wall
from tests.oracles.volume_meshes import box

BLOCK = box((0.04, 0.03, 0.02), (2, 2, 2)).surface
VOLUME = 2.4e-5
OFFSETS = [np.zeros(3), np.array([20.0, -30.0, 10.0]), np.array([412345.678, 5654321.012, 102.5])]


def moved(offset: FloatArray) -> Mesh:
    return Mesh(BLOCK.vertices + offset, BLOCK.faces)


@pytest.mark.parametrize("offset", OFFSETS)
def test_volumes_and_walls_are_those_of_the_object_at_the_origin(offset: FloatArray) -> None:
    mesh = moved(offset)
    assert signed_volume(mesh) == pytest.approx(VOLUME, rel=1e-6)
    assert enclosed_volume(mesh) == pytest.approx(VOLUME, rel=5e-3)
    assert thin_wall(mesh) == pytest.approx(0.02, rel=1e-6)
    assert signed_volume(closed_hull(mesh.vertices)) == pytest.approx(VOLUME, rel=1e-6)
