"""How stiff a gel is, how well that is known, and who says so.

Published figures of such gels, and what they rest on:

- GelSight Mini: shear modulus 0.145 MPa, Young's 0.435 MPa, fitted to four forces that a ball of 15 mm
  in diameter was pressed with, 0.5 to 2 mm deep (Helmut et al., Learning Force Distribution Estimation for
  the GelSight Mini, arXiv 2411.03315; github.com/feats-ai/feats, src/calculix/src, where the folder
  hyperelasticity_identification has the forces and the fit).
- Gel of a GelSight Wedge (silicone XP-565): 0.15 MPa and a Poisson's ratio of 0.485, from its Shore hardness
  (github.com/GelSight-lab/EstimateModulus, tactile_estimate.py).

No modulus of the R1.5's gel, nor of Taxim's, was found: these two are a factor of 2.9 apart, and the one
taken where nobody measured is their geometric mean.
"""

import math
from dataclasses import dataclass

from harness.basics.errors import WrongUse


@dataclass(frozen=True)
class GelElastic:
    """An isotropic elastic gel that sticks to a rigid plate.

    Attributes:
        young: Pa, Young's modulus.
        young_share: one standard deviation of it, as a share.
        poisson: Poisson's ratio, 0 to 0.5; a half is a gel that keeps its volume.
        poisson_sigma: one standard deviation of it.
        thickness_share: one standard deviation of the gel's thickness, as a share.
        source: of the modulus.
    """

    young: float
    young_share: float
    poisson: float = 0.485
    poisson_sigma: float = 0.01
    thickness_share: float = 0.1
    source: str = "given"

    def __post_init__(self) -> None:
        if not 0.0 < self.young < math.inf:
            raise WrongUse(
                f"a modulus of {self.young:g} Pa is no gel's; give Young's modulus above zero, such as 0.2MPa"
            )
        if not 0.0 <= self.poisson <= 0.5:
            raise WrongUse(
                f"a Poisson's ratio of {self.poisson:g} is no gel's; it lies from 0 to 0.5, near 0.49"
            )
        for name, share in (
            ("modulus", self.young_share),
            ("Poisson's ratio", self.poisson_sigma),
            ("thickness", self.thickness_share),
        ):
            if not 0.0 <= share < math.inf:
                raise WrongUse(f"an uncertainty of {share:g} of the {name} cannot be; give 0 or more")

    @property
    def plane(self) -> float:
        """Pa, the plane strain modulus E / (1 - nu^2)."""
        return self.young / (1.0 - self.poisson**2)


NOT_MEASURED = GelElastic(
    young=0.255e6,
    young_share=0.53,
    source="not measured: between the published 0.15 MPa (XP-565, by its hardness) and 0.435 MPa (GelSight "
    "Mini, by forces)",
)
"""Geometric mean of the two published moduli; half the logarithm of their ratio as its deviation."""
