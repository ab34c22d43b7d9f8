"""The size of an object never drawn, by each sense: what household things look, sound and feel like."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from types import MappingProxyType

import numpy as np

from experiments.scale_estimation.size import Belief, SizeRange, fused
from experiments.scale_estimation.touch.fit import USUAL_PLACE, Patch
from experiments.scale_estimation.unseen import spectrogram
from experiments.scale_estimation.unseen.contact_set import GelWay, imprint_features
from experiments.scale_estimation.unseen.network import by_ways, shipped
from experiments.scale_estimation.unseen.regression import by_outline, features_of
from harness.basics.arrays import FloatArray
from harness.basics.errors import FitRefused
from harness.basics.materials import Material
from harness.bench.acquisition import Strike
from harness.bench.instruments.cameras import CameraSection
from harness.experiment.repeated_readings import PlaceTolerance, group_by_place
from harness.picture.outline import SeenOutline

NOVEL_SIGMA = 0.35
"""Of the size's logarithm, of touch at the usual distance from what was learnt; in proportion nearer to it.
An arm's paths differ from those sampled for the training."""

WIDER = MappingProxyType({"vision": 1.0, "audio": 4.0, "touch": 2.0})
"""Factor on a sense's spread in the product of several senses, if the shape is unknown. The errors of the
senses are correlated by the unknown shape, so that their product is too narrow. Sound has the largest errors,
with far heavier tails than a normal density."""


@dataclass(frozen=True, eq=False)
class ShapelessAnswer:
    """The answer about an object whose shape is not known."""

    belief: Belief  #: over the size.
    distance: float
    """from what was learnt, in units of the usual one; beyond 1 the belief is widened for it."""

    @property
    def strange(self) -> bool:
        """Whether the reading is unlike all that was learnt."""
        return self.distance > 1.0


def outline_alone(
    outline: SeenOutline, camera: CameraSection | None, place: FloatArray, sizes: SizeRange
) -> ShapelessAnswer:
    """By its outline.

    Args:
        outline: of the picture.
        camera: of the station.
        place: ``(3,)`` m in base, where the object nominally stands.
        sizes: asked about.

    Raises:
        FitRefused: there is no camera, or the outline is not whole.
    """
    if camera is None:
        raise FitRefused("the station has no [camera]")
    if outline.hidden.any():
        raise FitRefused(
            "the object's outline is cut off by the picture's border; move the camera back: without its "
            "shape nobody knows what lies beyond"
        )
    features, width = features_of(outline, camera.base_from_camera.matrix, camera.focal_length, place)
    return ShapelessAnswer(by_outline(features, width, sizes).widened(shape_sigma("vision")), 0.0)


def strikes_alone(strikes: Sequence[Strike], material: Material, sizes: SizeRange) -> ShapelessAnswer:
    """By strikes of an object that is said to be of a material.

    Raises:
        FitRefused: no strike may be used.
    """
    heard = spectrogram.response_of(strikes)
    if heard is None:
        raise FitRefused("nothing was heard: no strike was made, or none rang; strike the object")
    bands, extras = spectrogram.features(*heard, material)
    return ShapelessAnswer(*shipped("sound").belief([{"bands": bands, "extras": extras}], sizes))


def ways_alone(
    ways: Sequence[GelWay],
    sizes: SizeRange,
    same_place: PlaceTolerance = USUAL_PLACE,
) -> ShapelessAnswer:
    """Estimate the size from the straight paths of the gel, those that met the object and those that did not.

    Args:
        ways: paths of one exploration.
        sizes: range of sizes that is asked about.
        same_place: largest differences between two paths to one place; the first of them counts.

    Raises:
        FitRefused: the gel touched nothing.
    """
    if all(way.normal is None for way in ways):
        raise FitRefused("the gel touched nothing yet")
    lines = np.array([(way.end, way.direction) for way in ways]).reshape(-1, 2, 3)
    places = group_by_place(lines[:, 0], lines[:, 1], same_place)
    distinct = [ways[k] for k in np.unique(places, return_index=True)[1]]
    belief, distance = by_ways(distinct, sizes)
    # Farther off than usual, the network has given an even density its share already.
    novel = NOVEL_SIGMA * min(distance, 1.0)
    return ShapelessAnswer(belief.widened(float(np.hypot(shape_sigma("touch"), novel))), distance)


def together_without_shape(beliefs: Mapping[str, Belief]) -> Belief:
    """Combine the posteriors of several senses for an object of unknown shape; one alone stays unchanged."""
    if len(beliefs) == 1:
        return next(iter(beliefs.values()))
    return fused(
        [one.widened(one.spread * np.sqrt(WIDER[sense] ** 2 - 1.0)) for sense, one in beliefs.items()]
    )


def imprints_alone(patches: Sequence[Patch], sizes: SizeRange) -> ShapelessAnswer:
    """By the imprints in the gel, were nothing known of where the arm was.

    Raises:
        FitRefused: the gel touched nothing.
    """
    if not patches:
        raise FitRefused("the gel touched nothing yet")
    rows, kinds, whole = imprint_features([patch.points for patch in patches])
    inputs = {"ways": rows, "kinds": kinds, "whole": whole}
    return ShapelessAnswer(*shipped("imprints").belief([inputs], sizes))


WRITTEN = "data/real_shapes.json"


@cache
def shape_sigma(sense: str) -> float:
    """Deviation of the size's logarithm that is added to a sense's answer about an object never drawn.

    It is the one with which scanned things are likeliest that no network and no table has seen;
    ``training.real_shapes`` finds it.
    """
    written = json.loads((files(__package__) / WRITTEN).read_text())
    return float(written[sense]["sigma"])
