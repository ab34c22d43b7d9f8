"""Square plates of a solid: held along its sides, which is solved exactly, and along its lower edges.

Sides that may slide outward only, neither up nor along themselves, mirror the plate into an endless one
turned over: its modes are the guided waves of wave numbers ``pi sqrt(m^2 + n^2) / side`` (Rayleigh 1888,
Lamb 1917; the antisymmetric ones bend).
"""

import numpy as np
from scipy.optimize import brentq

from harness.basics.arrays import BoolArray, FloatArray
from harness.basics.materials import Material
from harness.sim.solid.tetrahedra import QuadraticMesh


def guided_plate(side: float, thickness: float, of: Material, waves: int = 2) -> FloatArray:
    """Hz, ascending, of the lowest bending mode of each pair of half waves up to ``waves``."""
    halves = [np.hypot(m, n) for m in range(1, waves + 1) for n in range(1, waves + 1)]
    return np.sort([lowest_bending(np.pi * half / side, thickness, of) for half in halves])


def lowest_bending(number: float, thickness: float, of: Material) -> float:
    """Hz of the lowest antisymmetric wave of a free plate, of a wave number in rad/m.

    ``(q^2 - k^2)^2 cos(qh) sin(ph) / p + 4 k^2 q sin(qh) cos(ph) = 0`` with ``p, q`` across the plate.
    """
    shear = np.sqrt(of.young / (2.0 * (1.0 + of.poisson) * of.density))
    compression = shear * np.sqrt((2.0 - 2.0 * of.poisson) / (1.0 - 2.0 * of.poisson))
    half = 0.5 * thickness

    def secular(omega: float) -> float:
        p, q = (np.sqrt(complex((omega / speed) ** 2 - number**2)) for speed in (compression, shear))
        slow = (q * q - number**2) ** 2 * np.cos(q * half) * np.sinc(p * half / np.pi)
        fast = 4.0 * number**2 * q * q * np.sinc(q * half / np.pi) * np.cos(p * half)
        return float((slow + fast).real)

    thin = number**2 * thickness * np.sqrt(of.young / (12.0 * of.density * (1.0 - of.poisson**2)))
    return float(brentq(secular, 0.3 * thin, 1.001 * thin, xtol=1e-12 * thin)) / (2.0 * np.pi)


def sliding_sides(mesh: QuadraticMesh) -> BoolArray:
    """``(n, 3)``: the upright sides of a plate in the plane z held up and along themselves."""
    held = np.zeros(mesh.nodes.shape, dtype=np.bool_)
    for axis, along in ((0, 1), (1, 0)):
        place = mesh.nodes[:, axis]
        side = (place == place.min()) | (place == place.max())
        held[side, along] = held[side, 2] = True
    return held


def on_lower_edges(mesh: QuadraticMesh) -> BoolArray:
    """``(n, 3)``: the four lower edges held up, and nothing else."""
    low, high = mesh.nodes.min(axis=0), mesh.nodes.max(axis=0)
    rim = ((mesh.nodes == low) | (mesh.nodes == high))[:, :2].any(axis=1) & (mesh.nodes[:, 2] == low[2])
    held = np.zeros(mesh.nodes.shape, dtype=np.bool_)
    held[rim, 2] = True
    return held
