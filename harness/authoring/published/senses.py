"""Sound and touch of a published file as tables of ``object.json`` and exported networks."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from harness.authoring.published.layout import FileTable, State
from harness.basics.arrays import AnyArray, FloatArray
from harness.basics.errors import DataRefused
from harness.objectfile.entries import Domain, Input, NetworkEntry, Tensor
from harness.objectfile.file import file_entry
from harness.objectfile.network_part import NetworkPart, network_entry
from harness.objectfile.npy_file import npy_bytes
from harness.objectfile.published.entries import Bounds
from harness.objectfile.published.touch import (
    DEPTH_PIXELS,
    PRESS_DEPTH,
    SEEN_DEPTH,
    TILT,
    normalised_coordinates,
)
from harness.objectfile.vision_tensors import graph_input

_AUDIO, _TOUCH, _VOXELS = "audio.onnx", "touch.onnx", "audio_voxels.npy"

_TOLERANCE = 1e-4
"""Tolerance of a self-test, relative to the greatest number: as for networks of ours."""

_TESTED = 4
"""Queries of a self-test."""


@dataclass(eq=False)
class ImportedParts:
    """Parts gathered while a file is read."""

    tree: dict[str, Any] = field(default_factory=dict)  #: tables of ``object.json``.
    contents: dict[str, bytes] = field(default_factory=dict)  #: bytes of files, by name.
    dropped: dict[str, int] = field(default_factory=dict)
    """numbers that the published programs never use, by name."""
    missing: list[str] = field(default_factory=list)  #: sentences on what the file does not hold.

    def network(
        self,
        file: str,
        module: Any,
        inputs: tuple[Input, ...],
        outputs: tuple[Tensor, ...],
        doc: str,
        asked: Mapping[str, AnyArray],
    ) -> NetworkEntry:
        """Export a module into the contents.

        Args:
            file: name of the graph's file.
            module: torch module.
            inputs: the module's inputs, in order.
            outputs: the module's outputs, in order.
            doc: description stored in the graph.
            asked: inputs of the self-test.

        Raises:
            DataRefused: a graph that must not be run.
        """
        from harness.authoring.published.modules import exported_graph

        graph = exported_graph(module, inputs, outputs, doc)
        return network_entry(NetworkPart(file, graph, inputs, outputs, asked, _TOLERANCE), self.contents)


def take_gains(audio: FileTable, into: ImportedParts) -> None:
    """Read the sound of version 2.0.

    Raises:
        DataRefused: tables or layers that are missing or do not fit together.
    """
    state, normaliser = State.of(audio, "model_state_dict"), audio.part("normalizer")
    frequencies, dampings = (audio.array(key, (None,)) for key in ("frequencies", "dampings"))
    modes = len(frequencies)
    low, high = (normaliser.numbers(key, 3) for key in ("xyz_min", "xyz_max"))
    _require_extent(low, high, normaliser.name)
    box = Domain(low=tuple(low.tolist()), high=tuple(high.tolist()))
    points = graph_input("points", "float64", ("n", 3), "m", "where the object is struck", box, "mesh")
    gains = Tensor(
        name="gains", dtype="float32", shape=("n", modes, 3), unit="not stated by the file", frame="mesh",
        meaning="gain of each mode for a unit force along x, y, z",
    )  # fmt: skip
    into.tree["audio_gains"] = {
        "frequencies_hz": frequencies.tolist(),
        "dampings_per_s": dampings.tolist(),
        "low_m": low.tolist(),
        "high_m": high.tolist(),
        "network": _perceptrons(
            into, _AUDIO, points, gains, state, _ranges(normaliser, modes), low, 1.0 / (high - low)
        ),
    }
    into.missing.append("the unit of the gains, so that sounds have no absolute loudness")


def take_spectra(audio: FileTable, bounds: Bounds | None, into: ImportedParts) -> None:
    """Read the sound of version 1.0; ``DataRefused`` as ``take_gains``."""
    state, normaliser = State.of(audio, "model_state_dict"), audio.part("normalizer")
    box = Domain(low=(0.0,) * 5, high=(1.0,) * 5)
    place = graph_input(
        "place", "float64", ("n", 5), "1", "x y z of a voxel, frequency, time: 0 to 1", box, "mesh"
    )
    spectrum = Tensor(
        name="spectrum", dtype="float32", shape=("n", 2, 3), unit="not stated by the file", frame="mesh",
        meaning="real and imaginary part, for a unit force along x, y, z",
    )  # fmt: skip
    into.contents[_VOXELS] = npy_bytes(audio.array("voxel_vertex", (None, 3)), "<f8")
    into.tree["audio_spectrum"] = {
        "voxels": file_entry(_VOXELS, into.contents[_VOXELS]),
        "translation": audio.numbers("translation", 3).tolist(),
        "scale": audio.number("scale"),
        "bounds": bounds,
        "network": _perceptrons(
            into, _AUDIO, place, spectrum, state, _ranges(normaliser, 1), np.zeros(5), np.ones(5)
        ),
    }
    if bounds is None:
        into.missing.append(
            "the bounds that the voxels were normalised by: the sound refuses until they are given"
        )


def take_depths(touch: FileTable, into: ImportedParts) -> None:
    """Read the touch of version 2.0; ``DataRefused`` as ``take_gains``."""
    state = State.of(touch, "model_state_dict")
    low, high = (touch.numbers(key, 3) for key in ("xyz_min", "xyz_max"))
    _require_extent(low, high, touch.name)
    rows, columns = DEPTH_PIXELS
    least = np.array([*low, 0.0, -1.0, -1.0, PRESS_DEPTH[0], 0.0, 0.0])
    most = np.array([*high, TILT, 1.0, 1.0, PRESS_DEPTH[1], rows - 1.0, columns - 1.0])
    domain = Domain(low=tuple(least.tolist()), high=tuple(most.tolist()))
    meaning = "x y z, m; tilt, rad; cosine and sine of its azimuth; depth of the press, m; row; column"
    pixel = graph_input("pixel", "float64", ("n", 9), "m, rad, 1 and pixels", meaning, domain, "mesh")
    seen = "from the gel's camera to its surface"
    depth = Tensor(name="depth", dtype="float32", shape=("n", 1), unit="m", meaning=seen)
    shift, factor = least.copy(), 1.0 / (most - least)
    shift[4:6], factor[4:6] = 0.0, 1.0  # cosine and sine stay as they are
    near, far = SEEN_DEPTH
    branch = ("", np.array([far - near]), np.array([near]))
    into.tree["touch_depth"] = {
        "low_m": low.tolist(),
        "high_m": high.tolist(),
        "most_tilt_rad": TILT,
        "depth_m": PRESS_DEPTH,
        "network": _perceptrons(into, _TOUCH, pixel, depth, state, [branch], shift, factor),
    }
    into.missing += [
        "the limits of tilt, depth of press and distance from the camera: they are the published program's",
        "which way a gel's azimuth 0 points, and its yaw",
        "the gel's colours: pictures of touch need a calibration",
    ]


def take_colours(touch: FileTable, bounds: Bounds | None, into: ImportedParts) -> None:
    """Read the touch of version 1.0; ``DataRefused`` as ``take_gains``."""
    state = State.of(touch, "model_state_dict")
    greatest = 1.0
    if bounds is not None:
        greatest = max(1.0, float(normalised_coordinates(np.array([bounds[1]]), bounds)[0]))
    box = Domain(low=(-1.0,) * 5, high=(greatest, greatest, greatest, 1.0, 1.0))
    place = graph_input("place", "float64", ("n", 5), "1", "x y z; row and column, -1 to 1", box, "mesh")
    colours = Tensor(
        name="colours", dtype="float32", shape=("n", 3), unit="1", meaning="red green blue, -1 to 1"
    )
    into.tree["touch_colours"] = {
        "bounds_m": bounds,
        "network": _perceptrons(
            into, _TOUCH, place, colours, state, [("", np.ones(1), np.zeros(1))], np.zeros(5), np.ones(5)
        ),
    }
    if bounds is None:
        into.missing.append(
            "the bounds that vertices were normalised by: the touch refuses until they are given"
        )


_Branch = tuple[str, FloatArray, FloatArray]
"""Prefix of a perceptron's names, and the factor and offset of its outputs."""


def _ranges(normaliser: FileTable, count: int) -> list[_Branch]:
    """Branches for unit forces along x, y and z, whose outputs were trained between 0 and 1."""
    branches = []
    for number, axis in enumerate("xyz", start=1):
        low, high = (normaliser.numbers(f"f{number}_{end}", count) for end in ("min", "max"))
        branches.append((f"model_{axis}.", high - low, low))
    return branches


def _require_extent(low: FloatArray, high: FloatArray, name: str) -> None:
    if not (high > low).all():
        raise DataRefused(f"{name}: a box from {low} to {high} has no extent along some axis")


def _perceptrons(
    into: ImportedParts,
    file: str,
    taken: Input,
    given: Tensor,
    state: State,
    branches: Sequence[_Branch],
    shift: FloatArray,
    factor: FloatArray,
) -> NetworkEntry:
    """Export perceptrons with one input, normalised as ``(input - shift) * factor``.

    Raises:
        DataRefused: layers that do not fit together, or as many outputs as neither modes nor normaliser have.
    """
    from harness.authoring.published.modules import ScaledPerceptrons, SkipPerceptron, load_weights

    modules, outputs, count = [], int(given.shape[1]), len(shift)
    for prefix, _, _ in branches:
        width, ends = state.outputs(f"{prefix}pts_linears.0"), state.outputs(f"{prefix}output_linear")
        if ends != outputs:
            raise DataRefused(
                f"{prefix}output_linear of {state.name} has {ends} outputs, where its modes and normaliser "
                f"have {outputs}"
            )
        modules.append(SkipPerceptron(count * 21, width, outputs))
        load_weights(modules[-1], state, prefix)
    into.dropped |= state.unused()
    scales, offsets = (np.stack([branch[k] for branch in branches]) for k in (1, 2))
    network = ScaledPerceptrons(modules, shift, factor, scales, offsets)
    # The self-test's queries are spread over the domain, in the network's own range 0 .. 1 for most inputs.
    low, high = np.array(taken.domain.low), np.array(taken.domain.high)
    asked = {taken.name: low + np.random.default_rng(0).random((_TESTED, count)) * (high - low)}
    doc = f"{taken.meaning}, to {given.meaning}; from a published file."
    return into.network(file, network, (taken,), (given,), doc, asked)
