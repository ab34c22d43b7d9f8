"""What objects are made of: the seven materials of the paper."""

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import ClassVar

import numpy as np

from harness.basics.errors import WrongUse
from harness.basics.files.named_file import nearest


@dataclass(frozen=True)
class Material:
    """An isotropic elastic solid with Rayleigh damping.

    A mode of angular frequency w decays as exp(-d t) with d = (alpha + beta w^2) / 2.
    """

    key_name: ClassVar[str] = "harness.basics.materials.Material"

    name: str  #: as a scene writes it.
    density: float  #: kg/m^3.
    young: float  #: Pa, Young's modulus.
    poisson: float  #: Poisson's ratio.
    alpha: float  #: 1/s, mass-proportional damping.
    beta: float  #: s, stiffness-proportional damping.

    @property
    def speed(self) -> float:
        """M/s, sqrt(young / density): of sound along a thin bar, and all frequencies of a body go with it."""
        return float(np.sqrt(self.young / self.density))


@dataclass(frozen=True)
class Uncertainty:
    """How far an object may be from its material's constants: deviations (1 sigma) of natural logarithms."""

    density: float  #: 0.05 for five per cent, as all others.
    young: float  #: of Young's modulus.
    poisson: float  #: of Poisson's ratio.
    alpha: float  #: of the mass-proportional damping.
    beta: float  #: of the stiffness-proportional damping.

    @property
    def speed(self) -> float:
        """Of sqrt(young / density), with which all frequencies of an object go."""
        return 0.5 * float(np.hypot(self.young, self.density))


@dataclass(frozen=True)
class KnownMaterial:
    """A material and what its numbers rest on."""

    material: Material  #: its constants.
    source: str  #: of the constants.
    uncertainty: Uncertainty  #: of an object said to be of it.
    basis: str  #: of the uncertainty.


_KLEINPAT = (
    "Wang and James, KleinPAT: Optimal Mode Conflation for Time-Domain Precomputation of Acoustic Transfer, "
    "ACM TOG 38(4), article 122, 2019, table 4"
)

_ALPHA, _BETA = 0.6, 0.9
"""Published constants for modal sound of one and the same material differ by factors of 1.5 to 4 in
alpha (ceramic 6 and 15, plastic 20 and 30, iron 5 and 10, steel 5 and 20, all in 1/s) and of 3 to 5 in
beta (ceramic 2e-8 and 1e-7, plastic 3e-7 and 1e-6, in s); these are the deviations of their logarithms,
pooled. How an object is held adds to alpha beside."""

_TABLE = (
    (Material("ceramic", 2700.0, 7.2e10, 0.19, 6.0, 1e-7), (0.07, 0.20, 0.15),
     "judged: tableware from earthenware to porcelain has 2000 to 2600 kg/m^3, and softens with its pores"),
    (Material("glass", 2600.0, 6.2e10, 0.20, 1.0, 1e-7), (0.05, 0.08, 0.07),
     "two thirds of the way to soda-lime glass: 2440 to 2490 kg/m^3, 69 to 72 GPa, 0.22 (Callister, "
     "Materials Science and Engineering, 7th edition, 2007, appendix B)"),
    (Material("wood", 750.0, 1.1e10, 0.25, 60.0, 2e-6), (0.10, 0.22, 0.30),
     "clear wood of one species along the grain (Forest Products Laboratory, Wood Handbook, 2010, chapter "
     "5), Poisson's ratio judged; across the grain it is ten times as soft, as no isotropic material can be"),
    (Material("plastic", 1070.0, 1.4e9, 0.35, 30.0, 1e-6), (0.05, 0.25, 0.06),
     "judged: ABS of all grades has 1010 to 1210 kg/m^3 and 1.1 to 2.9 GPa; other plastics differ more"),
    (Material("iron", 8000.0, 2.1e11, 0.28, 5.0, 1e-7), (0.05, 0.35, 0.05),
     "judged: the constants are those of pure iron; cast iron has 7000 to 7300 kg/m^3 and 70 to 175 GPa"),
    (Material("polycarbonate", 1190.0, 2.4e9, 0.37, 0.5, 4e-7), (0.02, 0.07, 0.03),
     "judged: unfilled grades have 1140 to 1210 kg/m^3 and 2.0 to 2.4 GPa"),
    (Material("steel", 7850.0, 2.0e11, 0.29, 5.0, 3e-8), (0.015, 0.035, 0.03),
     "carbon steels of 207 GPa and stainless ones of 193 GPa (Callister, as for glass)"),
)  # fmt: skip

KNOWN: Mapping[str, KnownMaterial] = MappingProxyType(
    {
        constants.name: KnownMaterial(constants, _KLEINPAT, Uncertainty(*spread, _ALPHA, _BETA), basis)
        for constants, spread, basis in _TABLE
    }
)
"""The seven by name, with sources and uncertainties. The constants are also those of the NeuralSound
program (Jin et al. 2022)."""

MATERIALS: MappingProxyType[str, Material] = MappingProxyType(
    {name: known.material for name, known in KNOWN.items()}
)
"""The seven by name."""


def material(name: str) -> Material:
    """The material of that name, one of the seven, in any case.

    Raises:
        WrongUse: there is none; the nearest known one is named.
    """
    found = MATERIALS.get(name.strip().lower())
    if found is None:
        raise WrongUse(f"no material {name!r}; {nearest(name, MATERIALS)}")
    return found
