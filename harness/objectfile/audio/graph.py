"""The graph of the sound network: from points in metres to the modes' shapes there.

Input ``points``: float64 ``(n, 3)``, metres in the object's frame. Output ``gains``: float32
``(n, m, 3)``, 1/sqrt(kg), the mass-normalised shape of each mode: what a unit force along x, y and z
puts into it. Everything else (normalisation, encoding, scale) is inside.

*Why one output.* The paper's three branches, one for each direction of force, and a single trunk with
``3 m`` outputs are then the same to whoever reads the file, and the same as ``Modes.at``; putting
the branches side by side costs a copy of what they computed. *Why float64 points.* The encoding
multiplies a rounding of the input by 2^9; an object scanned far from its origin would lose the
digits that tell its points apart before they are normalised.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from onnx import ModelProto, TensorProto, helper

from harness.basics.arrays import FloatArray
from harness.basics.errors import WrongUse
from harness.objectfile.graph import (
    Encoding,
    MlpWeights,
    Nodes,
    Normaliser,
    Storage,
    check_mlp,
    encoded_rows,
)

PAPER_ENCODING = Encoding.octaves(10)
"""Of ObjectFolder 2.0: 3 numbers become 63."""


@dataclass(frozen=True, eq=False)
class OutputScales:
    """``gain = output * factor + offset``, folded into the last layer."""

    factor: FloatArray  #: ``(m, 3)`` 1/sqrt(kg), for each mode and direction.
    offset: FloatArray  #: ``(m, 3)`` 1/sqrt(kg).


def audio_graph(
    branches: Sequence[MlpWeights],
    normaliser: Normaliser,
    scales: OutputScales,
    encoding: Encoding = PAPER_ENCODING,
    storage: Storage = "float32",
) -> ModelProto:
    """The network as a graph.

    Args:
        branches: three, with ``m`` outputs each, for forces along x, y and z; or one with ``3 m``,
            of which number ``3 i + axis`` belongs to mode ``i``.
        normaliser: of the points.
        scales: of the outputs.
        encoding: of the normalised points.
        storage: of the weights in the file; computed is in float32.

    Raises:
        WrongUse: layers or scales that do not fit together, or weights that are not finite.
    """
    modes = _check(branches, normaliser, scales, encoding)
    nodes = Nodes(storage)
    encoded = nodes.encoded(nodes.normalised("points", normaliser), 3, encoding)
    rows = encoded_rows(3, encoding)
    factor, offset = np.asarray(scales.factor, np.float64), np.asarray(scales.offset, np.float64)
    if len(branches) == 1:
        scaled = branches[0].scaled(factor.ravel(), offset.ravel())
        flat = nodes.mlp(encoded, scaled, rows, "the network")
        nodes.add("Reshape", flat, nodes.constant(np.array([-1, modes, 3])), name="gains")
    else:
        named = [f"the {axis} branch" for axis in "xyz"]
        parts = [branch.scaled(factor[:, k], offset[:, k]) for k, branch in enumerate(branches)]
        apart = [nodes.mlp(encoded, part, rows, what) for part, what in zip(parts, named, strict=True)]
        last = nodes.constant(np.array([2]))
        nodes.add("Concat", *(nodes.add("Unsqueeze", part, last) for part in apart), axis=2, name="gains")
    return nodes.model(
        "audio",
        [helper.make_tensor_value_info("points", TensorProto.DOUBLE, ["n", 3])],
        [helper.make_tensor_value_info("gains", TensorProto.FLOAT, ["n", modes, 3])],
        "Points (n, 3), m in the object's frame, to mass-normalised mode shapes (n, m, 3), 1/sqrt(kg).",
    )


def _check(
    branches: Sequence[MlpWeights], normaliser: Normaliser, scales: OutputScales, encoding: Encoding
) -> int:
    if len(branches) not in (1, 3):
        raise WrongUse(f"{len(branches)} branches; there are three, for x, y and z, or one for all")
    for number, branch in enumerate(branches):
        check_mlp(branch, encoding.width(3), f"branch {number}")
    outputs = {branch.outputs for branch in branches}
    modes, rest = divmod(sum(branch.outputs for branch in branches), 3)
    if len(outputs) != 1 or rest or modes == 0:
        raise WrongUse(f"branches of {sorted(outputs)} outputs; m from each of three, or 3 m from one")
    for name, array, shape in (
        ("normaliser.shift", normaliser.shift, (3,)),
        ("normaliser.factor", normaliser.factor, (3,)),
        ("scales.factor", scales.factor, (modes, 3)),
        ("scales.offset", scales.offset, (modes, 3)),
    ):
        if np.shape(array) != shape or not np.isfinite(array).all():
            raise WrongUse(f"{name} of shape {np.shape(array)} must be {shape} finite numbers")
    return modes
