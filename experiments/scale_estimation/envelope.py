"""All the space that an object of uncertain size and place may take: no travel of the arm enters it."""

from collections.abc import Sequence

import numpy as np

from experiments.scale_estimation.model import ObjectModel
from harness.basics.arrays import FloatArray
from harness.basics.mesh import Mesh
from harness.basics.mesh_hull import closed_hull

BLIND_PLACES = 2.5
"""Standard deviations of its place that are kept free where nothing was seen or touched yet."""

SEEN_MARGIN = 15.0e-3
"""M around an object as it was seen: its place along the line of sight, its tilt, and a part of its size."""

SEEN_SHARE = 0.05
"""Of its size, in addition."""

_YAWS = 16
_SUPPORT = 2


def blind_envelope(model: ObjectModel) -> Mesh:
    """Where the object may be before anything is known: the largest one, any way round; in base."""
    largest = np.log(model.sizes.high / model.nominal)
    turns = np.arange(_YAWS) * 2.0 * np.pi / _YAWS
    stands = [np.array([largest, 0.0, 0.0, yaw]) for yaw in turns]
    return envelope(model, stands, BLIND_PLACES * model.place_error)


def seen_envelope(model: ObjectModel, stands: Sequence[FloatArray]) -> Mesh:
    """Where it may be after a look.

    Args:
        model: of the object.
        stands: log of the size over the nominal one, x, y, m, yaw, rad: of every turn it may have.
    """
    largest = model.nominal * float(np.exp(max(stand[0] for stand in stands)))
    return envelope(model, stands, SEEN_MARGIN + SEEN_SHARE * largest)


def envelope(model: ObjectModel, stands: Sequence[FloatArray], margin: float) -> Mesh:
    """The convex hull of the object in all these places, and so many metres around; in base."""
    corners = model.corners
    places = np.concatenate([placed(model, corners, stand) for stand in stands])
    shifts = margin * np.array([(x, y, z) for x in (-1, 0, 1) for y in (-1, 0, 1) for z in (0, 1)])
    shifts = shifts[np.abs(shifts[:, :2]).sum(axis=1) <= 1.5 * margin]
    around = (places[:, None] + shifts).reshape(-1, 3)
    around[:, _SUPPORT] = np.maximum(around[:, _SUPPORT], model.place[_SUPPORT])
    return closed_hull(around)


def placed(model: ObjectModel, standing: FloatArray, stand: FloatArray) -> FloatArray:
    """``(n, 3)`` m in base: places of the nominal standing object, of that size, there and so turned."""
    cosine, sine = np.cos(stand[3]), np.sin(stand[3])
    turned = np.column_stack(
        [
            cosine * standing[:, 0] - sine * standing[:, 1],
            sine * standing[:, 0] + cosine * standing[:, 1],
            standing[:, 2],
        ]
    )
    return np.asarray(np.exp(stand[0]) * turned + model.place + np.array([stand[1], stand[2], 0.0]))
