"""Import a published ObjectFile into a folder: ``object.json``, graphs, and what the file does not hold."""

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, Literal

import numpy as np

from harness.authoring.published.layout import FileTable, ImportedParts, State, format_of
from harness.authoring.published.look import take_first_look, take_look
from harness.authoring.published.reader import read_container
from harness.basics.arrays import FloatArray
from harness.basics.code_version import content_hash
from harness.basics.errors import DataRefused, WrongUse
from harness.basics.files.foreign_file import sha256_of
from harness.objectfile.description import PUBLISHED, SCHEMA, model_from
from harness.objectfile.entries import Domain, Input, NetworkEntry, Provenance, Source, Tensor
from harness.objectfile.file import file_entry, write_described
from harness.objectfile.npy_file import npy_bytes
from harness.objectfile.published.entries import Bounds, Format, PublishedDescription, PublishedObject
from harness.objectfile.published.touch import (
    DEPTH_PIXELS,
    PRESS_DEPTH,
    SEEN_DEPTH,
    TILT,
    normalised_coordinates,
)
from harness.objectfile.vision_tensors import graph_input
from harness.objects.builtin import DESCRIPTION

LICENCE = "CC BY 4.0, as ObjectFolder publishes its ObjectFiles; the scanned mesh keeps its own licence"

_AUDIO, _TOUCH, _VOXELS = "audio.onnx", "touch.onnx", "audio_voxels.npy"

_UNKNOWN_UNIT = "not stated by the file"

_EVERY = [
    "the object's mesh and material, so that no run and no other command than `object render queries` uses it"
]


def import_published(
    path: Path,
    out: Path,
    name: str | None = None,
    licence: str = LICENCE,
    audio_bounds: Bounds | None = None,
    touch_bounds: Bounds | None = None,
) -> PublishedObject:
    """Read a published ObjectFile and write it as a folder of ours.

    Args:
        path: path of the ``.pth`` file.
        out: the folder, made.
        name: name of the object; None for the file's.
        licence: licence of the file.
        audio_bounds: voxels, least and greatest coordinate that 1.0's sound was normalised by.
        touch_bounds: m, the same of 1.0's touch.

    Raises:
        WrongUse: there is no such file, the folder holds an object, torch is missing, or bounds that 2.0 has
            itself.
        DataRefused: the file is foreign, damaged, or not of a layout that is known.
    """
    if (out / DESCRIPTION).exists():
        raise WrongUse(f"{out} holds an object already; name another folder, or delete that one")
    tree = read_container(path)
    kind = format_of(tree, path.name)
    source = Source(what=f"ObjectFile of {kind}", origin=path.name, licence=licence, sha256=sha256_of(path))
    parts = gathered(tree, path.name, kind, audio_bounds, touch_bounds)
    return write_parts(parts, kind, source, name or path.stem, out)


def write_parts(parts: ImportedParts, kind: Format, source: Source, name: str, out: Path) -> PublishedObject:
    """Write the parts of a file to the folder ``out``, which is created.

    Raises:
        DataRefused: the parts do not fit each other.
    """
    described = {
        "schema": SCHEMA,
        "kind": PUBLISHED,
        "name": name,
        "format": kind,
        "missing": (*_EVERY, *parts.missing),
        "dropped": parts.dropped,
        "provenance": Provenance(
            code={__name__: content_hash(__name__)}, sources=(source,), licence=source.licence
        ),
        **parts.tree,
    }
    description = model_from(described, PublishedDescription, str(out / DESCRIPTION))
    out.mkdir(parents=True, exist_ok=True)
    write_described(out, description, parts.contents)
    return PublishedObject(out, description)


def gathered(
    tree: Any, name: str, kind: Format, audio_bounds: Bounds | None, touch_bounds: Bounds | None
) -> ImportedParts:
    """Read the tables and files of all networks of a file; arguments and errors as ``import_published``."""
    bounds = {"AudioNet": audio_bounds, "TouchNet": touch_bounds, "VisionNet": None}
    for option, pair in (("--audio-bounds", audio_bounds), ("--touch-bounds", touch_bounds)):
        if pair is not None and kind == "ObjectFolder 2.0":
            raise WrongUse(
                f"{option} is for ObjectFolder 1.0; files of 2.0 hold their own bounds, and this is one"
            )
        if pair is not None and not pair[0] < pair[1]:
            raise WrongUse(
                f"{option} {pair[0]:g} {pair[1]:g}: the least coordinate comes first, then the greatest"
            )
    file, parts = FileTable(name, tree), ImportedParts()
    for key, take in _TAKERS[kind].items():
        if key in tree:
            take(file.part(key), bounds[key], parts)
        else:
            parts.missing.append(f"{key}: the file has no such network")
    return parts


def take_gains(audio: FileTable, _: Bounds | None, parts: ImportedParts) -> None:
    """Read the sound of version 2.0.

    Raises:
        DataRefused: tables or layers that are missing or do not fit together.
    """
    normaliser = audio.part("normalizer")
    frequencies, dampings = (audio.array(key, (None,)) for key in ("frequencies", "dampings"))
    (low, high), modes = normaliser.box(), len(frequencies)
    points = _input("points", "m", "where the object is struck", low, high)
    meaning = "gain of each mode for a unit force along x, y, z"
    gains = _output("gains", ("n", modes, 3), _UNKNOWN_UNIT, meaning, "mesh")
    ranges = _force_ranges(normaliser, modes)
    parts.tree["audio_gains"] = {
        "frequencies_hz": frequencies.tolist(),
        "dampings_per_s": dampings.tolist(),
        "low_m": low.tolist(),
        "high_m": high.tolist(),
        "network": _perceptrons(parts, _AUDIO, audio, points, gains, ranges, low, 1.0 / (high - low)),
    }
    parts.missing.append("the unit of the gains, so that sounds have no absolute loudness")


def take_spectra(audio: FileTable, bounds: Bounds | None, parts: ImportedParts) -> None:
    """Read the sound of version 1.0; ``DataRefused`` as ``take_gains``."""
    place = _input("place", "1", "x y z of a voxel, frequency, time: 0 to 1", np.zeros(5), np.ones(5))
    meaning = "real and imaginary part, for a unit force along x, y, z"
    spectrum = _output("spectrum", ("n", 2, 3), _UNKNOWN_UNIT, meaning, "mesh")
    ranges = _force_ranges(audio.part("normalizer"), 1)
    parts.contents[_VOXELS] = npy_bytes(audio.array("voxel_vertex", (None, 3)), "<f8")
    parts.tree["audio_spectrum"] = {
        "voxels": file_entry(_VOXELS, parts.contents[_VOXELS]),
        "translation": audio.numbers("translation", 3).tolist(),
        "scale": float(audio.numbers("scale")[0]),
        "bounds": bounds,
        "network": _perceptrons(parts, _AUDIO, audio, place, spectrum, ranges),
    }
    if bounds is None:
        parts.missing.append(
            "the bounds that the voxels were normalised by: the sound refuses until they are given"
        )


def take_depths(touch: FileTable, _: Bounds | None, parts: ImportedParts) -> None:
    """Read the touch of version 2.0; ``DataRefused`` as ``take_gains``."""
    (low, high), (rows, columns), (near, far) = touch.box(), DEPTH_PIXELS, SEEN_DEPTH
    least = np.array([*low, 0.0, -1.0, -1.0, PRESS_DEPTH[0], 0.0, 0.0])
    most = np.array([*high, TILT, 1.0, 1.0, PRESS_DEPTH[1], rows - 1.0, columns - 1.0])
    meaning = "x y z, m; tilt, rad; cosine and sine of its azimuth; depth of the press, m; row; column"
    pixel = _input("pixel", "m, rad, 1 and pixels", meaning, least, most)
    depth = _output("depth", ("n", 1), "m", "from the gel's camera to its surface")
    shift, factor = least.copy(), 1.0 / (most - least)
    shift[4:6], factor[4:6] = 0.0, 1.0  # cosine and sine stay as they are
    ranges = [("", np.array([near]), np.array([far]))]
    parts.tree["touch_depth"] = {
        "low_m": low.tolist(),
        "high_m": high.tolist(),
        "most_tilt_rad": TILT,
        "depth_m": PRESS_DEPTH,
        "network": _perceptrons(parts, _TOUCH, touch, pixel, depth, ranges, shift, factor),
    }
    parts.missing += [
        "the limits of tilt, depth of press and distance from the camera: they are the published program's",
        "which way a gel's azimuth 0 points, and its yaw",
        "the gel's colours: pictures of touch need a calibration",
    ]


def take_colours(touch: FileTable, bounds: Bounds | None, parts: ImportedParts) -> None:
    """Read the touch of version 1.0; ``DataRefused`` as ``take_gains``."""
    greatest = np.ones(5)
    if bounds is not None:
        greatest[:3] = max(1.0, float(normalised_coordinates(np.array([bounds[1]]), bounds)[0]))
    place = _input("place", "1", "x y z; row and column, -1 to 1", np.full(5, -1.0), greatest)
    colours = _output("colours", ("n", 3), "1", "red green blue, -1 to 1")
    ranges = [("", np.zeros(1), np.ones(1))]
    parts.tree["touch_colours"] = {
        "bounds_m": bounds,
        "network": _perceptrons(parts, _TOUCH, touch, place, colours, ranges),
    }
    if bounds is None:
        parts.missing.append(
            "the bounds that vertices were normalised by: the touch refuses until they are given"
        )


_TAKERS: dict[Format, dict[str, Callable[[FileTable, Bounds | None, ImportedParts], None]]] = {
    "ObjectFolder 1.0": {"AudioNet": take_spectra, "TouchNet": take_colours, "VisionNet": take_first_look},
    "ObjectFolder 2.0": {"AudioNet": take_gains, "TouchNet": take_depths, "VisionNet": take_look},
}

_Range = tuple[str, FloatArray, FloatArray]
"""Prefix of a perceptron's names, and what 0 and 1 of its outputs stand for."""


def _force_ranges(normaliser: FileTable, count: int) -> list[_Range]:
    """Ranges for unit forces along x, y and z."""
    low, high = (
        [normaliser.numbers(f"f{axis}_{end}", count) for axis in (1, 2, 3)] for end in ("min", "max")
    )
    return list(zip(("model_x.", "model_y.", "model_z."), low, high, strict=True))


def _input(name: str, unit: str, meaning: str, low: FloatArray, high: FloatArray) -> Input:
    """Describe ``(n, k)`` inputs from ``low`` to ``high`` in the mesh's frame."""
    domain = Domain(low=tuple(low.tolist()), high=tuple(high.tolist()))
    return graph_input(name, "float64", ("n", len(low)), unit, meaning, domain, "mesh")


def _output(
    name: str, shape: tuple[int | Literal["n"], ...], unit: str, meaning: str, frame: str = ""
) -> Tensor:
    return Tensor(name=name, dtype="float32", shape=shape, unit=unit, meaning=meaning, frame=frame)


def _perceptrons(
    parts: ImportedParts,
    file: str,
    sense: FileTable,
    taken: Input,
    given: Tensor,
    ranges: Sequence[_Range],
    shift: FloatArray | float = 0.0,
    factor: FloatArray | float = 1.0,
) -> NetworkEntry:
    """Export perceptrons with one input, normalised as ``(input - shift) * factor``.

    Raises:
        DataRefused: layers that do not fit together, or as many outputs as neither modes nor normaliser have.
    """
    from harness.authoring.published.modules import ScaledPerceptrons, SkipPerceptron, load_weights

    state, modules = State.of(sense, "model_state_dict"), []
    count, outputs = int(taken.shape[1]), int(given.shape[1])
    for prefix, _, _ in ranges:
        width, ends = state.outputs(f"{prefix}pts_linears.0"), state.outputs(f"{prefix}output_linear")
        if ends != outputs:
            raise DataRefused(
                f"{prefix}output_linear of {state.name} has {ends} outputs, where its modes and normaliser "
                f"have {outputs}"
            )
        modules.append(SkipPerceptron(count * 21, width, outputs))
        load_weights(modules[-1], state, prefix)
    parts.dropped |= state.unused()
    low, high = (np.stack([each[k] for each in ranges]) for k in (1, 2))
    network = ScaledPerceptrons(modules, np.zeros(count) + shift, np.zeros(count) + factor, high - low, low)
    doc = f"{taken.meaning}, to {given.meaning}; from a published file."
    return parts.network(file, network, (taken,), (given,), doc)
