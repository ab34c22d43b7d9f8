"""Surfaces filled with tetrahedra: right, or refused by name."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from manifold3d import Manifold

from harness.basics.errors import MeshRefused, WrongUse
from harness.basics.materials import MATERIALS
from harness.basics.mesh import Mesh, signed_volume
from harness.basics.store import Store
from harness.objects.solid import from_manifold
from harness.sim.modal.file import modes_of_file
from harness.sim.modal.modal import default_edge, modes_of, solve_modes
from harness.sim.solid.mesh_repair import boundary_edges
from harness.sim.solid.tetrahedra import Tetrahedra, tetrahedralize
from harness.sim.solid.walls import enclosed_volume, nearest_on_surface, thin_wall, wall_thickness, walled
from tests.oracles.volume_meshes import box

CERAMIC = MATERIALS["ceramic"]


def sphere(radius: float, segments: int = 40, centre: float = 0.0) -> Mesh:
    solid = from_manifold(Manifold.sphere(radius * 1e3, segments))
    return Mesh(solid.vertices * 1e-3 + np.array([centre, 0.0, 0.0]), solid.faces)


def together(*meshes: Mesh) -> Mesh:
    starts = np.cumsum([0, *(len(mesh.vertices) for mesh in meshes)])
    faces = [mesh.faces + start for mesh, start in zip(meshes, starts, strict=False)]
    return Mesh(np.concatenate([mesh.vertices for mesh in meshes]), np.concatenate(faces))


def shell(radius: float, wall: float) -> Mesh:
    inner = sphere(radius - wall)
    return together(sphere(radius), Mesh(inner.vertices, inner.faces[:, ::-1]))


@pytest.fixture(scope="module")
def filled() -> Tetrahedra:
    return tetrahedralize(sphere(0.03), 0.02)


def test_a_ball_is_filled_and_every_cell_turned_the_right_way(filled: Tetrahedra) -> None:
    assert (filled.volumes > 0.0).all()
    assert filled.volumes.sum() == pytest.approx(enclosed_volume(sphere(0.03)), rel=0.08)
    assert filled.bodies == 1
    assert len(boundary_edges(filled.surface.faces)) == 0
    assert signed_volume(filled.surface) == pytest.approx(filled.volumes.sum())


@pytest.mark.slow  # fTetWild twice
def test_nodes_on_the_surface_are_worth_finer_cells(filled: Tetrahedra) -> None:
    """Lamb's lowest mode of a ball, ``w R / c_s = 2.5011`` to 2.5014 whatever Poisson's ratio."""
    shear = np.sqrt(CERAMIC.young / (2.0 * (1.0 + CERAMIC.poisson) * CERAMIC.density))
    exact = 2.501133 * shear / (2.0 * np.pi * 0.03)
    flat = solve_modes(filled, CERAMIC, 1.3 * exact, most=5).frequencies
    curved = solve_modes(filled, CERAMIC, 1.3 * exact, sphere(0.03, 128), most=5).frequencies
    torsional = [modes[np.argmin(np.abs(modes - exact))] / exact - 1.0 for modes in (flat, curved)]
    assert abs(torsional[1]) < 5e-3
    assert abs(torsional[1]) < 0.5 * abs(torsional[0])


def test_a_thin_shell_stays_hollow() -> None:
    hollow = shell(0.03, 2e-3)
    found = tetrahedralize(hollow, 0.012)
    assert found.volumes.sum() == pytest.approx(enclosed_volume(hollow), rel=0.1)
    assert found.volumes.sum() < 0.4 * enclosed_volume(sphere(0.03))
    with pytest.raises(WrongUse, match=r"1\.5 mm.* mm"):
        tetrahedralize(hollow, 0.012, envelope=1.5e-3)


def test_an_open_surface_is_refused_and_says_what_it_needs() -> None:
    whole = sphere(0.03)
    half = Mesh(whole.vertices, whole.faces[whole.corners[:, :, 2].mean(axis=1) < 0.0])
    with pytest.raises(MeshRefused, match="--wall"):
        tetrahedralize(half, 0.01)
    thick = walled(half, 2e-3)
    assert len(boundary_edges(thick.faces)) == 0
    assert signed_volume(thick) == pytest.approx(2.0 * np.pi * 0.03**2 * 2e-3, rel=0.02)


@pytest.mark.slow  # fTetWild twice
def test_the_outside_of_a_hollow_thing_gains_a_cavity() -> None:
    outside = sphere(0.03, 64)
    hollow = walled(outside, 2e-3)
    exact = 4.0 / 3.0 * np.pi * (0.03**3 - 0.028**3)
    assert enclosed_volume(hollow) == pytest.approx(exact, rel=0.04)
    assert thin_wall(hollow, 0.5) == pytest.approx(2e-3, rel=0.05)
    assert walled(outside, None) is outside
    with pytest.raises(MeshRefused, match=r"29\.9 mm"):
        walled(outside, 0.0299)


def test_overlapping_bodies_count_once_and_separate_ones_twice() -> None:
    one = enclosed_volume(sphere(0.03))
    overlapping = together(sphere(0.03), sphere(0.03, centre=0.001))
    assert signed_volume(overlapping) == pytest.approx(2.0 * one, rel=0.02)
    assert enclosed_volume(overlapping) == pytest.approx(1.03 * one, rel=0.03)
    apart = together(sphere(0.03), sphere(0.03, centre=0.1))
    assert enclosed_volume(apart) == pytest.approx(2.0 * one, rel=0.02)


def test_a_wall_is_as_thick_as_it_was_made() -> None:
    hollow = shell(0.03, 2e-3)
    outer = hollow.vertices[:50]
    normals = outer / np.linalg.norm(outer, axis=1)[:, None]
    assert wall_thickness(hollow, outer, normals) == pytest.approx(2e-3, rel=0.05)
    assert thin_wall(hollow) == pytest.approx(2e-3, rel=0.05)


def test_the_nearest_place_looks_the_right_way() -> None:
    """Between the two sides of a wall, the side is chosen by where the node looks."""
    hollow = shell(0.03, 2e-3)
    point = np.array([[0.0288, 0.0, 0.0]])
    outward, inward = np.array([[1.0, 0.0, 0.0]]), np.array([[-1.0, 0.0, 0.0]])
    reach = np.array([5e-3])
    for way, radius in ((outward, 0.03), (inward, 0.028)):
        place, face = nearest_on_surface(hollow, point, way, reach, 0.5)
        assert face[0] >= 0
        assert np.linalg.norm(place[0]) == pytest.approx(radius, rel=0.005)
    place, face = nearest_on_surface(hollow, point, outward, np.array([1e-4]), 0.5)
    assert face[0] == -1
    assert (place == point).all()


def test_edges_that_cannot_be_are_refused() -> None:
    for edge in (0.0, np.nan, 1.0):
        with pytest.raises(WrongUse, match=r"0 to 103\.9 mm"):
            tetrahedralize(sphere(0.03), edge)


@pytest.mark.slow  # fTetWild twice
def test_cells_kept_nearer_to_the_surface_hold_its_volume_better() -> None:
    ball = sphere(0.03, 128)
    whole = enclosed_volume(ball)
    off = [abs(tetrahedralize(ball, 0.02, reach).volumes.sum() / whole - 1.0) for reach in (1e-3, 1e-4)]
    assert off[1] < 0.2 * off[0]


@pytest.mark.parametrize(("reach", "edge"), [(0.0, None), (np.nan, 0.02), (1e-3, None), (1e-3, 0.02)])
def test_an_envelope_that_closes_a_wall_up_is_refused(reach: float, edge: float | None) -> None:
    """The plate's wall is 3.43 mm thick, and a quarter of it is left."""
    with pytest.raises(WrongUse, match=r"0\.858 mm"):
        modes_of_file("builtin:plate", CERAMIC, count=3, edge=edge, envelope=reach)


def test_an_edge_that_needs_too_many_elements_is_refused_with_the_shortest() -> None:
    with pytest.raises(WrongUse, match="5,000,000") as refused:
        tetrahedralize(sphere(0.03), 1e-6)
    # A ball of 113.1 cm^3 holds 5,000,000 regular tetrahedra of 0.577 mm.
    assert 0.57 < float(str(refused.value).split()[-2]) < 0.59


def test_the_default_edge_follows_the_wave() -> None:
    solid = sphere(0.03)
    low, high = (default_edge(shell(0.1, 2e-3), CERAMIC, limit) for limit in (5e3, 20e3))
    assert low == pytest.approx(2.0 * high)
    assert default_edge(solid, CERAMIC, 20e3) == pytest.approx(0.2 * solid.diagonal)
    assert default_edge(shell(0.1, 2e-3), CERAMIC, 20e3, most=10) > high
    with pytest.raises(WrongUse, match="none"):
        default_edge(solid, CERAMIC, 20e3, most=0)


def test_modes_are_computed_once_and_then_read(
    tmp_path_factory: pytest.TempPathFactory, monkeypatch: pytest.MonkeyPatch
) -> None:
    store = Store(tmp_path_factory.mktemp("modes"))
    first = modes_of(sphere(0.03), CERAMIC, 60e3, 0.03, store=store)
    assert first.seconds["tetrahedra"] > 0.0

    def never(*_: object) -> None:
        raise AssertionError("meshed again")

    monkeypatch.setattr("harness.sim.solid.filled.tetrahedralize", never)
    again = modes_of(sphere(0.03), CERAMIC, 60e3, 0.03, store=store)
    assert (again.shapes == first.shapes).all()
    lossless = modes_of(sphere(0.03), replace(CERAMIC, name="other", alpha=0.0), 60e3, 0.03, store=store)
    assert (lossless.shapes == first.shapes).all()
    with pytest.raises(AssertionError):
        modes_of(sphere(0.03), CERAMIC, 60e3, 0.029, store=store)


@pytest.mark.slow  # fTetWild twice
def test_tetrahedra_outlive_a_change_of_the_material(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    store = Store(tmp_path)
    first = modes_of(sphere(0.03), CERAMIC, 60e3, 0.03, store=store)

    def never(*_: object) -> None:
        raise AssertionError("meshed again")

    monkeypatch.setattr("harness.sim.solid.filled.tetrahedralize", never)
    stiffer = modes_of(sphere(0.03), replace(CERAMIC, young=4.0 * CERAMIC.young), 120e3, 0.03, store=store)
    assert stiffer.frequencies == pytest.approx(2.0 * first.frequencies, rel=1e-6)
    assert stiffer.seconds["tetrahedra"] == first.seconds["tetrahedra"]


def test_modes_are_those_of_a_filling_made_again_where_edges_stayed_too_long(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    sides, stops = (0.06, 0.05, 0.04), list[float | None]()
    cuboid = box(sides, (1, 1, 1)).surface

    def coarse_at_first(_mesh: Mesh, _edge: float, _envelope: None, stop: float | None = None) -> Tetrahedra:
        stops.append(stop)
        return box(sides, (1, 1, 1) if stop is None else (4, 4, 3))

    monkeypatch.setattr("harness.sim.solid.filled.tetrahedralize", coarse_at_first)
    found = modes_of(cuboid, CERAMIC, 60e3, 0.02)
    assert len(stops) == 2
    fine = solve_modes(box(sides, (4, 4, 3)), CERAMIC, 60e3)
    assert found.frequencies == pytest.approx(fine.frequencies, rel=1e-9)
    assert found.seconds["tetrahedra"] >= 0.0
