"""A surface with shorter edges is the same surface."""

import numpy as np
import pytest
import trimesh

from harness.basics.errors import WrongUse
from harness.basics.mesh import Mesh, signed_volume
from harness.sim.solid.filled import with_edges_below
from tests.oracles.seen_shapes import cuboid

BOX = cuboid(0.3, 0.01, 0.002)


def edges(mesh: Mesh) -> np.ndarray[tuple[int, ...], np.dtype[np.float64]]:
    """m, of every face's three."""
    lengths: np.ndarray[tuple[int, ...], np.dtype[np.float64]] = np.linalg.norm(
        mesh.corners - np.roll(mesh.corners, 1, axis=1), axis=2
    )
    return lengths


@pytest.mark.parametrize("longest", [0.2, 0.02, 0.003])
def test_area_volume_and_closedness_stay(longest: float) -> None:
    finer = with_edges_below(BOX, longest)
    assert edges(finer).max() <= longest
    assert finer.face_areas.sum() == pytest.approx(BOX.face_areas.sum(), rel=1e-12)
    assert signed_volume(finer) == pytest.approx(signed_volume(BOX), rel=1e-12)
    assert trimesh.Trimesh(finer.vertices, finer.faces, process=False).is_watertight
    np.testing.assert_array_equal(finer.vertices[: len(BOX.vertices)], BOX.vertices)


def test_what_is_fine_enough_is_left_alone() -> None:
    assert with_edges_below(BOX, edges(BOX).max()) is BOX


@pytest.mark.parametrize("longest", [0.0, -1.0, float("nan"), 1e-5])
def test_edges_that_cannot_be_made_are_refused(longest: float) -> None:
    with pytest.raises(WrongUse, match=r"0\.3 m .* m.* m"):
        with_edges_below(BOX, longest)
