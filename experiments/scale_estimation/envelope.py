"""All the space that an object of known shape, and uncertain size and place, may take."""

from collections.abc import Sequence

import numpy as np

from experiments.scale_estimation.model import ObjectModel
from experiments.scale_estimation.vision.vision import SeenStand
from harness.basics.arrays import FloatArray
from harness.basics.mesh import Mesh
from harness.basics.mesh_hull import hull_of
from harness.skills.exploring.envelope import PLACES, around, margin_of

_YAWS = 24


def blind_envelope(model: ObjectModel) -> Mesh:
    """Where the object may be before anything is known: the largest one, any way round; in base."""
    size = model.sizes.high
    turns = np.arange(_YAWS) * 2.0 * np.pi / _YAWS
    stands = [np.array([np.log(size / model.nominal), 0.0, 0.0, yaw]) for yaw in turns]
    reach = float(np.linalg.norm(model.corners[:, :2], axis=1).max()) * size / model.nominal
    between = reach * (1.0 / np.cos(np.pi / _YAWS) - 1.0)
    return envelope(model, stands, PLACES * model.place_error + between, margin_of(size))


def seen_envelope(model: ObjectModel, stands: Sequence[SeenStand]) -> Mesh:
    """Where it may be after a look, in every turn that was not ruled out; in base."""
    largest = model.nominal * float(np.exp(max(stand.unknowns[0] for stand in stands)))
    off = PLACES * max(stand.place_error for stand in stands)
    return envelope(model, [stand.unknowns for stand in stands], off, margin_of(largest))


def envelope(model: ObjectModel, stands: Sequence[FloatArray], off: float, margin: float) -> Mesh:
    """The space of an object that may stand in several ways.

    Args:
        model: of the object.
        stands: ``(4,)`` each, log of the size over the nominal one, x, y, m, yaw, rad.
        off: m that it may be off each of them, along the support, in any direction.
        margin: m around it, in every direction.

    Returns:
        Convex, in base, nothing of it below the support.
    """
    corners = model.corners
    places = hull_of(np.concatenate([placed(model, corners, stand) for stand in stands]))
    return around(places, off, margin, float(model.place[2]))


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
