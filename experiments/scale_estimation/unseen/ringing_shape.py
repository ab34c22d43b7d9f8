"""How an object of a family rings, at any size and of any material: its modes, solved once."""

from dataclasses import dataclass

import numpy as np

from harness.basics.arrays import FloatArray, read_only
from harness.basics.materials import MATERIALS, Material
from harness.sim.modal.modal import solve_modes
from harness.sim.modal.modes import dampings
from harness.sim.solid.household.solid_grid import HouseholdSolid
from harness.sim.solid.tetrahedra import Tetrahedra
from harness.sim.sound.modal_radiation import radiation

SOLVED_AT = 0.2
"""M, the longest side at which modes are solved."""

SOLVED_OF = MATERIALS["ceramic"]

MODES = 60
"""That are solved. What is above them is continued at their spacing."""

PLACES = 150
"""Of the surface, that may be struck."""

_MICROPHONE = 0.5
_SPACED_BY = 20


@dataclass(frozen=True, eq=False)
class RingingShape:
    """The modes of a shape, ``SOLVED_AT`` long and ``SOLVED_OF``."""

    frequencies: FloatArray  #: ``(m,)`` Hz, ascending.
    amplitudes: FloatArray
    """``(PLACES, m)`` Pa / (N s): gain along the normal of a struck place times radiation."""

    @classmethod
    def solved(cls, shape: HouseholdSolid, random: np.random.Generator) -> "RingingShape":
        """From a body one long.

        Raises:
            MeshRefused: its modes cannot be solved.
        """
        inside = Tetrahedra(read_only(shape.inside.nodes * SOLVED_AT), shape.inside.cells)
        modes = solve_modes(inside, SOLVED_OF, limit=np.inf, most=MODES)
        struck = random.integers(len(modes.points), size=PLACES)
        gains = np.einsum("nmd,nd->nm", modes.shapes[struck], modes.normals[struck])
        return cls(read_only(modes.frequencies.copy()), read_only(gains * radiation(modes, _MICROPHONE)))

    def at(
        self, size: float, material: Material, highest: float, random: np.random.Generator
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """``(m,)`` Hz, ``(m,)`` 1/s and ``(PLACES, m)`` Pa / (N s) of an object of that size and material.

        Above the modes that were solved others follow at the spacing of the last ones, with the amplitudes
        of one of those each: the modes of a thin wall have one spacing all over.

        Args:
            size: m, its longest side.
            material: of it.
            highest: Hz, up to which modes are given.
            random: draws those that were not solved.
        """
        scale = material.speed / SOLVED_OF.speed * SOLVED_AT / size
        louder = SOLVED_OF.density / material.density * (SOLVED_AT / size) ** 2
        frequencies, amplitudes = self.frequencies * scale, self.amplitudes * louder
        last = frequencies[-_SPACED_BY:]
        spacing = (last[-1] - last[0]) / (_SPACED_BY - 1)
        more = max(0, int((highest - frequencies[-1]) / spacing))
        if more:
            above = frequencies[-1] + np.cumsum(spacing * random.exponential(1.0, more))
            like = amplitudes[:, random.integers(len(frequencies) - _SPACED_BY, len(frequencies), more)]
            sign = random.choice([-1.0, 1.0], (len(amplitudes), more))
            frequencies = np.append(frequencies, above)
            amplitudes = np.hstack([amplitudes, like * sign])
        kept = frequencies < highest
        return frequencies[kept], dampings(frequencies[kept], material), amplitudes[:, kept]
