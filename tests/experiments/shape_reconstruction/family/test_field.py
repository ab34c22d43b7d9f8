"""The surface of a mixture has no hole where a wall is thin."""

import numpy as np
import pytest

from experiments.shape_reconstruction.family import layout
from experiments.shape_reconstruction.family import revolution_distance as revolution
from experiments.shape_reconstruction.family.field import BELOW, corners_of, median_surface
from experiments.shape_reconstruction.family.kind import FamilyShape
from experiments.shape_reconstruction.family.kinds import draw_shape
from experiments.shape_reconstruction.family.posterior import Mixture
from experiments.shape_reconstruction.family.search import Hypothesis
from harness.basics.mesh import Mesh


def cup_with(wall: float) -> FamilyShape:
    cup = draw_shape("bowl", np.random.default_rng(2))
    theta = cup.theta.copy()
    theta[[revolution.SLOT.wall, revolution.SLOT.floor]] = np.log(wall)
    return FamilyShape(cup.name, cup.code, theta)


def surface_of(shape: FamilyShape, pitch: float) -> Mesh:
    return median_surface(mixture_of_all(shape), pitch).mesh


def mixture_of_all(*shapes: FamilyShape) -> Mixture:
    """All as likely as each other."""
    every = []
    for shape in shapes:
        every.append(Hypothesis.__new__(Hypothesis))
        object.__setattr__(every[-1], "shape", shape)
    return Mixture(tuple(every), np.full(len(every), 1.0 / len(every)), ((),) * len(every))


def board_at(x: float, thick: float) -> FamilyShape:
    board = draw_shape("board", np.random.default_rng(1))
    theta = board.theta.copy()
    theta[revolution.SLOT.radii] = np.log(0.5 * thick)
    theta[revolution.SLOT.core_y], theta[layout.X], theta[layout.YAW] = np.log(1e-5), x, 0.5
    return FamilyShape(board.name, board.code, theta)


def holes_and_pieces(mesh: Mesh) -> int:
    """Euler's characteristic: two for one piece without a hole through it."""
    edges = np.sort(mesh.faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    return len(np.unique(mesh.faces)) - len(np.unique(edges, axis=0)) + len(mesh.faces)


@pytest.mark.parametrize("wall", [0.4e-3, 1.0e-3, 1.5e-3, 3.0e-3])
def test_a_thin_wall_has_no_holes_and_its_outside_is_where_it_was(wall: float) -> None:
    shape = cup_with(wall)
    mesh = surface_of(shape, 2.5e-3)
    assert holes_and_pieces(mesh) == 2
    assert mesh.bounds[1, 2] == pytest.approx(corners_of(shape)[:, 2].max(), abs=1.5e-3)


def test_the_grid_is_fine_enough_for_a_wall_of_a_millimetre_and_a_half() -> None:
    coarse, fine = (volume(surface_of(cup_with(1.5e-3), pitch)) for pitch in (2.5e-3, 0.9e-3))
    assert coarse == pytest.approx(fine, rel=0.1)


def volume(mesh: Mesh) -> float:
    a, b, c = mesh.corners.transpose(1, 0, 2)
    return float(np.einsum("ni,ni->n", a, np.cross(b, c)).sum() / 6.0)


def test_bodies_that_lie_apart_are_answered_by_the_likeliest() -> None:
    apart = [board_at(x, 6e-3) for x in (0.0, 0.05, 0.1)]
    mesh = median_surface(mixture_of_all(*apart), 2.5e-3).mesh
    assert holes_and_pieces(mesh) == 2
    assert mesh.bounds[0, 0] < 0.0


@pytest.mark.parametrize("thick", [2.0e-3, 3.0e-3])
def test_a_thin_board_is_whole_however_it_is_turned_on_the_grid(thick: float) -> None:
    for yaw in (0.0, 0.02, 0.5):
        board = board_at(0.0, thick)
        board.theta[layout.YAW], board.theta[layout.TILT_X] = yaw, 0.01
        mesh = surface_of(board, 4e-3)
        assert holes_and_pieces(mesh) == 2
        corners = corners_of(board)
        assert np.ptp(mesh.bounds, axis=0) == pytest.approx(np.ptp(corners, axis=0), abs=4e-3)


@pytest.mark.parametrize("thick", [0.05e-3, 0.4e-3, 1.5e-3])
def test_a_body_thinner_than_the_grid_has_a_surface(thick: float) -> None:
    assert volume(surface_of(board_at(0.0, thick), 4e-3)) > 0.0


def test_no_surface_goes_on_below_the_support() -> None:
    pot = draw_shape("teapot", np.random.default_rng(0))
    theta = pot.theta.copy()
    slot = revolution.SLOT
    theta[[slot.spout_at, slot.spout_rise, slot.spout_reach]] = 0.1, -2.0, np.log(0.06)
    sunk = FamilyShape(pot.name, pot.code, theta)
    assert corners_of(sunk)[:, 2].min() < -0.1
    mesh = surface_of(sunk, 2.5e-3)
    assert mesh.bounds[0, 2] == pytest.approx(-BELOW, abs=1e-6)
    assert volume(mesh) > 0.0
    edges = np.sort(mesh.faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    assert (np.unique(edges, axis=0, return_counts=True)[1] == 2).all()


def test_a_body_that_stands_on_the_support_is_as_it_is() -> None:
    shape = cup_with(3.0e-3)
    theta = shape.theta.copy()
    theta[layout.LIFT] = -2.0e-3
    low = FamilyShape(shape.name, shape.code, theta)
    assert surface_of(low, 2.5e-3).bounds[0, 2] == pytest.approx(-2.0e-3, abs=0.2e-3)
