"""Forces that were measured on a real gel (``published_force``), and what the theories make of them."""

import numpy as np
import pytest

from harness.sim.gel.contact_force import CHECKED, THEORY
from harness.sim.gel.elastic import GelElastic
from tests.oracles.published_force import FITTED, FORCES, forces_of, moduli


def test_one_modulus_gives_all_four_forces() -> None:
    """From an eighth of the thickness to half of it, with the Poisson's ratio that is assumed of gels."""
    found = moduli(0.485)
    scatter = found.std(ddof=1) / found.mean()
    assert scatter <= THEORY["layer"]
    assert THEORY["layer"] == pytest.approx(scatter, abs=0.01)
    # A gel that slips on the ball is a little softer than one that sticks: it asks for more modulus.
    assert found.mean() == pytest.approx(1.1 * FITTED, rel=0.05)


def test_hertz_s_half_space_would_ask_for_another_modulus_each() -> None:
    found = moduli(0.485, np.inf)
    assert found[-1] / found[0] > 1.5
    assert found.mean() > 2.0 * FITTED


def test_the_theory_is_called_checked_as_far_as_these_presses_go() -> None:
    found = forces_of(GelElastic(FITTED, 0.1))
    assert found.depth_share.max() == pytest.approx(CHECKED[0], abs=1e-3)
    assert found.strain.max() == pytest.approx(CHECKED[1], abs=0.02)
    assert not found.beyond_checked.any()
    assert (abs(found.newtons - FORCES) < 2.0 * found.uncertainty).all()
