"""How much the paper's own networks learn from, and for how long."""

from dataclasses import dataclass
from types import MappingProxyType

PAPER_SENSES = ("picture", "spectrogram", "imprints")


@dataclass(frozen=True)
class PaperAmounts:
    """How much is made and for how long it is learnt.

    Attributes:
        shapes: of the families, a tenth of them held out.
        samples: draws of each shape, by sense.
        epochs: by sense.
    """

    shapes: int
    samples: MappingProxyType[str, int]
    epochs: MappingProxyType[str, int]


PAPER_PROFILES = MappingProxyType(
    {
        "paper": PaperAmounts(
            520,
            MappingProxyType({"picture": 8, "spectrogram": 4, "imprints": 16}),
            MappingProxyType({"picture": 6, "spectrogram": 3, "imprints": 40}),
        ),
        "paper-smoke": PaperAmounts(
            26,
            MappingProxyType({"picture": 2, "spectrogram": 2, "imprints": 4}),
            MappingProxyType({"picture": 1, "spectrogram": 1, "imprints": 2}),
        ),
    }
)
"""Of the paper's own networks; the second shows in seconds that all of it runs."""
