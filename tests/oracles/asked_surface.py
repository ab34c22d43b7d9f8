"""What networks are told of rays, in one call: for tests and benchmarks that draw no picture."""

import numpy as np

from harness.basics.arrays import AnyArray, FloatArray
from harness.objectfile.vision.surface import SurfaceExtras
from harness.objectfile.vision.threads import Workspace

UNKNOWN = np.empty(0, np.int32)
"""Faces, where no outline is asked."""


def told_of(
    extras: SurfaceExtras,
    eye: FloatArray,
    ways: FloatArray,
    light: FloatArray,
    depth: FloatArray,
    likely: AnyArray = UNKNOWN,
) -> AnyArray:
    """``(n, 4)`` float32, as ``LitSurface.tell`` writes it for networks that are told of the surface."""
    lit = extras.under(eye, light)
    assert lit is not None, "these networks are told nothing"
    found = np.empty((len(ways), extras.count), np.float32)
    lit.surface_inputs(ways, depth, likely, found, Workspace())
    return found
