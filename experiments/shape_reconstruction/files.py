"""An estimated surface as files for viewers: PLY with what is known of each vertex, OBJ and GLB."""

from pathlib import Path
from typing import Any

import numpy as np
import trimesh

from experiments.shape_reconstruction.surface import ShapeEstimate

FORMATS = ("ply", "obj", "glb")
"""The first has ``deviation``, m, and ``known_by`` of each vertex; metres in all of them, z up."""


def write_surface(estimate: ShapeEstimate, folder: Path, stem: str) -> None:
    """Write ``stem.ply``, ``stem.obj`` and ``stem.glb``, each whole or not at all.

    Args:
        estimate: its mesh is in the frame ``stand``.
        folder: exists.
        stem: name of the files without their ending.
    """
    known: dict[str, Any] = {
        "deviation": estimate.deviation.astype(np.float32),
        "known_by": estimate.known_by.astype(np.uint8),
    }
    mesh = trimesh.Trimesh(
        estimate.mesh.vertices, estimate.mesh.faces, process=False, vertex_attributes=known
    )
    for kind in FORMATS:
        part = folder / f".{stem}.{kind}"
        with part.open("wb") as stream:
            mesh.export(stream, file_type=kind)
        part.replace(folder / f"{stem}.{kind}")
