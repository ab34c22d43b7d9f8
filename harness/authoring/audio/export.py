"""A trained network of sound as a graph."""

import numpy as np
from onnx import ModelProto, TensorProto, helper

from harness.authoring.audio.waves import Waves
from harness.objectfile.graph import Nodes, Normaliser, Storage


def waves_graph(network: Waves, storage: Storage = "float32") -> ModelProto:
    """Plane waves as a graph; its input and output are those of ``audio_graph``.

    Args:
        network: to write.
        storage: of the linear layer in the file; the waves themselves are float32, as a wave
            vector that is off turns far ends of the object.
    """
    modes = network.weights.shape[1] // 3
    nodes = Nodes(storage)
    place = nodes.normalised("points", Normaliser(network.shift, np.full(3, network.factor)))
    vectors = nodes.constant(network.vectors.astype(np.float32))
    phases = nodes.constant(network.phases.astype(np.float32))
    waves = nodes.add("Sin", nodes.add("Gemm", place, vectors, phases))
    seen = nodes.add("Concat", waves, place, axis=1)
    weights = nodes.weight(network.weights[:-1], "the linear layer")
    offsets = nodes.weight(network.weights[-1], "the linear layer's offset")
    flat = nodes.add("Gemm", seen, weights, offsets)
    nodes.add("Reshape", flat, nodes.constant(np.array([-1, modes, 3])), name="gains")
    return nodes.model(
        "audio",
        [helper.make_tensor_value_info("points", TensorProto.DOUBLE, ["n", 3])],
        [helper.make_tensor_value_info("gains", TensorProto.FLOAT, ["n", modes, 3])],
        "Points (n, 3), m in the object's frame, to mass-normalised mode shapes (n, m, 3), 1/sqrt(kg).",
    )
