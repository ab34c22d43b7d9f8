"""A small object whose sound is known in closed form: its network is the truth, computed in float64."""

import hashlib
import json
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import trimesh

from harness.basics.arrays import FloatArray
from harness.basics.materials import MATERIALS
from harness.basics.mesh import Mesh
from harness.objectfile.audio.graph import OutputScales, audio_graph
from harness.objectfile.audio.part import AudioPart, with_audio
from harness.objectfile.entries import Provenance
from harness.objectfile.file import ObjectFile, create_object
from harness.objectfile.graph import Encoding, MlpWeights, Normaliser
from harness.objects.builtin import DESCRIPTION
from harness.sim.modal.modes import Modes, dampings

MODES = 7
NEAR = 2e-3
ENCODING = Encoding.octaves(4)
PROVENANCE = Provenance(licence="CC0-1.0", seeds={"weights": 0}, code={"module": "tests.object_bench"})


def egg(subdivisions: int = 3) -> Mesh:
    """An ellipsoid of 60 x 80 x 100 mm, off its origin so that no two axes are alike."""
    ball = trimesh.creation.icosphere(subdivisions=subdivisions)
    return Mesh(ball.vertices * [0.03, 0.04, 0.05] + [0.11, -0.02, 0.05], ball.faces)


def perceptron(
    seed: int,
    outputs: int,
    width: int = 32,
    depth: int = 3,
    skips: tuple[int, ...] = (),
    encoding: Encoding = ENCODING,
) -> MlpWeights:
    """Random layers that keep the size of what passes."""
    random, layers, before = np.random.default_rng(seed), [], 0
    for layer in range(depth + 1):
        taken = before + (encoding.width(3) if layer == 0 or layer in skips else 0)
        given = outputs if layer == depth else width
        weight = random.normal(size=(taken, given)) * np.sqrt(2.0 / taken)
        layers.append((weight, 0.1 * random.normal(size=given)))
        before = given
    return MlpWeights(tuple(layers), skips)


def normaliser(mesh: Mesh) -> Normaliser:
    """Of the mesh's box."""
    return Normaliser.unit_box(mesh.bounds[0], mesh.bounds[1])


def scales(modes: int = MODES) -> OutputScales:
    """Another for each mode and direction, so that none can be taken for another."""
    numbers = np.arange(1.0, 3.0 * modes + 1.0).reshape(modes, 3)
    return OutputScales(numbers, -0.1 * numbers)


def computed(
    branches: Sequence[MlpWeights],
    points: FloatArray,
    normal: Normaliser,
    scale: OutputScales,
    encoding: Encoding = ENCODING,
) -> FloatArray:
    """``(n, m, 3)``: what the graph should give, by the definitions, in float64."""
    inside = (points - normal.shift) * normal.factor
    waves = [wave(rate * inside) for rate in encoding.frequencies for wave in (np.sin, np.cos)]
    encoded = np.concatenate([inside, *waves], axis=1)
    outputs = []
    for branch in branches:
        hidden = np.zeros((len(points), 0))
        for number, (weight, bias) in enumerate(branch.layers):
            if number == 0 or number in branch.skips:
                hidden = np.concatenate([encoded, hidden], axis=1)
            hidden = hidden @ weight + bias
            if number < len(branch.layers) - 1:
                hidden = np.maximum(hidden, 0.0)
        outputs.append(hidden)
    stacked = outputs[0].reshape(len(points), -1, 3) if len(outputs) == 1 else np.stack(outputs, axis=2)
    return np.asarray(stacked * scale.factor + scale.offset)


def egg_modes(mesh: Mesh) -> Modes:
    """The modes whose shapes the network of ``egg_part`` gives."""
    shapes = computed([perceptron(0, 3 * MODES)], mesh.vertices, normaliser(mesh), scales())
    return Modes(
        frequencies=np.linspace(900.0, 9000.0, MODES),
        points=mesh.vertices,
        normals=mesh.vertex_normals,
        faces=mesh.faces,
        shapes=shapes,
        limit=1e4,
        mass=0.3,
        rigid=6,
        nodes=5000,
        elements=3000,
        residual=1e-9,
        seconds={},
    )


def egg_part(mesh: Mesh) -> AudioPart:
    """Its sound, by network and table."""
    modes = egg_modes(mesh)
    return AudioPart(
        modes=modes,
        dampings=dampings(modes.frequencies, MATERIALS["ceramic"]),
        near_surface=NEAR,
        provenance=PROVENANCE,
        graph=audio_graph([perceptron(0, 3 * MODES)], normaliser(mesh), scales(), ENCODING),
        measured={"network": {"gain_error_median": 0.01}},
    )


def egg_file(folder: Path, subdivisions: int = 3) -> ObjectFile:
    """The object, written."""
    mesh = egg(subdivisions)
    return with_audio(create_object(folder, "egg", mesh, MATERIALS["ceramic"], PROVENANCE), egg_part(mesh))


def rewrite(folder: Path, change: Callable[[dict[str, Any]], None]) -> ObjectFile:
    """Change ``object.json`` as a person with an editor would, and open it again."""
    path = folder / DESCRIPTION
    tree = json.loads(path.read_text())
    change(tree)
    path.write_text(json.dumps(tree))
    return ObjectFile.open(folder)


def exchange(folder: Path, name: str, data: bytes) -> ObjectFile:
    """Put other bytes in a file's place, hash and all, so that only looking inside can tell."""
    (folder / name).write_bytes(data)

    def change(tree: Any) -> None:
        if isinstance(tree, dict):
            if tree.get("file") == name:
                tree |= {"sha256": hashlib.sha256(data).hexdigest(), "bytes": len(data)}
            for item in tree.values():
                change(item)

    return rewrite(folder, change)
