"""How small the baselines are, and how long they train: what one core does in a quarter of an hour.

1.0's networks have as few layers as their question needs; those of 2.0 have the published layers, trained for
a minute or two where the paper's take a GPU for hours. Their seconds of rendering do not depend on training.
"""

from dataclasses import dataclass
from typing import Final

from harness.authoring.audio.profiles import PerceptronSpec
from harness.authoring.touch.profiles import CodesSpec, TouchPerceptronSpec
from harness.authoring.vision.profiles import CellsSpec
from harness.objectfile.vision.network import PAPER


@dataclass(frozen=True)
class FitSpec:
    """A perceptron and its training by Adam.

    Attributes:
        depth: hidden layers.
        width: of each.
        octaves: of the encoding.
        steps: of Adam; its rate falls to zero as half a cosine.
        batch: rows in a step.
        rate: of the first steps.
    """

    depth: int = 4
    width: int = 256
    octaves: int = 10
    steps: int = 300
    batch: int = 8192
    rate: float = 2e-3


SPECTROGRAM: Final = FitSpec(steps=320)
"""1.0's AudioNet: 4 layers of 256 for its 3 x 8."""

COLOURS: Final = FitSpec(octaves=6, steps=200)
"""1.0's TouchNet: 4 layers of 256, and 6 octaves for its 10, of which the last are noise between places."""

AUDIONET: Final = PerceptronSpec(epochs=12)
"""2.0's, with the published layers."""

TOUCHNET: Final = TouchPerceptronSpec(presses=1200, epochs=1, steps=150, rate=2e-3)
"""2.0's, with the published layers."""

SMALL_CODES: Final = CodesSpec(most_bytes=1_000_000, pitch=0.8e-3)
"""Ours, smaller than the profile ``smoke``."""

KILO_OSF: Final = CellsSpec(PAPER, places=1_500_000, steps=600)
"""2.0's VisionNet: the published size and inputs, 16^3 cells."""


@dataclass(frozen=True)
class FieldSpec:
    """One network for the look of an object, and its training by Adam.

    Attributes:
        depth: hidden layers of the trunk.
        width: of each.
        octaves: of the place's encoding.
        turns: octaves of the view's and the light's.
        samples: of a ray.
        places: beside the surface that are learned from.
        steps: of Adam; its rate falls to zero as half a cosine.
        batch: places in a step, and half as many of the whole ball.
        rate: of the first steps.
        opacity: weight of the density's error beside the colour's.
    """

    depth: int = 4
    width: int = 128
    octaves: int = 7
    turns: int = 4
    samples: int = 128
    places: int = 1_000_000
    steps: int = 800
    batch: int = 8192
    rate: float = 3e-3
    opacity: float = 0.05


FIELD: Final = FieldSpec()
"""1.0's VisionNet: 4 layers of 128 for its two times 8 of 256, 128 samples for its 64 and 192."""
