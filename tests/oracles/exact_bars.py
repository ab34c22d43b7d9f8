"""A free bar by the formulas of ASTM E1876-15, impulse excitation of vibration, solved for the frequency.

Both were fitted to calculations of bars: torsion is up to 1e-3 above the exact value of bars of 1 to 3
times their thickness in width and 10 to 40 in length (by ``ritz_box``; 6e-4 at 200 x 20 x 10 mm).
"""

import numpy as np

from harness.basics.materials import Material


def astm_bending(length: float, width: float, thickness: float, mass: float, of: Material) -> float:
    """Hz of the first bending across the thickness (equations 1 and 2)."""
    ratio, nu = thickness / length, of.poisson
    correction = (
        1.0 + 6.585 * (1.0 + 0.0752 * nu + 0.8109 * nu**2) * ratio**2 - 0.868 * ratio**4
        - 8.340 * (1.0 + 0.2023 * nu + 2.173 * nu**2) * ratio**4
        / (1.0 + 6.338 * (1.0 + 0.1408 * nu + 1.536 * nu**2) * ratio**2)
    )  # fmt: skip
    return float(np.sqrt(of.young * width * thickness**3 / (0.9465 * mass * length**3 * correction)))


def astm_torsion(length: float, width: float, thickness: float, mass: float, of: Material) -> float:
    """Hz of the first torsion: ``G = 4 L m f^2 B / (b t (1 + A))``.

    ``B`` is the inertia over the stiffness of the section, ``A`` the part of its warping.
    """
    wide, shear = width / thickness, of.young / (2.0 * (1.0 + of.poisson))
    section = (wide + 1.0 / wide) / (4.0 / wide - 2.52 / wide**2 + 0.21 / wide**6)
    warping = 0.5062 - 0.8776 * wide + 0.3504 * wide**2 - 0.0078 * wide**3
    warping /= 12.03 * wide + 9.892 * wide**2
    return float(np.sqrt(shear * width * thickness * (1.0 + warping) / (4.0 * length * mass * section)))
