"""Frequencies against what is known without a finite element."""

from dataclasses import replace
from math import ceil
from pathlib import Path

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st

from harness.basics.errors import WrongUse
from harness.basics.materials import MATERIALS, Material
from harness.sim.modal.file import modes_of_file
from harness.sim.modal.solve import solve_mesh
from tests.oracles.exact_bars import astm_bending, astm_torsion
from tests.oracles.exact_plate import guided_plate, on_lower_edges, sliding_sides
from tests.oracles.exact_solids import exact_ball, exact_box, octant_shell, on_planes, radial_frequencies
from tests.oracles.ritz_box import ritz_frequencies

STEEL = MATERIALS["steel"]
NAFEMS = Material("", 8000.0, 2e11, 0.3, 0.0, 0.0)
LAMB = {"T2": 2.501133, "S2": 2.639869}
"""Lamb's lowest two roots ``w R / c_s`` at Poisson's ratio 0.25 (Proc. London Math. Soc. 13, 1881)."""


def shear_speed(material: Material) -> float:
    """m/s."""
    return float(np.sqrt(material.young / (2.0 * (1.0 + material.poisson) * material.density)))


@pytest.mark.slow  # a published table, which does not change
def test_the_ritz_method_gives_the_published_cube() -> None:
    """Demarest, J. Acoust. Soc. Am. 49(3), 1971."""
    cube = ritz_frequencies((1.0, 1.0, 1.0), Material("", 1.0, 1.0, 0.3, 0.0, 0.0), 14)
    expected = np.repeat([0.28190221, 0.37961161, 0.3860549], [2, 3, 3])
    assert cube[:8] == pytest.approx(expected, rel=3e-6)


def test_the_ritz_method_and_the_standard_agree_on_a_bar() -> None:
    sides = (0.2, 0.02, 0.01)
    expected = astm_bending(*sides, STEEL.density * float(np.prod(sides)), STEEL)
    assert ritz_frequencies(sides, STEEL, 14, (1, 1, -1))[0] == pytest.approx(expected, rel=5e-4)


@pytest.mark.parametrize(
    "sides", [(0.2, 0.02, 0.01), (0.2, 0.03, 0.01), (0.2, 0.02, 0.02), (0.1, 0.02, 0.01)]
)
def test_the_standard_s_torsion_is_within_a_thousandth_of_the_exact_one(
    sides: tuple[float, float, float],
) -> None:
    """And never by chance: the bar twists slower without the warping that its section needs."""
    weight = STEEL.density * float(np.prod(sides))
    exact = ritz_frequencies(sides, STEEL, 16, (-1, -1, -1))[0]
    assert astm_torsion(*sides, weight, STEEL) == pytest.approx(exact, rel=1e-3)


@settings(max_examples=6, deadline=None)
@given(
    st.floats(0.5, 1.0),
    st.floats(0.3, 1.0),
    st.floats(0.0, 0.45),
    st.tuples(st.sampled_from((1, -1)), st.sampled_from((1, -1)), st.sampled_from((1, -1))),
)
def test_boxes_of_any_sides_ring_as_ritz_says(
    second: float, third: float, poisson: float, symmetry: tuple[int, int, int]
) -> None:
    """The lowest mode of any kind of symmetry, from an eighth of the box; never below the exact one."""
    sides, material = (0.06, 0.06 * second, 0.06 * third), replace(STEEL, poisson=poisson)
    exact = ritz_frequencies(sides, material, 16, symmetry)[0]
    counts = (7, max(4, ceil(7 * second)), max(4, ceil(7 * third)))
    eighth = exact_box((sides[0] / 2.0, sides[1] / 2.0, sides[2] / 2.0), counts)
    found = solve_mesh(eighth, material, 1.02 * exact, held=on_planes(eighth, symmetry))
    assert -1e-6 < found.modes.frequencies[0] / exact - 1.0 < 1e-3


def test_a_whole_box_has_the_modes_of_all_kinds() -> None:
    sides = (0.06, 0.05, 0.045)
    solved = solve_mesh(exact_box(sides, (4, 4, 4)), STEEL, np.inf, least=10)
    assert solved.certified
    excess = solved.modes.frequencies[:10] / ritz_frequencies(sides, STEEL, 13)[:10] - 1.0
    assert excess.min() > 0.0
    assert excess.max() < 1e-2


@pytest.mark.parametrize(
    ("name", "symmetry", "rigid"),
    [("stretch", (1, 1, 1), 0), ("torsion", (-1, -1, -1), 0), ("bending", (1, -1, 1), 1)],
)
def test_the_error_falls_with_the_fourth_power_of_the_element(
    name: str, symmetry: tuple[int, int, int], rigid: int
) -> None:
    """An eighth of a box, held on its planes as the mode named here wants it, refined into itself."""
    sides, material = (0.05, 0.045, 0.04), replace(STEEL, poisson=0.3)
    exact = ritz_frequencies(sides, material, 18, symmetry)[0]
    errors = []
    for count in (4, 8):
        eighth = exact_box((0.025, 0.0225, 0.02), (count, count, count))
        solved = solve_mesh(eighth, material, 1.05 * exact, held=on_planes(eighth, symmetry))
        assert solved.modes.rigid == rigid
        assert solved.certified
        errors.append(solved.modes.frequencies[0] / exact - 1.0)
    assert errors[1] > 0.0
    assert np.log2(errors[0] / errors[1]) == pytest.approx(4.0, abs=0.4)


def test_a_ball_on_its_exact_shape_rings_as_lamb_says() -> None:
    material = replace(STEEL, poisson=0.25)
    unit = shear_speed(material) / (2.0 * np.pi * 0.03)
    expected = unit * np.repeat([LAMB["T2"], LAMB["S2"]], 5)
    solved = solve_mesh(exact_ball(0.03, 3), material, 1.2 * expected[-1])
    assert solved.certified
    assert len(solved.modes.frequencies) == 10
    assert solved.modes.frequencies == pytest.approx(expected, rel=1.5e-3)


def test_a_thick_hollow_sphere_breathes_as_its_closed_form_says() -> None:
    """The sphere of NAFEMS FV42, one eighth of it between its planes of symmetry."""
    expected = radial_frequencies(1.8, 6.0, NAFEMS, 900.0)
    assert expected == pytest.approx([369.91, 838.03], rel=2e-4)
    eighth = octant_shell(1.8, 6.0, 5, 6)
    modes = solve_mesh(eighth, NAFEMS, 400.0, held=on_planes(eighth, (1, 1, 1))).modes
    outer = np.linalg.norm(modes.points, axis=1) > 6.0 - 1e-9
    out = modes.points[outer] / 6.0
    along = np.einsum("nmd,nd->nm", modes.shapes[outer], out)
    radial = along.mean(axis=0) ** 2 > 0.99 * (modes.shapes[outer] ** 2).sum(axis=2).mean(axis=0)
    assert modes.frequencies[radial] == pytest.approx(expected[:1], rel=1e-3)


def test_a_bar_rings_as_the_standard_says() -> None:
    """ASTM E1876: a quarter of it, between the planes about which it bends alike."""
    sides = (0.2, 0.02, 0.01)
    expected = astm_bending(*sides, STEEL.density * float(np.prod(sides)), STEEL)
    quarter = exact_box((0.1, 0.01, 0.01), (12, 2, 2))
    held = on_planes(quarter, (1, 1, 1))
    held[:, 2] = False
    found = solve_mesh(quarter, STEEL, 1.5 * expected, held=held).modes
    assert found.rigid == 1
    assert found.frequencies[0] == pytest.approx(expected, rel=1e-3)


def test_a_bar_twists_as_the_standard_says_once_its_section_may_warp() -> None:
    """ASTM E1876: an eighth. One cell in half of its thickness is not enough, however short it is."""
    sides = (0.2, 0.02, 0.01)
    standard = astm_torsion(*sides, STEEL.density * float(np.prod(sides)), STEEL)
    exact = ritz_frequencies(sides, STEEL, 20, (-1, -1, -1))[0]
    errors = []
    for counts in ((12, 2, 1), (24, 2, 1), (14, 4, 2)):
        eighth = exact_box((0.1, 0.01, 0.005), counts)
        held = on_planes(eighth, (-1, -1, -1))
        found = solve_mesh(eighth, STEEL, 1.1 * exact, held=held).modes.frequencies[0]
        errors.append(found / exact - 1.0)
    assert errors[1] == pytest.approx(errors[0], rel=0.1)
    assert 4e-3 < errors[1] < 1e-2
    assert 0.0 < errors[2] < 1e-3
    assert found == pytest.approx(standard, rel=1e-3)


@pytest.mark.slow  # boxes meet the same standard in quick tests
def test_a_bar_given_by_its_surface_is_meshed_finely_enough_for_the_standard(tmp_path: Path) -> None:
    """Both modes of ASTM E1876, at the element size that is chosen where nobody asks for one."""
    sides = (0.2, 0.02, 0.01)
    file, weight = tmp_path / "bar.stl", STEEL.density * float(np.prod(sides))
    trimesh.creation.box(sides).export(file)
    found = modes_of_file(file, STEEL, "m", limit=6e3).solution
    assert found.certified
    frequencies = found.modes.frequencies
    assert frequencies[0] == pytest.approx(astm_bending(*sides, weight, STEEL), rel=1e-3)
    assert frequencies[3] == pytest.approx(astm_torsion(*sides, weight, STEEL), rel=1e-3)
    assert frequencies[3] == pytest.approx(ritz_frequencies(sides, STEEL, 16, (-1, -1, -1))[0], rel=1e-3)


def test_a_plate_on_its_sides_rings_as_rayleigh_and_lamb_say() -> None:
    """The plate of NAFEMS FV52 on supports that its solid has an exact answer for."""
    exact = guided_plate(10.0, 1.0, NAFEMS)
    errors = []
    for across, layers in ((8, 1), (16, 2)):
        mesh = exact_box((10.0, 10.0, 1.0), (across, across, layers))
        solved = solve_mesh(mesh, NAFEMS, 140.0, held=sliding_sides(mesh))
        assert solved.certified
        assert len(solved.modes.frequencies) == 3
        errors.append(solved.modes.frequencies / exact[:3] - 1.0)
    assert errors[1].min() > 0.0
    assert errors[1] == pytest.approx([0.0, 0.0, 0.0], abs=2.5e-3)
    assert np.log2(errors[0] / errors[1]) == pytest.approx([4.0] * 3, abs=0.6)


def test_lines_hold_a_solid_the_less_the_finer_its_mesh() -> None:
    """NAFEMS FV52, 45.897 Hz, as published: a coarse mesh is nearer to it than a fine one."""
    lowest = []
    for across, layers in ((4, 1), (8, 1), (16, 2)):
        mesh = exact_box((10.0, 10.0, 1.0), (across, across, layers))
        lowest.append(solve_mesh(mesh, NAFEMS, 60.0, held=on_lower_edges(mesh)).modes.frequencies[0])
    assert lowest[0] > lowest[1] > lowest[2]
    assert lowest[1] == pytest.approx(45.897, rel=0.04)
    # What is still lost does not die away with the fourth power, as it does on sides that are held.
    assert lowest[1] - lowest[2] > 0.2 * (lowest[0] - lowest[1])


def test_a_cantilever_bends_as_beams_do() -> None:
    """Euler and Bernoulli: ``(1.875104, 4.694091)^2``; without Poisson's effect the clamp is exact."""
    length, side = 0.4, 0.005
    material = replace(STEEL, poisson=0.0)
    beam = exact_box((length, side, side), (24, 1, 1))
    held = np.repeat(beam.nodes[:, :1] == 0.0, 3, axis=1)
    solved = solve_mesh(beam, material, 600.0, held=held)
    unit = np.sqrt(material.young * side**2 / (12.0 * material.density)) / (2.0 * np.pi * length**2)
    assert solved.modes.rigid == 0
    assert solved.certified
    expected = np.repeat(np.array([1.875104, 4.694091, 7.854757]) ** 2 * unit, 2)
    assert solved.modes.frequencies[:6] == pytest.approx(expected, rel=3e-3)
    assert np.abs(solved.modes.shapes[solved.modes.points[:, 0] == 0.0]).max() == 0.0


def test_the_tapered_membrane_of_nafems() -> None:
    """FV32: 44.623, 130.03, 162.70, 246.05, 379.90, 391.44 Hz in its plane, clamped at the root."""
    unit = exact_box((1.0, 1.0, 1.0), (14, 5, 1))
    nodes = unit.nodes.copy()
    width = 5.0 - 4.0 * unit.nodes[:, 0]
    nodes[:, 0], nodes[:, 1], nodes[:, 2] = (
        10.0 * unit.nodes[:, 0], (unit.nodes[:, 1] - 0.5) * width, 0.05 * (unit.nodes[:, 2] - 0.5)
    )  # fmt: skip
    held = np.zeros(nodes.shape, dtype=np.bool_)
    held[unit.nodes[:, 0] == 0.0, :2] = True
    held[unit.nodes[:, 2] == 0.5, 2] = True
    solved = solve_mesh(replace(unit, nodes=nodes), NAFEMS, 400.0, held=held)
    expected = [44.623, 130.03, 162.70, 246.05, 379.90, 391.44]
    assert solved.modes.frequencies == pytest.approx(expected, rel=5e-3)


def test_supports_that_leave_nothing_or_fit_nothing_are_refused() -> None:
    cube = exact_box((0.1, 0.1, 0.1), (1, 1, 1))
    with pytest.raises(WrongUse, match=r"held.*free"):
        solve_mesh(cube, STEEL, 1e3, held=np.ones(cube.nodes.shape, dtype=np.bool_))
    with pytest.raises(WrongUse, match=r"\(3, 3\)"):
        solve_mesh(cube, STEEL, 1e3, held=np.ones((3, 3), dtype=np.bool_))


def test_as_many_modes_as_were_asked_for_also_within_a_group() -> None:
    """Three of the five equal lowest modes of a ball: all that come with them, and no fewer."""
    ball = exact_ball(0.03, 2)
    solved = solve_mesh(ball, STEEL, np.inf, least=3)
    assert solved.certified
    assert len(solved.modes.frequencies) >= 3
    tiny = exact_box((0.1, 0.1, 0.1), (1, 1, 1))
    every = solve_mesh(tiny, STEEL, np.inf, least=200)
    assert len(every.modes.frequencies) == 3 * len(tiny.nodes) - 6
    assert every.certified
