"""Whether codes are of the object they lie beside."""

import numpy as np

from harness.basics.errors import DataRefused
from harness.objectfile.entries import FileEntry
from harness.objectfile.file import ObjectFile
from harness.objectfile.touch.nodes import nodes_from
from harness.objectfile.touch.touch import open_touch
from harness.objectfile.touch_entries import CodesEntry
from harness.sim.gel.press_pose import Presses

_PRESSES = 16

_AGREE = 0.2
"""Of the gel's thickness, the median over presses of the root mean square difference of codes and mesh:
codes beyond it know nothing of this object."""


def look_at_codes(of: ObjectFile, entry: CodesEntry) -> str:
    """Press at some coded places, upright, and rasterise the mesh beside it.

    Raises:
        DataRefused: the maps are not of one object.
    """
    kept: FileEntry = entry.nodes
    nodes = nodes_from(of.read(kept), kept.file)
    chosen = np.unique(np.linspace(0, len(nodes) - 1, _PRESSES).astype(np.int64))
    codes, mesh = open_touch(of, "codes"), open_touch(of, "reference")
    nothing = np.zeros(len(chosen))
    depths = np.full(len(chosen), float(np.mean(codes.entry.depth_m)))
    presses = Presses(nodes.points[chosen], nodes.normals[chosen], depths, nothing, nothing, nothing)
    gaps = np.sqrt(((codes.at(presses) - mesh.at(presses)) ** 2).mean(axis=(1, 2)))
    middle, limit = float(np.median(gaps)), _AGREE * codes.entry.gel.thickness_m
    if not middle <= limit:
        raise DataRefused(
            f"codes and mesh differ by {middle * 1e3:.3g} mm in the median press, where {limit * 1e3:.3g} mm "
            "is the limit; they belong to different objects, frames or units: build the object again"
        )
    worst = gaps.max() * 1e6
    return f"they differ by {middle * 1e6:.3g} um in the median of {len(chosen)} presses, {worst:.3g} at most"
