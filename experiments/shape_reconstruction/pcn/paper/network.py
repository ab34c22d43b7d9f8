"""The paper's completion from a folder that a training wrote."""

import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from experiments.shape_reconstruction.estimators.contact_samples import all_samples
from experiments.shape_reconstruction.estimators.point_answer import PointEstimate
from experiments.shape_reconstruction.evidence import ShapeEvidence
from experiments.shape_reconstruction.pcn.graph_values import completed_places, touched_or_seen
from experiments.shape_reconstruction.pcn.paper.inputs import INPUTS
from experiments.shape_reconstruction.pcn.point_frame import PointFrame, taken
from experiments.shape_reconstruction.pcn.window import UNTOUCHED, Turned, window_of
from harness.basics.arrays import FloatArray
from harness.basics.clock import now
from harness.basics.errors import DataRefused, FitRefused, OutOfDomain
from harness.objectfile.runtime import Network

DENSE = 16_384
"""Points that it gives, as published."""

SENSES: Mapping[str, str] = {"touch": "T", "picture": "V", "both": "TV"}
"""Of each network, what it is answered from as a table's rows say it."""

_TRAIN = "python -m experiments.shape_reconstruction.pcn.train --profile paper --out FOLDER"


@dataclass(frozen=True, eq=False)
class PaperCompletion:
    """A trained network."""

    sense: str  #: of ``INPUTS``.
    network: Network  #: that runs it.
    card: Mapping[str, object]  #: where it comes from and what it reaches.

    def answered(self, evidence: ShapeEvidence) -> PointEstimate:
        """``(DENSE, 3)`` m all over the object.

        Raises:
            FitRefused: no touch met the object, or all in one place, or nothing was seen, where the network
                needs it.
        """
        try:
            return self._completed(evidence)
        except OutOfDomain as error:
            raise FitRefused(str(error)) from error

    def _completed(self, evidence: ShapeEvidence) -> PointEstimate:
        began, look = now(), evidence.look
        if look is None and self.sense != "touch":
            raise FitRefused("the camera saw nothing of the object, and this network looks at it")
        turned, frame, inputs = Turned.towards(look), UNTOUCHED, {}
        if self.sense != "picture":
            points = turned.inward(all_samples(evidence).points)
            frame = PointFrame.of(points)
            inputs["touched"] = frame.inward(taken(points))
        if look is not None and self.sense != "touch":
            inputs["window"] = window_of(look, frame, turned)
        found = turned.outward(frame.outward(self._run(inputs)))
        return PointEstimate(found, now() - began, {"estimator": f"pcn as published, {self.sense}"})

    def _run(self, inputs: Mapping[str, FloatArray]) -> FloatArray:
        given = {name: value[None].astype(np.float32) for name, value in inputs.items()}
        return np.asarray(self.network(given)["completed"][0], np.float64)


def paper_completions(folder: Path) -> dict[str, PaperCompletion]:
    """All that lie in a folder, by sense.

    Raises:
        DataRefused: there is none, a card is missing or no JSON, or a graph must not be run.
    """
    found = {sense: _opened(folder, sense) for sense in INPUTS if (folder / f"{sense}.onnx").is_file()}
    if not found:
        names = ", ".join(f"{sense}.onnx" for sense in INPUTS)
        raise DataRefused(f"{folder} has none of {names}; train them: {_TRAIN}")
    return found


def _opened(folder: Path, sense: str) -> PaperCompletion:
    path = folder / f"{sense}.onnx"
    try:
        card = json.loads(path.with_suffix(".json").read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise DataRefused(f"{path} has no card beside it; train it again: {_TRAIN}") from error
    inputs = [touched_or_seen(name, shape) for name, shape in INPUTS[sense]]
    return PaperCompletion(
        sense, Network(path.read_bytes(), path.name, inputs, [completed_places(DENSE)]), card
    )
