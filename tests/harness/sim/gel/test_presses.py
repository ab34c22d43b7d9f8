"""Batches of presses are presses one by one."""

import numpy as np
import pytest

from harness.basics.errors import WrongUse
from harness.basics.geometry import frame_facing, inverse
from harness.sim.gel.press_pose import ContactPlace, Presses, frames_facing, gel_from_object


def some(count: int) -> Presses:
    random = np.random.default_rng(3)
    normals = random.normal(size=(count, 3))
    normals[:4] = np.array([[0.0, 0.0, 1.0], [0.0, 0.0, -1.0], [1e-9, 0.0, 1.0], [1.0, 0.0, 0.0]])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    angles = [random.uniform(0.0, high, count) for high in (2e-3, 0.26, 6.3, 6.3)]
    return Presses(random.normal(size=(count, 3)), normals, *angles)


def test_each_pose_is_the_simulators() -> None:
    presses = some(40)
    for k, pose in enumerate(presses.object_from_gel):
        place = ContactPlace(presses.points[k], presses.normals[k], 0.0)
        numbers = [float(each[k]) for each in (presses.depths, presses.tilts, presses.azimuths, presses.yaws)]
        np.testing.assert_allclose(inverse(pose), gel_from_object(place, *numbers), atol=1e-12)


def test_frames_are_those_of_one_axis() -> None:
    axes = -some(40).normals
    for axis, frame in zip(axes, frames_facing(axes), strict=True):
        np.testing.assert_allclose(frame, frame_facing(axis, 0.0), atol=1e-13)


def test_a_part_of_a_batch_is_a_batch() -> None:
    presses = some(9)
    part = presses[np.array([7, 2])]
    np.testing.assert_array_equal(part.object_from_gel, presses.object_from_gel[[7, 2]])
    assert len(presses[3:5]) == 2


@pytest.mark.parametrize(
    ("change", "said"),
    [({"depths": np.zeros(3)}, "shapes"), ({"tilts": np.full(9, np.nan)}, "finite"),
     ({"normals": np.ones((9, 3))}, "length")],
)  # fmt: skip
def test_what_is_no_press_is_refused(change: dict[str, np.ndarray], said: str) -> None:
    presses = some(9)
    numbers = {name: vars(presses)[name] for name in vars(presses)} | change
    with pytest.raises(WrongUse, match=said):
        Presses(**numbers)
