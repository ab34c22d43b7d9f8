"""The seven materials an object may be made of, and what is known of each."""

from dataclasses import dataclass
from types import MappingProxyType

from harness.errors import WrongUse
from harness.toml_file import nearest


@dataclass(frozen=True)
class Material:
    """An isotropic elastic solid with Rayleigh damping.

    A mode of angular frequency w decays as exp(-d t) with d = (alpha + beta w^2) / 2.

    Attributes:
        name: as a scene writes it.
        density: kg/m^3.
        young: Pa, Young's modulus.
        poisson: Poisson's ratio.
        alpha: 1/s, mass-proportional damping.
        beta: s, stiffness-proportional damping.
    """

    name: str
    density: float
    young: float
    poisson: float
    alpha: float
    beta: float


_TABLE = (
    Material("ceramic", 2700.0, 7.2e10, 0.19, 6.0, 1e-7),
    Material("glass", 2600.0, 6.2e10, 0.20, 1.0, 1e-7),
    Material("wood", 750.0, 1.1e10, 0.25, 60.0, 2e-6),
    Material("plastic", 1070.0, 1.4e9, 0.35, 30.0, 1e-6),
    Material("iron", 8000.0, 2.1e11, 0.28, 5.0, 1e-7),
    Material("polycarbonate", 1190.0, 2.4e9, 0.37, 0.5, 4e-7),
    Material("steel", 7850.0, 2.0e11, 0.29, 5.0, 3e-8),
)

MATERIALS: MappingProxyType[str, Material] = MappingProxyType({m.name: m for m in _TABLE})
"""By name, with the constants of Wang and James, KleinPAT: Optimal Mode Conflation for
Time-Domain Precomputation of Acoustic Transfer, ACM TOG 38(4), article 122, 2019, table 4, as
used by the NeuralSound program (Jin et al. 2022)."""


def material(name: str) -> Material:
    """The material of that name, in any case.

    Raises:
        WrongUse: there is none; the nearest known one is named.
    """
    found = MATERIALS.get(name.strip().lower())
    if found is None:
        raise WrongUse(f"no material {name!r}; {nearest(name, MATERIALS)}")
    return found
