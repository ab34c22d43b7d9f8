"""Sound and touch of a published file as tables and graphs of ours."""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, TypeVar

import numpy as np

from harness.authoring.published.layout import FileTable, State
from harness.basics.arrays import AnyArray, FloatArray
from harness.basics.errors import DataRefused, WrongUse
from harness.objectfile.entries import NetworkEntry
from harness.objectfile.file import file_entry
from harness.objectfile.graph import MlpWeights, Normaliser
from harness.objectfile.network_part import NetworkPart, network_entry
from harness.objectfile.npy_file import npy_bytes
from harness.objectfile.published.entries import Bounds
from harness.objectfile.published.graphs import perceptron_graph_of
from harness.objectfile.published.tensors import (
    PRESSED,
    SEEN,
    TILT,
    Pair,
    colours_tensors,
    depth_tensors,
    gains_tensors,
    spectrum_tensors,
)
from harness.objectfile.published.touch import normalised_coordinates

AUDIO, TOUCH, VOXELS = "audio.onnx", "touch.onnx", "audio_voxels.npy"

TOLERANCE = 1e-4
"""Of a self-test, of the greatest number: as for networks of ours."""

_AXES = ("x", "y", "z")
_TESTED = 4
"""Queries of a self-test."""

_T = TypeVar("_T")


@dataclass(eq=False)
class ImportedParts:
    """What is gathered while a file is read.

    Attributes:
        tree: tables of ``object.json``.
        contents: bytes of files, by name.
        dropped: numbers that the published programs never use, by name.
        missing: sentences on what the file does not hold.
    """

    tree: dict[str, Any] = field(default_factory=dict)
    contents: dict[str, bytes] = field(default_factory=dict)
    dropped: dict[str, int] = field(default_factory=dict)
    missing: list[str] = field(default_factory=list)


def refusing(where: str, build: Callable[[], _T]) -> _T:
    """What is built; layers that do not fit together are the file's fault and ``DataRefused``."""
    try:
        return build()
    except WrongUse as error:
        raise DataRefused(f"{where}: {error}") from error


def take_gains(audio: FileTable, into: ImportedParts) -> None:
    """The sound of version 2.0.

    Raises:
        DataRefused: tables or layers that are missing or do not fit together.
    """
    state, normaliser = State.of(audio, "model_state_dict"), audio.part("normalizer")
    frequencies, dampings = (audio.array(key, (None,)) for key in ("frequencies", "dampings"))
    modes = len(frequencies)
    low, high = (normaliser.numbers(key, 3) for key in ("xyz_min", "xyz_max"))
    branches = [
        _scaled(
            state.perceptron(f"model_{axis}."),
            *_range(normaliser, f"f{k}", modes),
            f"model_{axis} of {state.name}",
        )
        for k, axis in enumerate(_AXES, start=1)
    ]
    into.dropped |= state.dropped()
    tensors = gains_tensors(modes, low, high)
    doc = (
        "Points (n, 3), m, to gains of modes for a unit force along x, y, z (n, m, 3); from a published file."
    )
    box = refusing(normaliser.name, lambda: Normaliser.unit_box(low, high))
    entry = _network(AUDIO, tensors, branches, box, (low, high), doc, into)
    into.tree["audio_gains"] = {
        "frequencies_hz": frequencies.tolist(),
        "dampings_per_s": dampings.tolist(),
        "low_m": low.tolist(),
        "high_m": high.tolist(),
        "network": entry,
    }
    into.missing.append("the unit of the gains, so that sounds have no absolute loudness")


def take_spectra(audio: FileTable, bounds: Bounds | None, into: ImportedParts) -> None:
    """The sound of version 1.0; ``DataRefused`` as ``take_gains``."""
    state, normaliser = State.of(audio, "model_state_dict"), audio.part("normalizer")
    branches = [
        _scaled(
            state.perceptron(f"model_{axis}."),
            *_range(normaliser, f"f{k}", 1),
            f"model_{axis} of {state.name}",
        )
        for k, axis in enumerate(_AXES, start=1)
    ]
    into.dropped |= state.dropped()
    into.contents[VOXELS] = npy_bytes(audio.array("voxel_vertex", (None, 3)), "<f8")
    plain, span = Normaliser(np.zeros(5), np.ones(5)), (np.zeros(5), np.ones(5))
    doc = "Normalised voxel, frequency and time (n, 5) to a spectrum for unit forces along x, y, z (n, 2, 3)."
    entry = _network(AUDIO, spectrum_tensors(), branches, plain, span, doc, into)
    into.tree["audio_spectrum"] = {
        "voxels": file_entry(VOXELS, into.contents[VOXELS]),
        "translation": audio.numbers("translation", 3).tolist(),
        "scale": audio.number("scale"),
        "bounds": bounds,
        "network": entry,
    }
    if bounds is None:
        into.missing.append(
            "the bounds that the voxels were normalised by: the sound refuses until they are given"
        )


def take_depths(touch: FileTable, into: ImportedParts) -> None:
    """The touch of version 2.0; ``DataRefused`` as ``take_gains``."""
    state = State.of(touch, "model_state_dict")
    low, high = (touch.numbers(key, 3) for key in ("xyz_min", "xyz_max"))
    weights = state.perceptron()
    into.dropped |= state.dropped()
    tensors = depth_tensors(low, high)
    domain = tensors[0].domain
    least, most = np.array(domain.low), np.array(domain.high)
    box = refusing(touch.name, lambda: Normaliser.unit_box(least, most))
    shift, factor = box.shift.copy(), box.factor.copy()
    shift[4:6], factor[4:6] = 0.0, 1.0  # cosine and sine stay as they are
    near, far = SEEN
    doc = (
        "x y z tilt cos sin depth row column (n, 9) to m from the gel's camera (n, 1); from a published file."
    )
    scaled = _scaled(weights, np.array([far - near]), np.array([near]), state.name)
    entry = _network(TOUCH, tensors, [scaled], Normaliser(shift, factor), (least, most), doc, into)
    into.tree["touch_depth"] = {
        "low_m": low.tolist(),
        "high_m": high.tolist(),
        "most_tilt_rad": TILT,
        "depth_m": PRESSED,
        "network": entry,
    }
    into.missing += [
        "the limits of tilt, depth of press and distance from the camera: they are the published program's",
        "which way a gel's azimuth 0 points, and its yaw",
        "the gel's colours: pictures of touch need a calibration",
    ]


def take_colours(touch: FileTable, bounds: Bounds | None, into: ImportedParts) -> None:
    """The touch of version 1.0; ``DataRefused`` as ``take_gains``."""
    state = State.of(touch, "model_state_dict")
    weights = state.perceptron()
    into.dropped |= state.dropped()
    most = (
        1.0 if bounds is None else max(1.0, float(normalised_coordinates(np.array([bounds[1]]), bounds)[0]))
    )
    plain, span = Normaliser(np.zeros(5), np.ones(5)), (-np.ones(5), np.ones(5))
    doc = "Normalised place, row and column (n, 5) to red green blue, -1 to 1 (n, 3); from a published file."
    entry = _network(TOUCH, colours_tensors(most), [weights], plain, span, doc, into)
    into.tree["touch_colours"] = {"bounds_m": bounds, "network": entry}
    if bounds is None:
        into.missing.append(
            "the bounds that vertices were normalised by: the touch refuses until they are given"
        )


def _range(normaliser: FileTable, key: str, count: int) -> tuple[FloatArray, FloatArray]:
    """Factor and offset of an output that was trained between 0 and 1."""
    low, high = (normaliser.numbers(f"{key}_{end}", count) for end in ("min", "max"))
    return high - low, low


def _scaled(weights: MlpWeights, factor: AnyArray, offset: AnyArray, where: str) -> MlpWeights:
    if len(factor) not in (1, weights.outputs):
        raise DataRefused(
            f"{where} has {weights.outputs} outputs, where its modes and normaliser have {len(factor)}"
        )
    return weights.scaled(factor, offset)


def _network(
    file: str,
    tensors: Pair,
    branches: list[MlpWeights],
    normaliser: Normaliser,
    span: tuple[FloatArray, FloatArray],
    doc: str,
    into: ImportedParts,
) -> NetworkEntry:
    """The entry of a network, its bytes among the contents; ``span`` is where its self-test lies."""
    taken, given = tensors
    low, high = span
    asked = {taken.name: low + np.random.default_rng(0).random((_TESTED, len(low))) * (high - low)}

    def build() -> NetworkEntry:
        graph = perceptron_graph_of(tensors, branches, normaliser, doc)
        return network_entry(NetworkPart(file, graph, (taken,), (given,), asked, TOLERANCE), into.contents)

    return refusing(file, build)
