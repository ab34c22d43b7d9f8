"""Edges of elements from what is asked for, and fillings that are made once."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from harness.basics.arrays import FloatArray
from harness.basics.materials import MATERIALS
from harness.basics.mesh import Mesh
from harness.basics.store import Store
from harness.objects.builtin import build
from harness.sim.modal import element_edge
from harness.sim.modal.element_edge import FINE_SHARE, fine_edge, finely_filled, weyl_frequency
from harness.sim.modal.modal import curved
from harness.sim.modal.solve import solve_mesh
from harness.sim.solid import filled as filling
from harness.sim.solid.tetrahedra import Tetrahedra
from harness.sim.solid.walls import thin_wall
from tests.oracles.ritz_box import ritz_frequencies
from tests.oracles.volume_meshes import box

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


@pytest.mark.slow  # a plate meets the same standard in quick tests
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


@pytest.mark.slow  # all modes of the same plate up to a frequency stay
def test_modes_of_a_thin_plate_are_within_a_thousandth_of_ritz_with_rims_cut(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """On even cells of the edge asked for; those that fill a surface need not be even."""
    sides = (0.05, 0.04, 0.003)

    def evenly(
        mesh: Mesh, edge: float, store: Store | None, envelope: float | None = None
    ) -> tuple[Tetrahedra, bool]:
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


@pytest.mark.parametrize(
    ("sides", "count"),
    [
        ((0.05, 0.04, 0.003), 4),
        pytest.param((0.06, 0.015, 0.001), 3, marks=pytest.mark.slow),  # the thinner, the more unknowns
        pytest.param((0.03, 0.02, 0.0005), 3, marks=pytest.mark.slow),
    ],
    ids=["4 to 3", "4 to 1", "half a millimetre"],
)
def test_all_modes_of_a_thin_plate_up_to_a_frequency_are_within_a_thousandth_of_ritz(
    sides: tuple[float, float, float], count: int
) -> None:
    exact = ritz_frequencies(sides, STEEL, 18)
    limit = 0.5 * float(exact[count - 1] + exact[count])
    plate = brick(sides)
    inside, _, _ = finely_filled(plate, STEEL, limit, None, None)
    solved = solve_mesh(curved(inside, plate, inside), STEEL, limit)
    assert len(solved.modes.frequencies) == count
    assert np.abs(solved.modes.frequencies / exact[:count] - 1.0).max() < 1e-3
    # Cells as fine as these and no finer: half the edge would be eight times as many. fTetWild fills
    # otherwise every time: ten fillings of the second plate had 133 to 146 thousand unknowns, another 162.
    assert solved.unknowns < 200_000


def test_a_flat_wall_is_cut_by_the_wave_that_bends_it_at_the_limit() -> None:
    """The wave is as the root of wall over frequency, the edge as that of wall times wave."""
    of = {wall: fine_edge(brick((0.05, 0.04, wall)), STEEL, 18e3, None) for wall in (0.0018, 0.002)}
    assert of[0.002] / of[0.0018] == pytest.approx((0.002 / 0.0018) ** 0.75, rel=1e-3)
    plate = brick((0.05, 0.04, 0.002))
    assert of[0.002] / fine_edge(plate, STEEL, 12e3, None) == pytest.approx((12.0 / 18.0) ** 0.25, rel=1e-3)


def test_a_narrow_strip_is_cut_for_its_twist_however_long_its_waves_are() -> None:
    """Below a wave twice as long as it is wide, no limit lets its edges grow."""
    edges = [fine_edge(brick((0.4, 0.015, 0.001)), STEEL, limit, None) for limit in (1e3, 3e3)]
    assert edges[0] == pytest.approx(edges[1], rel=1e-12)
    assert fine_edge(brick((0.4, 0.03, 0.001)), STEEL, 1e3, None) / edges[0] == pytest.approx(
        2**0.5, rel=0.02
    )


def test_a_flat_wall_too_thin_and_wide_for_that_is_cut_as_far_as_unknowns_allow() -> None:
    wide = brick((0.4, 0.3, 0.001))
    edge = fine_edge(wide, STEEL, 2e4, None)
    assert edge == pytest.approx(fine_edge(wide, STEEL, 1e4, None))
    assert edge > 2.0 * fine_edge(brick((0.04, 0.03, 0.001)), STEEL, 2e4, None)


def test_a_curved_wall_is_cut_no_shorter_for_bending_up_to_a_frequency() -> None:
    """Filling makes twice as many unknowns of it, in ten times the time."""
    mug = build("mug")
    edges = [fine_edge(mug, MATERIALS["ceramic"], limit, None) for limit in (8e3, 20e3)]
    assert edges[0] == edges[1] > 1.2 * thin_wall(mug, 0.5)


def test_a_compact_body_is_cut_by_the_wave_of_shear_at_the_limit() -> None:
    limit = 1.3 * weyl_frequency(brick(CUBE), STEEL, 40, float(np.prod(CUBE)))
    assert fine_edge(brick(CUBE), STEEL, limit, None) == pytest.approx(FINE_SHARE * shear_wave(limit))


def test_a_bar_of_any_length_is_cut_across_its_section() -> None:
    """Its section warps where it twists, however long the waves are."""
    assert fine_edge(brick((0.2, 0.02, 0.01)), STEEL, UNLIMITED, 3) == pytest.approx(3e-3, rel=0.02)


def test_a_filling_whose_edges_stayed_long_is_made_again(monkeypatch: pytest.MonkeyPatch) -> None:
    cube, asked = brick(CUBE), []

    def coarse_at_first(mesh: Mesh, edge: float, envelope: None, stop: float | None = None) -> Tetrahedra:
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
    for mesh, edge, envelope in (
        (cube, 0.029, None),
        (brick((0.06, 0.06, 0.05)), 0.03, None),
        (cube, 0.03, 1e-5),
    ):
        with pytest.raises(AssertionError, match="again"):
            filling.filled(mesh, edge, store, envelope)
