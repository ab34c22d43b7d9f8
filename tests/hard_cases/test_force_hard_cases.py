"""Presses whose force is hard: nothing, one pixel, everything, the border, the plate, and no numbers."""

import numpy as np
import pytest

from harness.basics.arrays import FloatArray
from harness.basics.errors import OutOfDomain
from harness.sim.gel.contact_force import PARTS, SETTLED, ForceLevel, contact_force, contact_pressure
from harness.sim.gel.elastic import GelElastic
from tests.samples.pressed_shapes import paraboloid, punch

GEL = GelElastic(0.3e6, 0.1)
PITCH, THICK = 0.1e-3, 2.5e-3
LEVELS: list[ForceLevel] = ["layer", "winkler"]


@pytest.mark.parametrize("level", LEVELS)
@pytest.mark.parametrize("cells", [1, 2, 4])
def test_no_contact_is_exactly_no_force(level: ForceLevel, cells: int) -> None:
    found = contact_force(np.zeros((2, 30, 41)), PITCH, THICK, GEL, level, cells)
    assert (found.newtons == 0.0).all()
    assert (found.uncertainty == 0.0).all()
    assert not found.pressure.any()
    assert not found.lower_bound.any()
    assert np.isnan(found.centre).all()
    assert not np.isnan(found.shares).any()


@pytest.mark.parametrize("level", LEVELS)
def test_a_single_pixel_presses_and_says_how_little_it_knows(level: ForceLevel) -> None:
    """Half of its force is its pixel's size: a needle finer than a pixel."""
    depth = np.zeros((1, 31, 41))
    depth[0, 7, 30] = 0.2e-3
    found = contact_force(depth, PITCH, THICK, GEL, level)
    assert 0.0 < found.newtons[0] < 0.1
    assert found.shares[0, PARTS.index("squares")] > 0.3
    assert found.centre[0] == pytest.approx([(30.5 - 20.5) * PITCH, (7.5 - 15.5) * PITCH])
    assert found.beyond_checked[0]


@pytest.mark.parametrize("level", LEVELS)
@pytest.mark.parametrize("shape", [(1, 60), (60, 1), (1, 1), (2, 3)])
def test_a_picture_of_a_row_or_a_pixel_is_a_picture(level: ForceLevel, shape: tuple[int, int]) -> None:
    found = contact_force(np.full((1, *shape), 0.1e-3), PITCH, THICK, GEL, level)
    assert found.newtons[0] > 0.0
    assert found.lower_bound[0]
    assert np.isfinite(found.uncertainty).all()


@pytest.mark.parametrize("level", LEVELS)
def test_a_contact_that_the_border_cuts_is_a_lower_bound_and_says_so(level: ForceLevel) -> None:
    whole = paraboloid(5e-3, 0.4e-3, PITCH, 96)
    seen = np.ascontiguousarray(whole[:, 40:])
    cut = contact_force(seen[None], PITCH, THICK, GEL, level)
    entire = contact_force(whole[None], PITCH, THICK, GEL, level)
    assert cut.lower_bound[0]
    assert not entire.lower_bound[0]
    assert cut.newtons[0] < entire.newtons[0]
    # Squares that do not fill the picture lose no pixel of it.
    odd = contact_force(seen[:95][None], PITCH, THICK, GEL, "layer", 4)
    fine = contact_force(seen[:95][None], PITCH, THICK, GEL, "layer", 1)
    assert odd.newtons == pytest.approx(fine.newtons, rel=0.1)


@pytest.mark.parametrize("level", LEVELS)
def test_a_face_over_the_whole_window_is_finite_up_to_a_gel_that_keeps_its_volume(level: ForceLevel) -> None:
    forces = []
    for poisson in (0.4, 0.49, 0.4999, 0.5):
        gel = GelElastic(0.3e6, 0.1, poisson)
        found = contact_force(np.full((1, 60, 80), 0.2e-3), PITCH, THICK, gel, level)
        assert np.isfinite(found.newtons).all()
        assert np.isfinite(found.uncertainty).all()
        forces.append(found.newtons[0])
    assert (np.diff(forces) > 0.0).all()
    assert forces[-1] == pytest.approx(forces[-2], rel=5e-3)


@pytest.mark.parametrize("poisson", [0.0, 0.5])
def test_at_the_ends_of_poisson_s_ratio_its_uncertainty_is_one_sided(poisson: float) -> None:
    gel = GelElastic(0.3e6, 0.1, poisson, 0.02)
    found = contact_force(punch(1e-3, 0.1e-3, PITCH, 40)[None], PITCH, THICK, gel)
    assert 0.0 < found.shares[0, PARTS.index("poisson")] < 0.1
    known = GelElastic(0.3e6, 0.1, poisson, 0.0, 0.0)
    found = contact_force(punch(1e-3, 0.1e-3, PITCH, 40)[None], PITCH, THICK, known)
    assert found.shares[0, 1:3].tolist() == [0.0, 0.0]


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf, -1e-6])
def test_a_depth_that_is_no_number_is_refused(bad: float) -> None:
    depth = np.zeros((1, 20, 20))
    depth[0, 10, 10] = bad
    with pytest.raises(OutOfDomain, match="negative"):
        contact_force(depth, PITCH, THICK, GEL)


def test_a_press_down_to_the_plate_is_refused_and_one_just_above_is_flagged() -> None:
    with pytest.raises(OutOfDomain, match=r"2\.51 mm.*2\.5 mm"):
        contact_force(punch(1e-3, 2.51e-3, PITCH, 40)[None], PITCH, THICK, GEL)
    found = contact_force(punch(1e-3, 2.5e-3, PITCH, 40)[None], PITCH, THICK, GEL)
    assert found.depth_share[0] == 1.0
    assert found.beyond_checked[0]


@pytest.mark.parametrize("shape", [(20, 20), (1, 0, 20), (1, 1, 20, 20)])
def test_another_shape_is_refused(shape: tuple[int, ...]) -> None:
    with pytest.raises(OutOfDomain, match=r"\(n, rows, columns\)"):
        contact_force(np.zeros(shape), PITCH, THICK, GEL)


def test_no_press_at_all_is_no_force_of_none() -> None:
    found = contact_force(np.zeros((0, 20, 30)), PITCH, THICK, GEL)
    assert found.newtons.shape == (0,)
    assert found.shares.shape == (0, len(PARTS))
    assert found.pressure.shape == (0, 20, 30)
    assert found.centre.shape == (0, 2)


def test_a_checkerboard_and_a_comb_settle() -> None:
    """Contacts of one pixel each, as close as may be, and lines of them."""
    board: FloatArray = np.indices((40, 40)).sum(axis=0) % 2 * 0.1e-3
    comb = np.zeros((40, 40))
    comb[::4] = 0.1e-3
    found = contact_force(np.array([board, comb]), PITCH, THICK, GEL)
    face = contact_force(np.full((1, 40, 40), 0.1e-3), PITCH, THICK, GEL)
    assert (found.newtons < face.newtons).all()
    assert (found.newtons > 0.5 * face.newtons).all()


@pytest.mark.parametrize("poisson", [0.3, 0.485, 0.5])
@pytest.mark.parametrize("thickness", [0.5e-3, 2.5e-3])
def test_rough_and_tilted_faces_over_the_whole_window_settle(poisson: float, thickness: float) -> None:
    """Contacts of every size at once, on a gel much thinner than they are wide, and on a thick one."""
    rough = np.random.default_rng(1).normal(0.0, 0.1e-3, (2, 60, 80))
    rough[1] = np.linspace(-0.2e-3, 0.4e-3, 80)
    gel = GelElastic(0.3e6, 0.1, poisson)
    for depth in np.clip(rough, 0.0, 0.4e-3):
        found = contact_pressure(depth, PITCH, thickness, gel)
        assert found.left <= SETTLED
        assert found.turns < 100


def test_pressures_that_do_not_settle_are_no_force(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("harness.sim.gel.contact_force._MOST_TURNS", 1)
    with pytest.raises(OutOfDomain, match=r"\b1 turns.*touch\.force=winkler"):
        contact_force(paraboloid(5e-3, 0.4e-3, PITCH, 64)[None], PITCH, THICK, GEL)


def test_depths_over_nine_decades_press_in_proportion() -> None:
    shape = paraboloid(5e-3, 0.4e-3, PITCH, 64)
    one = contact_force(shape[None], PITCH, THICK, GEL).newtons[0]
    for scale in (1e-9, 1e-3, 1.0):
        found = contact_force(scale * shape[None], PITCH, THICK, GEL).newtons[0]
        assert found == pytest.approx(scale * one, rel=1e-4)
