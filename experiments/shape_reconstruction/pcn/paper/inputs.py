"""What the paper's completion takes: touched points, and the silhouette in a window about them."""

from collections.abc import Mapping

from experiments.shape_reconstruction.pcn.point_frame import TAKEN
from experiments.shape_reconstruction.pcn.window import SIDE

INPUTS: Mapping[str, tuple[tuple[str, tuple[int, ...]], ...]] = {
    "touch": (("touched", (TAKEN, 3)),),
    "picture": (("window", (1, SIDE, SIDE)),),
    "both": (("touched", (TAKEN, 3)), ("window", (1, SIDE, SIDE))),
}
"""Names and shapes of what the network of each sense takes."""
