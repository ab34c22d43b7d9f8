"""What the graph of an object's look takes and gives, in words, units and limits."""

from harness.objectfile.entries import Input, Tensor
from harness.objectfile.vision.network.network import BLOCK, VisionModel
from harness.objectfile.vision_tensors import box_tensors


def vision_tensors(model: VisionModel, block: int = BLOCK) -> tuple[tuple[Input, ...], tuple[Tensor, ...]]:
    """What ``vision_graph`` takes and gives.

    Args:
        model: of the object.
        block: samples of one network that are asked together.
    """
    grid = model.grid
    (a, b, c), (d, e, f) = grid.low.tolist(), grid.high.tolist()
    return box_tensors(len(grid), ((a, b, c), (d, e, f)), model.weights.size.extras, block)
