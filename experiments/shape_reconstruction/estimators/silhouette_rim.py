"""Places of the surface along the border of a silhouette: each ray of the border touches it somewhere."""

from collections.abc import Callable

import numpy as np
from scipy import ndimage
from scipy.spatial import cKDTree

from experiments.shape_reconstruction.estimators.free_space import Silhouette
from experiments.shape_reconstruction.estimators.thin_plate import SurfaceData
from harness.basics.arrays import FloatArray

RAYS = 60
"""Along the whole border, evenly."""

SIGMA = 2.5e-3
"""M, one standard deviation of such a place along its normal: pixels, what is left of the camera's errors."""

NORMAL_SIGMA = 0.3
APART = 10.0e-3
"""M from any contact, within which the contact knows better."""

_DEPTHS = 40


def rim_data(
    silhouette: Silhouette,
    field: Callable[[FloatArray], FloatArray],
    contacts: FloatArray,
    low: FloatArray,
    high: FloatArray,
) -> SurfaceData:
    """Where a field comes nearest to the rays of the border, as data of the surface.

    Args:
        silhouette: of the picture.
        field: m at ``(n, 3)`` m, below zero inside.
        contacts: ``(n, 3)`` m.
        low: ``(3,)`` m, of the box in which the object is.
        high: ``(3,)`` m.
    """
    pixels, outward = _border(silhouette)
    pose = silhouette.look.stand_from_camera
    origin = pose[:3, 3]
    middle = 0.5 * np.array(silhouette.look.mask.shape[::-1])
    in_camera = (pixels - middle - silhouette.shift) / silhouette.look.focal_length
    rays = np.column_stack([in_camera, np.ones(len(in_camera))]) @ pose[:3, :3].T
    corners = np.array([[low, high][k][i] for k in (0, 1) for i in range(3)]).reshape(2, 3)
    nearest, farthest = _depths(corners, origin, pose[:3, 2])
    depths = np.linspace(nearest, farthest, _DEPTHS)
    along = origin + depths[None, :, None] * rays[:, None]
    inside = ((along >= low) & (along <= high)).all(axis=2)
    values = np.where(inside, field(along.reshape(-1, 3)).reshape(inside.shape), np.inf)
    best = values.argmin(axis=1)
    places = along[np.arange(len(along)), best]
    normals = np.column_stack([outward, np.zeros(len(outward))]) @ pose[:3, :3].T
    kept = np.isfinite(values.min(axis=1))
    if len(contacts):
        kept &= cKDTree(contacts).query(places)[0] > APART
    count = int(kept.sum())
    return SurfaceData(
        places[kept], np.zeros(count), np.full(count, SIGMA), normals[kept], np.full(count, NORMAL_SIGMA)
    )


def _border(silhouette: Silhouette) -> tuple[FloatArray, FloatArray]:
    """``(n, 2)`` pixels of the mask's border that nothing may hide, and the direction out of the mask."""
    mask, hidden = silhouette.look.mask, silhouette.look.hidden
    rim = mask & ~ndimage.binary_erosion(mask) & ~ndimage.binary_dilation(hidden, iterations=2)
    rim[[0, -1]], rim[:, [0, -1]] = False, False  # there the picture ends, not the object
    rows, columns = np.nonzero(rim)
    if len(rows) == 0:
        return np.zeros((0, 2)), np.zeros((0, 2))
    slope = [ndimage.gaussian_filter(silhouette.outside, 1.5, order=order) for order in ((0, 1), (1, 0))]
    outward = np.column_stack([axis[rows, columns] for axis in slope])
    outward /= np.maximum(np.linalg.norm(outward, axis=1, keepdims=True), 1e-9)
    around = np.argsort(np.arctan2(rows - rows.mean(), columns - columns.mean()))
    some = around[np.unique(np.linspace(0, len(around) - 1, RAYS).astype(int))]
    return np.column_stack([columns + 0.5, rows + 0.5])[some], outward[some]


def _depths(corners: FloatArray, origin: FloatArray, axis: FloatArray) -> tuple[float, float]:
    """M along the optical axis between which the box with two such corners is."""
    picked = np.array(
        [[corners[i, 0], corners[j, 1], corners[k, 2]] for i in (0, 1) for j in (0, 1) for k in (0, 1)]
    )
    along = (picked - origin) @ axis
    return float(along.min()), float(along.max())
