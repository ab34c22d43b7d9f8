"""Forces on a real gel: four that were published, and the only ones that were found.

A GelSight Mini was pressed by a steel ball of 15 mm in diameter, and the force read (Helmut et al., arXiv
2411.03315; their program ``bayesian-optimization.py`` has depths and forces, its mesh the gel: 4 mm thick, a
dome 0.18 mm lower 9 mm from its top; github.com/feats-ai/feats at f15e158, MIT). They fitted a finite element
model of a neo-Hookean gel that sticks to the ball, and found a shear modulus of 0.145 MPa.
"""

import numpy as np
import pytest
from pressed_shapes import places

from harness.arrays import FloatArray
from harness.sim.contact_force import CHECKED, THEORY, contact_force
from harness.sim.gel_elastic import GelElastic

DEPTHS = np.array([0.5e-3, 1.0e-3, 1.5e-3, 2.0e-3])
FORCES = np.array([1.6503, 5.9641, 13.5257, 23.2532])
BALL, DOME, THICKNESS = 7.5e-3, (9e-3) ** 2 / (2 * 0.18e-3), 4e-3
FITTED = 3.0 * 0.145e6
PITCH = 0.1e-3


def _pressed() -> FloatArray:
    x, y = places(PITCH, 128, 128)
    away = x * x + y * y
    low = BALL - np.sqrt(np.maximum(BALL**2 - away, 0.0)) + away / (2.0 * DOME)
    return np.maximum(DEPTHS[:, None, None] - low, 0.0)


def _moduli(thickness: float, poisson: float) -> FloatArray:
    """Pa: that each of the forces asks for."""
    one = contact_force(_pressed(), PITCH, thickness, GelElastic(1.0, 0.1, poisson))
    return np.asarray(FORCES / one.newtons)


def test_one_modulus_gives_all_four_forces() -> None:
    """From an eighth of the thickness to half of it, with the Poisson's ratio that is assumed of gels."""
    moduli = _moduli(THICKNESS, 0.485)
    scatter = moduli.std(ddof=1) / moduli.mean()
    assert scatter <= THEORY["layer"]
    assert THEORY["layer"] == pytest.approx(scatter, abs=0.01)
    # A gel that slips on the ball is a little softer than one that sticks: it asks for more modulus.
    assert moduli.mean() == pytest.approx(1.1 * FITTED, rel=0.05)


def test_hertz_s_half_space_would_ask_for_another_modulus_each() -> None:
    moduli = _moduli(np.inf, 0.485)
    assert moduli[-1] / moduli[0] > 1.5
    assert moduli.mean() > 2.0 * FITTED


def test_the_theory_is_called_checked_as_far_as_these_presses_go() -> None:
    found = contact_force(_pressed(), PITCH, THICKNESS, GelElastic(FITTED, 0.1))
    assert found.depth_share.max() == pytest.approx(CHECKED[0], abs=1e-3)
    assert found.strain.max() == pytest.approx(CHECKED[1], abs=0.02)
    assert not found.beyond_checked.any()
    assert (abs(found.newtons - FORCES) < 2.0 * found.uncertainty).all()
