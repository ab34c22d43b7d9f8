"""What a known object sounds like at any size: where its peaks lie, and about how loud they are."""

from dataclasses import dataclass

import numpy as np

from harness.basics.arrays import FloatArray, read_only
from harness.basics.materials import Material
from harness.sim.modal.modes import Modes, dampings
from harness.sim.sound.modal_radiation import radiation

LISTENED_FROM = 0.5
"""M between object and microphone where nobody says: half as far is 6 dB, less than a place's own."""


@dataclass(frozen=True, eq=False)
class RingingModel:
    """The modes of an object at its nominal size, and how strongly a strike at a middling place rings each.

    Attributes:
        frequencies: ``(m,)`` Hz, ascending.
        amplitudes: ``(m,)`` Pa s / N, rms over the surface: gain along the normal times radiation. The
            transfer function at a resonance is half of it over the decay.
        material: whose damping they have.
    """

    frequencies: FloatArray
    amplitudes: FloatArray
    material: Material

    @classmethod
    def of(cls, modes: Modes, material: Material, distance: float = LISTENED_FROM) -> "RingingModel":
        """From the modes of the nominal object; ``distance`` in m to the microphone."""
        along = np.einsum("nmd,nd->nm", modes.shapes, modes.normals)
        middling = np.sqrt(np.mean(along**2, axis=0))
        return cls(
            read_only(modes.frequencies.copy()), read_only(middling * radiation(modes, distance)), material
        )

    def made_of(self, material: Material) -> "RingingModel":
        """The same body of another material: frequencies as sqrt(E / density), amplitudes as 1 / density.

        Poisson's ratio stays as it was, which shifts modes against each other by a percent or two.
        """
        if material == self.material:
            return self
        faster = material.speed / self.material.speed
        lighter = self.material.density / material.density
        return RingingModel(
            read_only(self.frequencies * faster), read_only(self.amplitudes * lighter), material
        )

    def levels(self, log_sizes: FloatArray, window_decay: float) -> FloatArray:
        """``(k, m)`` dB re 1 Pa/N of each peak of an object larger by ``exp(log_sizes)``.

        Frequencies go with 1/s, amplitudes with s^-2: mass with s^3, and the flow of air with s^-1/2.

        Args:
            log_sizes: ``(k,)`` logarithms of the size over the nominal one.
            window_decay: 1/s that the analysis adds to every decay.
        """
        heard = self.frequencies * np.exp(-log_sizes[:, None])
        decays = dampings(heard, self.material) + window_decay
        found: FloatArray = 20.0 * np.log10(
            np.maximum(self.amplitudes * np.exp(-2.0 * log_sizes[:, None]) / (2.0 * decays), 1e-30)
        )
        return found
