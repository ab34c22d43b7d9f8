"""What the estimate's accuracy costs: the dials of its method."""

from dataclasses import dataclass
from typing import Literal

Method = Literal["grid", "particle"]
Senses = Literal["touch", "audio", "both"]


@dataclass(frozen=True)
class Levels:
    """One choice of every dial.

    Attributes:
        senses: ``"touch"``, ``"audio"``, or ``"both"``: whatever was recorded.
        method: ``"grid"``, the exact posterior refined; ``"particle"``, the paper's filter.
        spacing: metres between the surface's samples.
        particles: of the paper's filter.
        block: tactile pixels averaged into one of the compared map, each way.
        rounds: of refinement at most; 0 answers from the grid.
        samples: hypotheses drawn in each round where the yaw is known; four times as many where not.
    """

    senses: Senses = "both"
    method: Method = "grid"
    spacing: float = 2.0e-3
    particles: int = 1000
    block: int = 8
    rounds: int = 5
    samples: int = 3000
