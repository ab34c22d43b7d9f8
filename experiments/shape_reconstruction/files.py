"""An estimated surface as files for viewers: PLY with what is known of each vertex, OBJ and GLB."""

from pathlib import Path

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
    known = {
        "deviation": estimate.deviation.astype(np.float32),
        "known_by": estimate.known_by.astype(np.uint8),
    }
    mesh = trimesh.Trimesh(
        estimate.mesh.vertices, estimate.mesh.faces, process=False, vertex_attributes=known
    )
    for kind in FORMATS:
        written = mesh.export(file_type=kind)
        part = folder / f".{stem}.{kind}"
        part.write_bytes(written.encode() if isinstance(written, str) else written)
        part.replace(folder / f"{stem}.{kind}")
