"""All the space that an object of uncertain size and place may take: no travel of the arm enters it."""

from collections.abc import Sequence

import numpy as np

from experiments.scale_estimation.model import ObjectModel
from experiments.scale_estimation.vision.vision import SeenStand
from harness.basics.arrays import FloatArray
from harness.basics.mesh import Mesh
from harness.basics.mesh_hull import closed_hull

PLACES = 3.0
"""Standard deviations of its place that are kept free around it."""

SEEN_MARGIN = 5.0e-3
"""M around an object as it was seen, in addition: its tilt, and what its model leaves out."""

SEEN_SHARE = 0.03
"""Of its size, in addition."""

_YAWS = 16
_SUPPORT = 2


def blind_envelope(model: ObjectModel) -> Mesh:
    """Where the object may be before anything is known: the largest one, any way round; in base."""
    largest = np.log(model.sizes.high / model.nominal)
    turns = np.arange(_YAWS) * 2.0 * np.pi / _YAWS
    stands = [np.array([largest, 0.0, 0.0, yaw]) for yaw in turns]
    return envelope(model, stands, PLACES * model.place_error)


def seen_envelope(model: ObjectModel, stands: Sequence[SeenStand]) -> Mesh:
    """Where it may be after a look, in every turn that was not ruled out; in base."""
    largest = model.nominal * float(np.exp(max(stand.unknowns[0] for stand in stands)))
    off = PLACES * max(stand.place_error for stand in stands)
    return envelope(model, [stand.unknowns for stand in stands], SEEN_MARGIN + SEEN_SHARE * largest + off)


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
