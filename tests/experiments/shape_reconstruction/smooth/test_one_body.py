"""One body: pieces are joined or removed, cavities are filled, and the note says which."""

import numpy as np
import pytest
import trimesh
from scipy import ndimage

from experiments.shape_reconstruction.smooth.grid import extract_body
from harness.basics.arrays import FloatArray
from harness.basics.faces.mesh_rays import is_inside
from harness.basics.mesh import Mesh

PITCH = 2.0e-3
CORNERS = np.stack(np.meshgrid(*[np.arange(60) * PITCH] * 3, indexing="ij"), axis=-1)
LARGE, SMALL, DUST = (0.03, 0.06, 0.06), (0.085, 0.06, 0.06), (0.06, 0.1, 0.1)


def ball(centre: tuple[float, float, float], radius: float) -> FloatArray:
    return np.asarray(np.linalg.norm(CORNERS - np.array(centre), axis=-1) - radius)


THREE = np.minimum(np.minimum(ball(LARGE, 0.02), ball(SMALL, 0.015)), ball(DUST, 0.004))


def pieces(mesh: Mesh) -> int:
    body = trimesh.Trimesh(mesh.vertices, mesh.faces, process=False)
    assert body.is_watertight
    return len(trimesh.graph.connected_components(body.face_adjacency, nodes=np.arange(len(body.faces))))


@pytest.mark.parametrize(
    ("contacts", "holds", "lacks", "note"),
    [
        (None, (LARGE, SMALL), (DUST,), "1 joined to the main one, 1 removed"),
        ([(0.03, 0.06, 0.08)], (LARGE, SMALL), (DUST,), "1 joined to the main one, 1 removed"),
        (
            [(0.03, 0.06, 0.08), (0.06, 0.1, 0.104)],
            (LARGE, SMALL, DUST),
            (),
            "2 joined to the main one, 0 removed",
        ),
        ([(0.06, 0.1, 0.104)], (DUST, LARGE, SMALL), (), "2 joined to the main one, 0 removed"),
        ([(0.0, 0.0, 0.0)], (LARGE, SMALL), (DUST,), "1 joined to the main one, 1 removed"),  # on no piece
    ],
)
def test_pieces_that_carry_contacts_or_are_large_are_joined_and_the_rest_is_removed(
    contacts: list[tuple[float, float, float]] | None, holds: tuple[object], lacks: tuple[object], note: str
) -> None:
    touched = None if contacts is None else np.array(contacts)
    body = extract_body(THREE, np.zeros(3), PITCH, touched)
    assert pieces(body.mesh) == 1
    assert is_inside(np.array(holds), body.mesh.corners).all()
    assert not lacks or not is_inside(np.array(lacks), body.mesh.corners).any()
    assert body.notes == (f"the surface was in 3 pieces: {note}",)


def test_a_small_piece_that_nothing_touched_is_removed() -> None:
    field = np.minimum(ball(DUST, 0.011), ball(SMALL, 0.006))
    touched = np.array([[0.06, 0.1, 0.111], [0.06, 0.1, 0.089]])
    kept = extract_body(field, np.zeros(3), PITCH, touched)
    assert is_inside(np.array([DUST]), kept.mesh.corners).all()
    assert not is_inside(np.array([SMALL]), kept.mesh.corners).any()


def test_a_single_body_stays_as_it_is_and_says_nothing() -> None:
    body = extract_body(ball(LARGE, 0.02), np.zeros(3), PITCH)
    assert body.notes == ()
    assert np.linalg.norm(body.mesh.vertices - np.array(LARGE), axis=1) == pytest.approx(0.02, abs=0.1e-3)


def test_a_cavity_is_filled() -> None:
    shell = np.maximum(ball(LARGE, 0.02), -ball(LARGE, 0.01))
    body = extract_body(shell, np.zeros(3), PITCH)
    assert pieces(body.mesh) == 1
    assert is_inside(np.array([LARGE]), body.mesh.corners).all()


@pytest.mark.parametrize("seed", range(6))
def test_any_field_gives_one_closed_surface(seed: int) -> None:
    random = np.random.default_rng(seed)
    field = 0.01 * ndimage.gaussian_filter(random.normal(size=(30, 30, 30)), 1.0)
    assert pieces(extract_body(field, np.zeros(3), PITCH, random.uniform(0.0, 0.06, (5, 3))).mesh) == 1
