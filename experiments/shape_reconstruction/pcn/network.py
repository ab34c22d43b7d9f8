"""The trained network that came with the program, and its answer to touches."""

import json
import time
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from importlib.resources import files

import numpy as np

from experiments.shape_reconstruction.estimators.contact_samples import all_samples
from experiments.shape_reconstruction.estimators.point_answer import PointEstimate
from experiments.shape_reconstruction.evidence import ShapeEvidence
from experiments.shape_reconstruction.pcn.card import held_out_error
from experiments.shape_reconstruction.pcn.graph_values import completed_places, touched_or_seen
from experiments.shape_reconstruction.pcn.interpolated import interpolated
from experiments.shape_reconstruction.pcn.point_frame import GIVEN, TAKEN, PointFrame, taken
from harness.basics.arrays import FloatArray
from harness.objectfile.runtime import Network


@dataclass(frozen=True, eq=False)
class TouchCompletion:
    """A trained network."""

    network: Network  #: that runs it.
    card: Mapping[str, object]  #: where it comes from and what it reaches on shapes held out.

    @property
    def held_out(self) -> float:
        """M, mean Chamfer-L1 from points to points on shapes that the network was not fitted to.

        Raises:
            DataRefused: the card does not say it.
        """
        return held_out_error(self.card)

    def completed(self, points: FloatArray) -> FloatArray:
        """``(GIVEN, 3)`` m all over the object of which ``(n, 3)`` m in ``stand`` were touched.

        Raises:
            OutOfDomain: too few places for a frame.
        """
        frame = PointFrame.of(points)
        inputs = frame.inward(taken(points))[None].astype(np.float32)
        found = self.network({"touched": inputs})["completed"][0]
        return frame.outward(found.astype(np.float64))


def by_completion(evidence: ShapeEvidence) -> PointEstimate:
    """Points all over the object, by the network that was shipped, and between them; it looks at no picture.

    Raises:
        FitRefused: no touch met the object.
        OutOfDomain: touches in one place, at the support.
    """
    start = time.perf_counter()
    points = shipped().completed(all_samples(evidence).points)
    return PointEstimate(interpolated(points), time.perf_counter() - start, {"estimator": "pcn"})


@cache
def shipped() -> TouchCompletion:
    """The network in the program's own folder."""
    folder = files(__package__) / "data"
    return opened((folder / "completion.onnx").read_bytes(), (folder / "completion.json").read_text())


def opened(data: bytes, card: str) -> TouchCompletion:
    """A network from its file's bytes and its card.

    Raises:
        DataRefused: the graph must not be run, or is another one.
    """
    inputs = [touched_or_seen("touched", (TAKEN, 3))]
    return TouchCompletion(
        Network(data, "completion.onnx", inputs, [completed_places(GIVEN)]), json.loads(card)
    )
