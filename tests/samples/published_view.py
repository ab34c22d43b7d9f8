"""The view and the lamp that the renderer's times are taken with."""

import numpy as np

from harness.basics.mesh import Mesh
from harness.picture.pinhole import DirectionalLight, Pinhole

LIGHT = DirectionalLight(np.array([0.5, -0.4, 0.8]))


def camera_of(mesh: Mesh, size: int) -> Pinhole:
    """The published view: 2.5 away in a box of 1.2, 39.6 degrees across."""
    centre, longest = mesh.bounds.mean(axis=0), float(np.ptp(mesh.bounds, axis=0).max())
    way = np.array([0.3, -0.8, 0.5]) / np.linalg.norm([0.3, -0.8, 0.5])
    return Pinhole.looking_at(
        centre + 2.5 / 1.2 * longest * way, centre, (0, 0, 1), size, size, np.radians(39.6)
    )
