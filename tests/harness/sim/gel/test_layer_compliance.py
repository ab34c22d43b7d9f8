"""How an elastic layer gives: its limits, and two derivations of the same kernel."""

import numpy as np
import pytest
from scipy.integrate import dblquad

from harness.basics.arrays import FloatArray
from harness.sim.gel.elastic import GelElastic, disc_stiffness, influence, taken_back
from harness.sim.gel.markers import layer_response

WAVES = np.geomspace(1e-3, 30.0, 200)


def layer_share(waves: FloatArray, poisson: float) -> FloatArray:
    """The share that a layer gives of what a half-space would."""
    return 1.0 + taken_back(waves, poisson)


def test_the_incompressible_layer_is_the_one_that_moves_the_dots() -> None:
    """Stokes' stream function there, Burmister's layer here."""
    assert layer_share(WAVES, 0.5) == pytest.approx(layer_response(WAVES)[0], abs=1e-15)


@pytest.mark.parametrize("poisson", [0.0, 0.3, 0.485, 0.4999])
def test_long_waves_press_a_layer_that_cannot_widen(poisson: float) -> None:
    """Uniform pressure p gives ``p h / M``, M the modulus of a bar that is held at its sides."""
    held = (1.0 - poisson) / ((1.0 + poisson) * (1.0 - 2.0 * poisson))
    share = layer_share(np.array([1e-4]), poisson)[0] / 1e-4
    assert 2.0 * (1.0 - poisson**2) * share == pytest.approx(1.0 / held, rel=2e-4)


@pytest.mark.parametrize("poisson", [0.0, 0.3, 0.5])
def test_short_waves_do_not_feel_the_plate(poisson: float) -> None:
    assert layer_share(np.array([25.0]), poisson)[0] == pytest.approx(1.0, abs=1e-15)
    assert (np.diff(layer_share(WAVES, poisson)) > -1e-15).all()


def test_a_loaded_square_gives_as_love_says() -> None:
    """Johnson, 1985, equation 3.26: in the middle of a square of side s, 4 s asinh(1) p / (pi E*)."""
    gel = GelElastic(1e6, 0.1, 0.4)
    found = influence(4, 5, 1e-3, np.inf, gel)
    assert found[0, 0] == pytest.approx(4e-3 * np.arcsinh(1.0) / (np.pi * gel.plane), rel=1e-14)
    for row, column in ((0, 1), (2, 3)):
        wanted = dblquad(
            lambda y, x, r=row, c=column: 1.0 / np.hypot(c - x, r - y), -0.5, 0.5, -0.5, 0.5, epsabs=1e-12
        )[0]
        assert found[row, column] == pytest.approx(1e-3 * wanted / (np.pi * gel.plane), rel=1e-9)


def test_far_from_a_load_a_layer_lies_still() -> None:
    """What the plate takes back cancels the half-space: a thousandth of it is left ten thicknesses away."""
    gel = GelElastic(1e6, 0.1, 0.485)
    near, endless = (influence(1, 200, 0.2e-3, thickness, gel) for thickness in (2e-3, np.inf))
    assert abs(near[0, 100:] / endless[0, 100:]).max() < 1e-3
    assert influence(1, 200, 0.2e-3, 1e3, gel) == pytest.approx(endless, rel=1e-3)


def test_a_disc_is_a_half_space_s_when_small_and_a_layer_s_when_wide() -> None:
    assert disc_stiffness(0.0, 0.4) == pytest.approx(3.0 * np.pi / 16.0, rel=1e-12)
    assert disc_stiffness(1e-6, 0.4) == pytest.approx(3.0 * np.pi / 16.0, rel=1e-5)
    held = (1.0 - 0.4) / ((1.0 + 0.4) * (1.0 - 0.8)) * (1.0 - 0.4**2)
    wide = [disc_stiffness(radius, 0.4) / (held * radius) for radius in (25.0, 50.0, 100.0)]
    assert wide[-1] == pytest.approx(1.0, abs=0.01)
    assert abs(wide[2] - 1.0) < abs(wide[1] - 1.0) < abs(wide[0] - 1.0)
