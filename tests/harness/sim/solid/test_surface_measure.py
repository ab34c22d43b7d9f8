"""What of a surface is flat: wherever it lies, and however finely it is cut."""

import numpy as np
import pytest
from manifold3d import Manifold
from scipy.spatial.transform import Rotation

from harness.basics.mesh import Mesh
from harness.objects.solid import from_manifold
from harness.sim.solid.walls import flat_share

TURN = Rotation.from_rotvec([0.4, -1.1, 0.7]).as_matrix()


def finer(mesh: Mesh) -> Mesh:
    """Every face cut into three at its middle."""
    middles = mesh.corners.mean(axis=1)
    new = len(mesh.vertices) + np.arange(len(mesh.faces))
    cut = [np.column_stack([mesh.faces[:, [a, b]], new]) for a, b in ((0, 1), (1, 2), (2, 0))]
    return Mesh(np.concatenate([mesh.vertices, middles]), np.concatenate(cut))


def tray() -> Manifold:
    return Manifold.cube((0.2, 0.1, 0.03)) - Manifold.cube((0.19, 0.09, 0.03)).translate(
        (0.005, 0.005, 0.005)
    )


@pytest.mark.parametrize("body", [Manifold.cube((0.1, 0.08, 0.02)), tray()], ids=["slab", "tray"])
def test_all_of_what_has_planes_only_is_flat(body: Manifold) -> None:
    mesh = from_manifold(body)
    assert flat_share(mesh) == pytest.approx(1.0)
    assert flat_share(finer(mesh)) == pytest.approx(1.0)
    assert flat_share(Mesh(1e3 * mesh.vertices @ TURN.T, mesh.faces)) == pytest.approx(1.0)


@pytest.mark.parametrize("sides", [60, 200, 2000])
def test_of_a_cylinder_only_the_ends_are_flat(sides: int) -> None:
    radius, height = 0.04, 0.05
    mesh = from_manifold(Manifold.cylinder(height, radius, circular_segments=sides))
    assert flat_share(mesh) == pytest.approx(radius / (radius + height), rel=2e-3)


def test_nothing_of_a_ball_is_flat() -> None:
    assert flat_share(from_manifold(Manifold.sphere(0.03, 64))) == 0.0


def test_a_plate_of_rounded_rims_is_flat_but_for_them() -> None:
    ball = Manifold.sphere(0.001, 32)
    corners = [ball.translate((x, y, 0.0)) for x in (0.0, 0.1) for y in (0.0, 0.08)]
    rounded = from_manifold(Manifold.batch_hull(corners))
    middle = 2.0 * 0.1 * 0.08 / float(rounded.face_areas.sum())
    assert flat_share(rounded) == pytest.approx(middle, rel=1e-6)
