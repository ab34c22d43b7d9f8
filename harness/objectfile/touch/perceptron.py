"""The graph of the paper's network of touch: nine numbers for a pixel to the gel's indentation there.

ObjectFolder 2.0 (Gao et al., CVPR 2022, section 4.3, and the network published with it): the nine
inputs of ``touch_pixels``, an encoding of ten octaves, eight layers of 256, the encoded input again
at the sixth. Its output is the depth from camera to gel; here it is how far the gel is pressed in,
which differs by a constant and has its zero where nothing touches.
"""

import numpy as np
from onnx import ModelProto, TensorProto, helper

from harness.basics.arrays import FloatArray
from harness.basics.errors import WrongUse
from harness.bench.sensor import TactileSensor
from harness.objectfile.graph import Encoding, MlpWeights, Nodes, Normaliser, check_mlp, encoded_rows
from harness.objectfile.touch.pixels import INPUTS

PAPER_ENCODING = Encoding.octaves(10)
"""Of ObjectFolder 2.0: 9 numbers become 189."""


def pixel_domain(
    low: FloatArray, high: FloatArray, depths: tuple[float, float], tilt: float, sensor: TactileSensor
) -> tuple[FloatArray, FloatArray]:
    """``(9,)`` least and greatest of each input.

    Args:
        low: ``(3,)`` m, of the object's box.
        high: ``(3,)`` m.
        depths: m, least and greatest.
        tilt: rad at most.
        sensor: gives rows and columns.
    """
    least = np.array([*low, 0.0, -1.0, -1.0, depths[0], 0.0, 0.0])
    most = np.array([*high, tilt, 1.0, 1.0, depths[1], sensor.rows - 1.0, sensor.columns - 1.0])
    return least, most


def paper_normaliser(least: FloatArray, most: FloatArray) -> Normaliser:
    """Each input to 0 .. 1, but cosine and sine, which stay as they are, as in ObjectFolder 2.0."""
    box = Normaliser.unit_box(least, most)
    shift, factor = box.shift.copy(), box.factor.copy()
    shift[4:6], factor[4:6] = 0.0, 1.0
    return Normaliser(shift, factor)


def perceptron_graph(
    weights: MlpWeights, normaliser: Normaliser, scale: float, encoding: Encoding = PAPER_ENCODING
) -> ModelProto:
    """The network as a graph: float64 ``pixel`` ``(n, 9)`` to float32 ``depth`` ``(n, 1)``, m.

    Args:
        weights: with one output.
        normaliser: of the nine inputs.
        scale: m that an output of 1 stands for, folded into the last layer.
        encoding: of the normalised inputs.

    Raises:
        WrongUse: layers that do not fit together, or weights that are not finite.
    """
    check_mlp(weights, encoding.width(INPUTS), "the perceptron")
    if weights.outputs != 1 or not (np.isfinite(scale) and scale > 0.0):
        raise WrongUse(
            f"a perceptron of {weights.outputs} outputs and a scale of {scale}; 1, and metres above 0"
        )
    nodes = Nodes()
    encoded = nodes.encoded(nodes.normalised("pixel", normaliser), INPUTS, encoding)
    flat = nodes.mlp(encoded, weights.scaled(scale), encoded_rows(INPUTS, encoding), "the perceptron")
    nodes.add("Identity", flat, name="depth")
    return nodes.model(
        "touch",
        [helper.make_tensor_value_info("pixel", TensorProto.DOUBLE, ["n", INPUTS])],
        [helper.make_tensor_value_info("depth", TensorProto.FLOAT, ["n", 1])],
        "x y z tilt cos sin depth row column (n, 9) to indentation (n, 1), m.",
    )
