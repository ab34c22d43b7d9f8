"""A glance: points all over an object from its silhouette alone, by a network that came with the program."""

import json
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cache
from importlib.resources import files

import numpy as np

from experiments.shape_reconstruction.estimators.free_space import Silhouette, silhouette_of
from experiments.shape_reconstruction.estimators.point_answer import PointEstimate
from experiments.shape_reconstruction.evidence import SeenMask, ShapeEvidence
from experiments.shape_reconstruction.pcn.card import held_out_error
from experiments.shape_reconstruction.pcn.graph_values import completed_places, touched_or_seen
from experiments.shape_reconstruction.pcn.interpolated import interpolated
from experiments.shape_reconstruction.pcn.point_frame import GIVEN
from experiments.shape_reconstruction.pcn.window import SIDE, SPAN, UNTOUCHED, Turned, window_of
from harness.basics.arrays import FloatArray, read_only
from harness.basics.clock import now
from harness.basics.errors import FitRefused
from harness.objectfile.runtime import Network

_RIM = np.ones((SIDE, SIDE), bool)
_RIM[1:-1, 1:-1] = False


@dataclass(frozen=True, eq=False)
class Glance:
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

    def points(self, look: SeenMask) -> FloatArray:
        """``(GIVEN, 3)`` m in ``stand``: places all over the object, those behind it supposed.

        Raises:
            FitRefused: the object reaches out of the window.
        """
        turned = Turned.towards(look)
        window = window_of(look, UNTOUCHED, turned)
        if window[0, _RIM].any():
            raise FitRefused(
                f"the silhouette reaches farther than {SPAN * UNTOUCHED.reach * 1e3:.0f} mm from where the "
                "object should stand, and the network looks no farther; check where it stands, or touch it"
            )
        found = np.asarray(
            self.network({"window": window[None].astype(np.float32)})["completed"][0], np.float64
        )
        return turned.outward(UNTOUCHED.outward(found))


def by_glance(evidence: ShapeEvidence) -> PointEstimate:
    """Points all over the object, and between them; it heeds no touch.

    Raises:
        FitRefused: nothing was seen, the object fills the picture, or it is too large for the network.
    """
    began = now()
    points = shipped().points(silhouette_to_glance_at(evidence).look)
    return PointEstimate(interpolated(points), now() - began, {"estimator": "glance"})


def with_supposed(evidence: ShapeEvidence) -> ShapeEvidence:
    """The same, with the places that a glance supposes; as it was where it has them, or none may be given."""
    if len(evidence.supposed):
        return evidence
    try:
        points = shipped().points(silhouette_to_glance_at(evidence).look)
    except FitRefused:
        return evidence
    return replace(evidence, supposed=read_only(points))


def silhouette_to_glance_at(evidence: ShapeEvidence) -> Silhouette:
    """The silhouette of the picture.

    Raises:
        FitRefused: nothing was seen, or the object fills the picture.
    """
    seen = silhouette_of(evidence, np.zeros((0, 3)))
    if seen is None:
        raise FitRefused(
            "the camera saw nothing of the object, or nothing else, and a glance needs its silhouette; let "
            "it look again"
        )
    return seen


@cache
def shipped() -> Glance:
    """The network in the program's own folder."""
    folder = files(__package__) / "data"
    return opened((folder / "glance.onnx").read_bytes(), (folder / "glance.json").read_text())


def opened(data: bytes, card: str) -> Glance:
    """A network from its file's bytes and its card.

    Raises:
        DataRefused: the graph must not be run, or is another one.
    """
    inputs = [touched_or_seen("window", (1, SIDE, SIDE))]
    return Glance(Network(data, "glance.onnx", inputs, [completed_places(GIVEN)]), json.loads(card))
