"""The paper's completion networks: touched points, the silhouette, or both, to points all over the object."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from experiments.shape_reconstruction.evidence import ShapeEvidence
from experiments.shape_reconstruction.prior.network import (
    NOMINAL_FRAME,
    SIDE,
    WINDOW,
    CameraYaw,
    PointFrame,
    network_input,
    network_output,
    window_of,
)
from experiments.shape_reconstruction.smooth.free_space import all_samples
from harness.authoring.network_program import read_networks
from harness.basics.arrays import FloatArray
from harness.basics.errors import FitRefused, OutOfDomain
from harness.objectfile.runtime import Network

TAKEN = 1024
"""Touched points that a network takes."""

DENSE = 16_384
"""Points that a network gives, as published."""

_GREATEST = 30.0
"""Largest coordinate of a touched point in the network's frame; larger ones were not learnt."""

INPUTS: Mapping[str, tuple[tuple[str, tuple[int, ...]], ...]] = {
    "touch": (("touched", (TAKEN, 3)),),
    "picture": (("window", (1, SIDE, SIDE)),),
    "both": (("touched", (TAKEN, 3)), ("window", (1, SIDE, SIDE))),
}
"""Names and shapes of the inputs of each sense's network."""

_DESCRIBED = {
    "touched": network_input(
        "touched", (TAKEN, 3), "touched places over how far they reach", -_GREATEST, _GREATEST
    ),
    "window": WINDOW,
}

SENSES: Mapping[str, str] = {"touch": "T", "picture": "V", "both": "TV"}
"""Senses of each network, as rows of the table abbreviate them."""

_LEAST_REACH = 1.0e-3
_TRAIN = "python -m experiments.paper.train shape --to FOLDER"


def frame_of(points: FloatArray) -> PointFrame:
    """Compute the frame of touched points: about their centre, on the support, as large as their box.

    Args:
        points: ``(n, 3)`` touched points in ``stand``, whose support is z = 0, m.

    Raises:
        OutOfDomain: no point, or all of them in one place at the support.
    """
    if len(points) == 0:
        raise OutOfDomain("no place was touched, and the network completes places; touch the object first")
    low, high = points.min(axis=0), points.max(axis=0)
    reach = float(max(high[0] - low[0], high[1] - low[1], high[2]))
    if not reach > _LEAST_REACH:
        raise OutOfDomain(
            f"touches reach {reach * 1e3:.2f} mm, and {_LEAST_REACH * 1e3:g} mm are needed for a frame; "
            "touch the object in more places"
        )
    middle = 0.5 * (low + high)
    return PointFrame(np.array([middle[0], middle[1], 0.0]), reach)


def take_points(points: FloatArray, seed: int = 0) -> FloatArray:
    """Select ``(TAKEN, 3)`` of ``(n, 3)`` points: each equally often, and a random choice for the rest."""
    random = np.random.default_rng(seed)
    whole, rest = divmod(TAKEN, len(points))
    rows = np.concatenate([np.tile(np.arange(len(points)), whole), random.permutation(len(points))[:rest]])
    return np.asarray(points[rows])


@dataclass(frozen=True, eq=False)
class PaperCompletion:
    """A trained network."""

    sense: str  #: key of ``INPUTS``.
    network: Network  #: the graph.

    def complete(self, evidence: ShapeEvidence) -> FloatArray:
        """Predict ``(DENSE, 3)`` points all over the object, m.

        Raises:
            FitRefused: no touch met the object, or nothing was seen, where the network needs it.
            OutOfDomain: all touches in one place.
        """
        look = evidence.look
        if look is None and self.sense != "touch":
            raise FitRefused("the camera saw nothing of the object, and this network looks at it")
        turned, frame, inputs = CameraYaw.towards(look), NOMINAL_FRAME, {}
        if self.sense != "picture":
            points = turned.inward(all_samples(evidence).points)
            frame = frame_of(points)
            inputs["touched"] = frame.inward(take_points(points))
        if look is not None and self.sense != "touch":
            inputs["window"] = window_of(look, frame, turned)
        given = {name: value[None].astype(np.float32) for name, value in inputs.items()}
        found = np.asarray(self.network(given)["completed"][0], np.float64)
        return turned.outward(frame.outward(found))


def paper_completions(folder: Path) -> list[PaperCompletion]:
    """Open all networks of a folder, in the order of ``INPUTS``.

    Raises:
        DataRefused: the folder has none, a card is missing or no JSON, or a graph must not be run.
    """
    found = []
    for sense, data in read_networks(folder, INPUTS, _TRAIN).items():
        described = [_DESCRIBED[name] for name, _ in INPUTS[sense]]
        network = Network(data, f"{sense}.onnx", described, [network_output(DENSE)])
        found.append(PaperCompletion(sense, network))
    return found
