"""The look of a published file as tables and graphs of ours: one network (OSF), or one a cell (KiloOSF)."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from harness.authoring.published.cell_look import VISION, take_cells
from harness.authoring.published.layout import FileTable, State
from harness.authoring.published.senses import TOLERANCE, ImportedParts, refusing
from harness.authoring.published.settings import octaves_of, refeed, sampling, unit_vectors, whole
from harness.basics.errors import DataRefused
from harness.objectfile.entries import NetworkEntry
from harness.objectfile.graph import Encoding, MlpWeights
from harness.objectfile.network_part import NetworkPart, network_entry
from harness.objectfile.published.graphs import OsfWeights, osf_graph
from harness.objectfile.published.tensors import osf_tensors

FINE = "vision_fine.onnx"

_FIRST_FAR = 4.0
_FIRST = {
    "near": 0.01,
    "far": _FIRST_FAR,
    "samples": 64,
    "importance": 128,
    "white": True,
    "colour": "sigmoid",
}
"""Of 1.0, by its program; its files hold no settings."""

_FIRST_LAYERS = 8
_FIRST_SKIP = 4
_OCTAVES, _TURNS = 10, 4

_MISSING = ["how the vision frame lies to the mesh, and what its unit is in metres: pictures tell no size"]


def take_first_look(vision: FileTable, into: ImportedParts) -> None:
    """The look of version 1.0: a coarse and a fine network.

    Raises:
        DataRefused: tables or layers that are missing or do not fit together.
    """
    entries = []
    for file, key in ((VISION, "network_fn_state_dict"), (FINE, "network_fine_state_dict")):
        state = State.of(vision, key)
        weights = _osf(state, "", _FIRST_LAYERS, _FIRST_SKIP, (_OCTAVES, _TURNS))
        into.dropped |= state.dropped()
        entries.append(_one(file, weights, _FIRST_FAR, into))
    into.tree["vision"] = {"kind": "osf", **_FIRST, "network": entries[0], "fine": entries[1]}
    into.missing += _MISSING
    into.missing.append("how rays are sampled: the numbers are the published program's")


def take_look(vision: FileTable, into: ImportedParts) -> None:
    """The look of version 2.0, of either kind; ``DataRefused`` as ``take_first_look``."""
    settings, state = vision.part("cfg"), State.of(vision, "model_state_dict")
    sampled = sampling(settings)
    cells = "occupancy_grid" in vision.values or any(np.ndim(value) == 3 for value in state.values.values())
    if cells:
        if sampled["importance"]:
            raise DataRefused(
                f"{settings.name} asks for further samples of a KiloOSF, which the published program has "
                "none of"
            )
        found = take_cells(vision, settings, state, into)
    else:
        found = _take_osf(settings, state, sampled, into)
    into.dropped |= state.dropped()
    into.tree["vision"] = {**sampled, **found}
    into.missing += _MISSING


def _take_osf(
    settings: FileTable, state: State, sampled: Mapping[str, Any], into: ImportedParts
) -> dict[str, Any]:
    layers, skip = whole(settings, "num_hidden_layers", 64), refeed(settings)
    turns = (octaves_of(settings, "num_frequencies"), octaves_of(settings, "num_frequencies_direction"))
    two = bool(sampled["importance"])
    weights = _osf(state, "model_coarse." if two else "", layers, skip, turns)
    found: dict[str, Any] = {"kind": "osf", "network": _one(VISION, weights, sampled["far"], into)}
    if two:
        found["fine"] = _one(FINE, _osf(state, "model_fine.", layers, skip, turns), sampled["far"], into)
    return found


def _osf(state: State, prefix: str, layers: int, skip: int | None, octaves: tuple[int, int]) -> OsfWeights:
    trunk = [state.linear(f"{prefix}pts_linears.{k}") for k in range(layers)]
    features, density = state.linear(f"{prefix}bottleneck_linear"), state.linear(f"{prefix}alpha_linear")
    if features[0].shape[0] != density[0].shape[0]:
        raise DataRefused(
            f"{state.name}: bottleneck_linear and alpha_linear take different numbers of inputs"
        )
    heads = tuple(np.concatenate(pair, axis=-1) for pair in zip(features, density, strict=True))
    return OsfWeights(
        MlpWeights((*trunk, (heads[0], heads[1])), () if skip is None else (skip + 1,)),
        state.linear(f"{prefix}views_lights_linears.0"),
        state.linear(f"{prefix}rgb_linear"),
        *(Encoding.octaves(count) for count in octaves),
    )


def _one(file: str, weights: OsfWeights, reach: float, into: ImportedParts) -> NetworkEntry:
    inputs, outputs = osf_tensors(reach)
    random = np.random.default_rng(0)
    asked = {
        "points": random.uniform(-0.6, 0.6, (4, 3)),
        **{name: unit_vectors(random, 4) for name in ("views", "light")},
    }
    doc = "A point, a view and a light of the vision frame to raw colour and density; from a published file."

    def build() -> NetworkEntry:
        graph = osf_graph(weights, inputs, outputs, doc)
        return network_entry(NetworkPart(file, graph, inputs, outputs, asked, TOLERANCE), into.contents)

    return refusing(file, build)
