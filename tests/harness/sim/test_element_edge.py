"""Edges of elements from what is asked for, and fillings that are made once."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from ritz_box import ritz_frequencies
from volume_meshes import box

from harness.arrays import FloatArray
from harness.materials import MATERIALS
from harness.mesh import Mesh
from harness.sim import element_edge
from harness.sim import filled as filling
from harness.sim.element_edge import FINE_SHARE, fine_edge, finely_filled, weyl_frequency
from harness.sim.modal import curved
from harness.sim.modal_solve import solve_mesh
from harness.sim.tetrahedra import Tetrahedra
from harness.store import Store

STEEL = MATERIALS["steel"]
CUBE = (0.06, 0.06, 0.06)
UNLIMITED = 1e12


def brick(sides: tuple[float, float, float]) -> Mesh:
    corners = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)]) * np.array(sides)
    sides_of = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    return Mesh(
        corners, np.array([[a, b, c] for i, j, k, m in sides_of for a, b, c in ((i, j, k), (i, k, m))])
    )


def shear_wave(frequency: float) -> float:
    return float(np.sqrt(STEEL.young / (2.0 * (1.0 + STEEL.poisson) * STEEL.density))) / frequency


@pytest.mark.parametrize("sides", [CUBE, (0.06, 0.045, 0.03), (0.06, 0.05, 0.02)], ids=str)
@pytest.mark.parametrize("poisson", [0.1, 0.4])
def test_weyls_law_finds_the_highest_of_the_modes_asked_for(
    sides: tuple[float, float, float], poisson: float
) -> None:
    of = replace(STEEL, poisson=poisson)
    exact: FloatArray = ritz_frequencies(sides, of, 13)
    for count in (10, 30, 60):
        found = weyl_frequency(brick(sides), of, count, float(np.prod(sides)))
        assert 0.9 < found / exact[count - 1] < 1.25


def test_ten_modes_of_a_cube_are_within_a_thousandth_of_ritz_without_more_unknowns_than_that_takes() -> None:
    cube = brick(CUBE)
    inside, _, _ = finely_filled(cube, STEEL, UNLIMITED, 10, None)
    solved = solve_mesh(curved(inside, cube, inside), STEEL, np.inf, least=10)
    exact = ritz_frequencies(CUBE, STEEL, 14)[:10]
    assert np.abs(solved.modes.frequencies[:10] / exact - 1.0).max() < 1e-3
    assert solved.unknowns < 40_000


def test_an_edge_grows_with_the_object_and_falls_with_the_modes_asked_for() -> None:
    small, large = (brick((scale, 0.9 * scale, 0.8 * scale)) for scale in (0.05, 0.1))
    few, more, many = (fine_edge(small, STEEL, UNLIMITED, count) for count in (5, 20, 80))
    assert few > more > many
    assert fine_edge(large, STEEL, UNLIMITED, 20) == pytest.approx(2.0 * more)


def test_a_limit_below_the_modes_asked_for_decides() -> None:
    cube = brick(CUBE)
    limit = 0.8 * weyl_frequency(cube, STEEL, 40, float(np.prod(CUBE)))
    assert fine_edge(cube, STEEL, limit, 40) == pytest.approx(FINE_SHARE * shear_wave(limit), rel=1e-6)
    assert fine_edge(cube, STEEL, limit, None) >= fine_edge(cube, STEEL, limit, 40)


def test_a_thin_plate_is_cut_by_the_waves_that_bend_it_in_the_modes_asked_for() -> None:
    """As the square root of wall and wave: an element misses shear, its edge squared over both."""
    of = {wall: brick((0.1, 0.08, wall)) for wall in (0.003, 0.004)}
    edge = {wall: fine_edge(plate, STEEL, UNLIMITED, 6) for wall, plate in of.items()}
    areas = {wall: plate.face_areas.sum() for wall, plate in of.items()}
    thinner = 0.75**0.5 * (areas[0.003] / areas[0.004]) ** 0.25
    assert edge[0.003] / edge[0.004] == pytest.approx(thinner, rel=1e-3)
    half = fine_edge(of[0.004], STEEL, UNLIMITED, 2) / edge[0.004]
    assert half == pytest.approx(2.0**0.25, rel=1e-3), "4 and 8 modes, two of them to spare"
    assert fine_edge(of[0.004], STEEL, 1e3, 6) == pytest.approx(edge[0.004], rel=1e-3)


def test_modes_of_a_thin_plate_are_within_a_thousandth_of_ritz_with_rims_cut(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """On even cells of the edge asked for; those that fill a surface need not be even."""
    sides = (0.05, 0.04, 0.003)

    def evenly(mesh: Mesh, edge: float, store: Store | None) -> tuple[Tetrahedra, bool]:
        counts = [int(np.ceil(side / edge)) for side in sides]
        return box(sides, (counts[0], counts[1], 2)), False

    monkeypatch.setattr(element_edge, "filled", evenly)
    plate = brick(sides)
    inside, edge, _ = finely_filled(plate, STEEL, UNLIMITED, 3, None)
    assert edge > 0.4 * sides[2]
    assert len(inside.cells) > len(evenly(plate, edge, None)[0].cells)
    solved = solve_mesh(curved(inside, plate, inside), STEEL, np.inf, least=3)
    exact = ritz_frequencies(sides, STEEL, 18)[:3]
    assert np.abs(solved.modes.frequencies[:3] / exact - 1.0).max() < 1e-3


def test_a_bar_of_any_length_is_cut_across_its_section() -> None:
    """Its section warps where it twists, however long the waves are."""
    assert fine_edge(brick((0.2, 0.02, 0.01)), STEEL, UNLIMITED, 3) == pytest.approx(3e-3, rel=0.02)


def test_a_filling_whose_edges_stayed_long_is_made_again(monkeypatch: pytest.MonkeyPatch) -> None:
    cube, asked = brick(CUBE), []

    def coarse_at_first(mesh: Mesh, edge: float, stop: float | None = None) -> Tetrahedra:
        asked.append(stop)
        return box(CUBE, (2, 2, 2)) if stop is None else box(CUBE, (6, 6, 6))

    monkeypatch.setattr(filling, "tetrahedralize", coarse_at_first)
    found, _ = filling.filled(cube, 0.012, None)
    assert len(found.cells) == len(box(CUBE, (6, 6, 6)).cells)
    assert asked == [None, 10.0]
    filling.filled(cube, 0.035, None)
    assert asked == [None, 10.0, None]


def test_a_surface_is_filled_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    cube, store = brick(CUBE), Store(tmp_path)
    first, kept = filling.filled(cube, 0.03, store)
    assert not kept

    def never(*_: object, **__: object) -> None:
        raise AssertionError("filled again")

    monkeypatch.setattr(filling, "tetrahedralize", never)
    again, kept = filling.filled(cube, 0.03, store)
    assert kept
    assert (again.nodes == first.nodes).all()
    assert (again.cells == first.cells).all()
    for mesh, edge in ((cube, 0.029), (brick((0.06, 0.06, 0.05)), 0.03)):
        with pytest.raises(AssertionError, match="again"):
            filling.filled(mesh, edge, store)
