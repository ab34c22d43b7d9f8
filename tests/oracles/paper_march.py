"""The paper's arithmetic done plainly: samples evenly along every ray, and no skipping."""

import time

import numpy as np

from harness.basics.arrays import AnyArray, FloatArray
from harness.basics.mesh import Mesh
from harness.objectfile.vision.network.network import VisionModel
from harness.objectfile.vision.network.plain import Query, evaluate
from tests.samples.published_view import LIGHT, camera_of

PLAIN_SAMPLES = 384
"""Of a ray in the paper, between 0.01 and 4 of its units: 1.2 units are the box."""


def paper_seconds(model: VisionModel, mesh: Mesh, size: int, crop: int) -> float:
    """CPU s of a picture of the published view: every sample of every ray in a cell with a network, in numpy.

    A crop in the middle is measured and the whole extrapolated by the samples there are. What networks are
    told of visibility and normals is nothing here: it changes no time of theirs.

    Args:
        model: of the object.
        mesh: of the object, in metres.
        size: pixels, a side of the whole.
        crop: pixels, a side of what is measured.
    """
    camera, grid = camera_of(mesh, size), model.grid
    longest = float(np.ptp(mesh.bounds, axis=0).max())
    places = np.linspace(0.01, 4.0, PLAIN_SAMPLES) * longest / 1.2
    ways = camera.directions().reshape(-1, 3)
    inside = np.zeros(size, int)

    def samples(rows: FloatArray) -> tuple[FloatArray, AnyArray]:
        points = camera.eye + places[None, :, None] * rows[:, None]
        return points.reshape(-1, 3), grid.networks(points.reshape(-1, 3))

    for row in range(size):
        inside[row] = np.count_nonzero(samples(ways[row * size : (row + 1) * size])[1] >= 0)
    middle = slice((size - crop) // 2, (size + crop) // 2)
    rows = ways.reshape(size, size, 3)[middle, middle].reshape(-1, 3)
    begun = time.process_time()
    points, networks = samples(rows)
    met = np.flatnonzero(networks >= 0)
    views = np.repeat(rows, PLAIN_SAMPLES, axis=0)[met]
    told = np.zeros((len(met), model.weights.size.extras))
    density, colour = evaluate(model, Query(networks[met], points[met], views, LIGHT.direction, told))
    thick = np.zeros(len(networks))
    thick[met] = density * (places[1] - places[0])
    behind = np.cumsum(thick.reshape(-1, PLAIN_SAMPLES), axis=1)
    weights = np.exp(-(behind - thick.reshape(behind.shape))) * -np.expm1(-thick.reshape(behind.shape))
    np.add.at(np.zeros((len(rows), 3)), met // PLAIN_SAMPLES, weights.ravel()[met, None] * colour)
    return (time.process_time() - begun) * float(inside.sum()) / max(len(met), 1)
