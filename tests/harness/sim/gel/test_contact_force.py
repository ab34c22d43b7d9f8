"""Forces of presses: closed forms, laws, and what is said of their error."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.signal import fftconvolve

from harness.basics.arrays import FloatArray
from harness.sim.gel.contact_force import PARTS, SETTLED, ForceLevel, contact_force, contact_pressure
from harness.sim.gel.elastic import GelElastic, influence
from tests.oracles.layer_oracle import ball_force, flat_force
from tests.samples.pressed_shapes import paraboloid, punch

GEL = GelElastic(0.3e6, 0.1, 0.485)
SOFT = GelElastic(1e6, 0.1, 0.5)
RADIUS, DEPTH = 5e-3, 0.4e-3
WINDOW = 4.8e-3
OFFSETS = np.random.default_rng(0).uniform(-0.5, 0.5, (12, 2))
"""Of a pixel: what a force is off by depends on where the pixels lie."""


def newtons(depth: FloatArray, pitch: float, thickness: float, gel: GelElastic = GEL) -> float:
    return float(contact_force(depth[None], pitch, thickness, gel).newtons[0])


def test_a_ball_on_a_half_space_is_hertz_s() -> None:
    """Johnson, 1985, equations 4.22 to 4.24: force, size of the contact and largest pressure."""
    pitch = WINDOW / 192
    found = contact_force(paraboloid(RADIUS, DEPTH, pitch, 192)[None], pitch, np.inf, GEL)
    assert found.newtons[0] == pytest.approx(4 / 3 * GEL.plane * RADIUS**0.5 * DEPTH**1.5, rel=1e-4)
    area = np.count_nonzero(found.pressure) * pitch**2
    assert area == pytest.approx(np.pi * RADIUS * DEPTH, rel=0.01)
    most = 2.0 * GEL.plane / np.pi * np.sqrt(DEPTH / RADIUS)
    assert found.pressure.max() == pytest.approx(most, rel=1e-3)


@pytest.mark.parametrize("thickness", [np.inf, 2.5e-3])
def test_halving_the_pixels_quarters_the_error_of_a_ball(thickness: float) -> None:
    """Down to a tenth of a thousand, where the search ends."""
    if np.isinf(thickness):
        wanted = 4 / 3 * SOFT.plane * RADIUS**0.5 * DEPTH**1.5
    else:
        wanted = SOFT.plane * ball_force(RADIUS, DEPTH, thickness, 0.5)
    rms = []
    for size in (12, 24, 48):
        pitch = WINDOW / size
        shapes = [paraboloid(RADIUS, DEPTH, pitch, size, tuple(at * pitch)) for at in OFFSETS]
        found = contact_force(np.array(shapes), pitch, thickness, SOFT)
        error = np.abs(found.newtons / wanted - 1.0)
        assert error.mean() < found.shares[:, PARTS.index("squares")].mean()
        rms.append(np.sqrt(np.mean(error**2)))
    assert rms[0] < 0.01
    assert np.log2(rms[0] / rms[2]) / 2.0 == pytest.approx(2.0, abs=0.2)


@pytest.mark.parametrize("thickness", [np.inf, 2.5e-3])
def test_halving_the_pixels_halves_the_error_of_a_flat_face(thickness: float) -> None:
    """Its pressure has no end at the rim, and pixels cut that."""
    if np.isinf(thickness):
        wanted = 2.0 * SOFT.plane * 1e-3 * 1e-4
    else:
        wanted = SOFT.plane * flat_force(1e-3, 1e-4, thickness, 0.5)
    rms = []
    for size in (24, 48, 96):
        pitch = 2.4e-3 / size
        shapes = [punch(1e-3, 1e-4, pitch, size, tuple(at * pitch)) for at in OFFSETS[:6]]
        found = contact_force(np.array(shapes), pitch, thickness, SOFT)
        error = np.abs(found.newtons / wanted - 1.0)
        assert (error < found.shares[:, PARTS.index("squares")]).all()
        rms.append(np.sqrt(np.mean(error**2)))
    assert rms[0] < 0.025
    assert np.log2(rms[0] / rms[2]) / 2.0 == pytest.approx(1.0, abs=0.2)


def test_flat_faces_are_as_stiff_as_was_tabulated() -> None:
    """Hayes et al., 1972: 1.281 at a fifth of the thickness to 3.6 at a whole one; the oracle's own check."""
    stiff = [flat_force(a, 1.0, 1.0, 0.5) / (2.0 * a) for a in (0.2, 0.4, 0.6)]
    assert stiff == pytest.approx([1.281, 1.683, 2.211], abs=0.003)


def test_a_ball_on_a_thin_incompressible_layer_is_garcia_and_garcia_s_series() -> None:
    """Garcia and Garcia, Biophysical Journal 114, 2018; its next term is some x^5."""
    x = np.sqrt(RADIUS * 0.1e-3) / 2.5e-3
    series = 1.0 + 1.133 * x + 1.497 * x**2 + 1.469 * x**3 + 0.755 * x**4
    hertz = 4 / 3 * SOFT.plane * RADIUS**0.5 * 0.1e-3**1.5
    pitch = 1.8e-3 / 96
    found = newtons(paraboloid(RADIUS, 0.1e-3, pitch, 96), pitch, 2.5e-3, SOFT)
    assert found == pytest.approx(series * hertz, rel=x**5)


@pytest.mark.parametrize("poisson", [0.3, 0.45, 0.485])
@pytest.mark.parametrize("thickness", [20e-3, 5e-3, 2.5e-3])
def test_a_ball_on_any_layer_is_what_a_line_of_integrals_says(poisson: float, thickness: float) -> None:
    gel = GelElastic(1e6, 0.1, poisson)
    pitch = WINDOW / 96
    found = newtons(paraboloid(RADIUS, DEPTH, pitch, 96), pitch, thickness, gel)
    assert found == pytest.approx(gel.plane * ball_force(RADIUS, DEPTH, thickness, poisson), rel=2e-4)


def test_a_thin_gel_that_keeps_its_volume_meets_the_object_beyond_the_map() -> None:
    """It bulges up beside a ball wider than it is thick; what a map of depths does not hold is missed."""
    pitch = WINDOW / 96
    for poisson, missed in ((0.3, 0.0), (0.485, 0.009), (0.5, 0.026)):
        gel = GelElastic(1e6, 0.1, poisson)
        found = newtons(paraboloid(RADIUS, 0.5e-3, pitch, 96), pitch, 1e-3, gel)
        wanted = gel.plane * ball_force(RADIUS, 0.5e-3, 1e-3, poisson)
        assert found / wanted == pytest.approx(1.0 - missed, abs=1e-3)


@pytest.mark.parametrize("level", ["layer", "winkler"])
@settings(deadline=None, max_examples=10)
@given(scale=st.floats(0.1, 10.0), depth=st.floats(0.05e-3, 0.4e-3))
def test_forces_go_as_the_modulus_and_the_map(level: ForceLevel, scale: float, depth: float) -> None:
    shape = paraboloid(RADIUS, depth, 0.1e-3, 48)[None]
    stiffer = GelElastic(scale * GEL.young, 0.1, GEL.poisson)
    one = contact_force(shape, 0.1e-3, 2.5e-3, GEL, level)
    other = contact_force(shape, 0.1e-3, 2.5e-3, stiffer, level)
    assert other.newtons == pytest.approx(scale * one.newtons, rel=1e-9)
    # The same contact, twice as large in every way: pressures stay.
    larger = contact_force(2.0 * shape, 0.2e-3, 5e-3, GEL, level)
    assert larger.newtons == pytest.approx(4.0 * one.newtons, rel=1e-9)
    # The contact itself scaled in depth alone is linear: the same pixels press.
    deeper = contact_force(1.5 * shape, 0.1e-3, 2.5e-3, GEL, level)
    assert deeper.newtons == pytest.approx(1.5 * one.newtons, rel=10 * SETTLED)


def test_a_ball_s_force_grows_with_the_power_of_three_halves_of_its_depth() -> None:
    """Of its depth with the ball as it is, on a half-space; faster on a layer."""
    pitch = WINDOW / 128
    shapes = [paraboloid(RADIUS, depth, pitch, 128) for depth in (0.1e-3, 0.4e-3)]
    half = [newtons(shape, pitch, np.inf) for shape in shapes]
    thin = [newtons(shape, pitch, 1.5e-3) for shape in shapes]
    assert np.log(half[1] / half[0]) / np.log(4.0) == pytest.approx(1.5, abs=2e-3)
    assert np.log(thin[1] / thin[0]) / np.log(4.0) > 1.8


@pytest.mark.parametrize("level", ["layer", "winkler"])
def test_turning_and_mirroring_the_map_turn_the_pressure(level: ForceLevel) -> None:
    shape = paraboloid(RADIUS, DEPTH, 0.1e-3, 64, (0.7e-3, -0.3e-3))
    shape[:, 40:] = 0.0
    one = contact_force(shape[None], 0.1e-3, 2.5e-3, GEL, level)
    for turned in (np.rot90, np.fliplr, np.flipud, np.transpose):
        other = contact_force(turned(shape)[None].copy(), 0.1e-3, 2.5e-3, GEL, level)
        # Rounding may add or spare a turn of the search, which ends within SETTLED.
        assert other.newtons == pytest.approx(one.newtons, rel=10 * SETTLED)
        most = 1e-2 * one.pressure.max()
        assert other.pressure[0] == pytest.approx(turned(one.pressure[0]), abs=most)


def test_contacts_far_apart_add_up_and_near_ones_help_each_other() -> None:
    """The gel that one contact pushes down need not be pushed by the other."""
    pitch, size = 0.1e-3, 320
    left, right = (paraboloid(2e-3, 0.1e-3, pitch, size, (x, 0.0)) for x in (-14e-3, 14e-3))
    alone = newtons(left, pitch, 2.5e-3)
    assert newtons(left + right, pitch, 2.5e-3) == pytest.approx(2.0 * alone, rel=3 * SETTLED)
    beside = paraboloid(2e-3, 0.1e-3, pitch, size, (-12.7e-3, 0.0))
    assert newtons(left + beside, pitch, 2.5e-3) < 1.95 * alone


def test_the_surface_that_a_press_leaves_asks_for_the_same_force() -> None:
    """A gel seen by its camera is pressed as the object was that is no longer known."""
    pitch, size = 0.1e-3, 96
    shape = paraboloid(RADIUS, DEPTH, pitch, size)
    pressed = contact_force(shape[None], pitch, 2.5e-3, GEL)
    quarter = influence(size, size, pitch, 2.5e-3, GEL)
    rows = np.concatenate([quarter[:0:-1], quarter])
    whole = np.concatenate([rows[:, :0:-1], rows], axis=1)
    surface = fftconvolve(pressed.pressure[0], whole)[size - 1 : 2 * size - 1, size - 1 : 2 * size - 1]
    assert surface.max() == pytest.approx(shape.max(), rel=1e-3)
    again = contact_force(np.maximum(surface, 0.0)[None], pitch, 2.5e-3, GEL)
    assert again.newtons == pytest.approx(pressed.newtons, rel=10 * SETTLED)


def test_under_a_pressure_the_gel_is_where_the_object_is_and_nothing_pulls() -> None:
    rough = np.random.default_rng(3).normal(0.0, 0.1e-3, (40, 50))
    depth = np.maximum(rough, 0.0)
    found = contact_pressure(depth, 0.1e-3, 2.5e-3, GEL)
    assert found.left <= SETTLED
    assert (found.pascals >= 0.0).all()
    assert not found.pascals[depth == 0.0].any()
    assert 0.2 < np.count_nonzero(found.pascals) / np.count_nonzero(depth) < 1.0


def test_single_precision_changes_a_force_by_its_own_rounding() -> None:
    shape = paraboloid(RADIUS, DEPTH, 0.1e-3, 64)
    single = contact_force(shape.astype(np.float32)[None], 0.1e-3, 2.5e-3, GEL)  # type: ignore[arg-type]
    assert single.newtons[0] == pytest.approx(newtons(shape, 0.1e-3, 2.5e-3), rel=1e-5)
    assert single.newtons.dtype == np.float64


@pytest.mark.parametrize("cells", [2, 4])
def test_coarser_squares_are_off_by_what_they_say(cells: int) -> None:
    pitch = WINDOW / 96
    shape = paraboloid(RADIUS, DEPTH, pitch, 96, (0.21e-3, 0.13e-3))
    fine = newtons(shape, pitch, 2.5e-3)
    found = contact_force(shape[None], pitch, 2.5e-3, GEL, "layer", cells)
    stated = found.shares[0, PARTS.index("squares")]
    assert abs(found.newtons[0] / fine - 1.0) < 2.0 * stated < 0.2


def test_the_uncertainty_is_its_parts_in_quadrature_and_each_part_is_a_derivative() -> None:
    shape = paraboloid(RADIUS, DEPTH, 0.05e-3, 96)
    found = contact_force(shape[None], 0.05e-3, 2.5e-3, GEL)
    assert found.uncertainty == pytest.approx(found.newtons * np.sqrt((found.shares[0] ** 2).sum()))
    parts = dict(zip(PARTS, found.shares[0], strict=True))
    assert parts["modulus"] == GEL.young_share
    low, high = (
        newtons(shape, 0.05e-3, 2.5e-3, GelElastic(GEL.young, 0.1, poisson)) for poisson in (0.475, 0.495)
    )
    assert parts["poisson"] == pytest.approx((high - low) / (2.0 * found.newtons[0]), rel=0.15)
    thin, thick = (newtons(shape, 0.05e-3, 2.5e-3 * by) for by in (np.exp(-0.1), np.exp(0.1)))
    assert parts["thickness"] == pytest.approx((thin - thick) / (2.0 * found.newtons[0]), rel=0.15)


def test_the_springs_are_within_what_they_say_of_balls_and_flat_faces() -> None:
    for radius in (0.5e-3, 1e-3, 2e-3, 4e-3):
        pitch = 2.4 * radius / 96
        flat = punch(radius, 0.1e-3, pitch, 96)[None]
        round_ = paraboloid(10.0 * radius, radius / 20.0, pitch, 96)[None]
        for shape in (flat, round_):
            springs, layer = (
                contact_force(shape, pitch, 2.5e-3, GEL, level) for level in ("winkler", "layer")
            )
            assert springs.newtons / layer.newtons == pytest.approx(1.0, abs=0.13)
