"""Forces on a real gel: four that were published, and the only ones that were found.

A GelSight Mini was pressed by a steel ball of 15 mm in diameter, and the force read (Helmut et al., arXiv
2411.03315; their program ``bayesian-optimization.py`` has depths and forces, its mesh the gel: 4 mm thick, a
dome 0.18 mm lower 9 mm from its top; github.com/feats-ai/feats at f15e158, MIT). They fitted a finite element
model of a neo-Hookean gel that sticks to the ball, and found a shear modulus of 0.145 MPa.
"""

import numpy as np

from harness.basics.arrays import FloatArray
from harness.sim.gel.contact_force import ContactForce, ForceLevel, contact_force
from harness.sim.gel.elastic import GelElastic
from tests.samples.pressed_shapes import places

DEPTHS = np.array([0.5e-3, 1.0e-3, 1.5e-3, 2.0e-3])
FORCES = np.array([1.6503, 5.9641, 13.5257, 23.2532])
BALL, DOME, THICKNESS = 7.5e-3, (9e-3) ** 2 / (2 * 0.18e-3), 4e-3
FITTED = 3.0 * 0.145e6
"""Pa, Young's modulus of an incompressible gel with their shear modulus."""

_PITCH = 0.1e-3


def pressed() -> FloatArray:
    """``(4, rows, columns)`` metres: how deep the ball reaches into the dome."""
    x, y = places(_PITCH, 128, 128)
    away = x * x + y * y
    low = BALL - np.sqrt(np.maximum(BALL**2 - away, 0.0)) + away / (2.0 * DOME)
    return np.maximum(DEPTHS[:, None, None] - low, 0.0)


def forces_of(gel: GelElastic, thickness: float = THICKNESS, level: ForceLevel = "layer") -> ContactForce:
    """Of the four presses on that gel."""
    return contact_force(pressed(), _PITCH, thickness, gel, level)


def moduli(poisson: float, thickness: float = THICKNESS, level: ForceLevel = "layer") -> FloatArray:
    """``(4,)`` Pa: Young's modulus that each of the forces asks for."""
    return np.asarray(FORCES / forces_of(GelElastic(1.0, 0.1, poisson), thickness, level).newtons)
