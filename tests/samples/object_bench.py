"""A small object whose sound is known in closed form: its network is the truth."""

import hashlib
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import trimesh

from harness.authoring.audio.audio import waves_graph
from harness.authoring.audio.waves import Waves
from harness.basics.materials import MATERIALS
from harness.basics.mesh import Mesh
from harness.objectfile.audio.part import AudioPart, with_audio
from harness.objectfile.entries import Provenance
from harness.objectfile.file import ObjectFile, create_object
from harness.objects.builtin import DESCRIPTION
from harness.sim.modal.modes import Modes, dampings

MODES = 7
NEAR = 2e-3
PROVENANCE = Provenance(licence="CC0-1.0", seeds={"weights": 0}, code={"module": "tests.object_bench"})


def egg(subdivisions: int = 3) -> Mesh:
    """An ellipsoid of 60 x 80 x 100 mm, off its origin so that no two axes are alike."""
    ball = trimesh.creation.icosphere(subdivisions=subdivisions)
    return Mesh(ball.vertices * [0.03, 0.04, 0.05] + [0.11, -0.02, 0.05], ball.faces)


def egg_waves(seed: int = 0, modes: int = MODES) -> Waves:
    """Random waves, whose weights are of another size for each mode and direction."""
    random, sizes = np.random.default_rng(seed), np.arange(1.0, 3.0 * modes + 1.0)
    middle = egg().bounds.mean(axis=0)
    vectors, phases = random.normal(size=(3, 24)), random.uniform(0.0, 6.0, 24)
    return Waves(middle, 20.0, 2.0 * vectors, phases, sizes * random.normal(size=(28, 3 * modes)))


def egg_modes(mesh: Mesh) -> Modes:
    """The modes whose shapes the network of ``egg_part`` gives."""
    shapes = egg_waves()(mesh.vertices)
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
        graph=waves_graph(egg_waves()),
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
