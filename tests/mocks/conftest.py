"""A mug on the bench, and where the flange must be to press on it."""

from collections.abc import Callable

import numpy as np
import pytest

from harness.basics.arrays import FloatArray
from harness.basics.geometry import frame_facing, inverse, transform, translation
from harness.bench.sensor import GELSIGHT_R15
from harness.objects.household import build
from mocks.world.world import Camera, NominalBench

Press = Callable[[float, float, float], FloatArray]


@pytest.fixture(scope="session")
def mug_bench() -> NominalBench:
    """A mug half a metre in front of the arm, seen by a camera that stands beside it."""
    eye, target = np.array([-0.1, 0.5, 0.65]), np.array([-0.5, 0.0, 0.28])
    z = (target - eye) / np.linalg.norm(target - eye)
    x = np.cross(z, [0.0, 0.0, 1.0])
    x /= np.linalg.norm(x)
    camera = Camera(transform(np.stack([x, np.cross(z, x), z], axis=1), eye), 240, 320, 300.0)
    return NominalBench(
        build("mug", edge=4e-3),
        translation(np.array([-0.5, 0.0, 0.25])),
        translation(np.array([0.0, 0.0, 0.12])),
        GELSIGHT_R15,
        "gelsight_r15_bench",
        "gelsight_r15_world",
        camera,
    )


@pytest.fixture(scope="session")
def press(mug_bench: NominalBench) -> Press:
    """``base_from_flange`` that presses ``depth`` m into the nominal wall at an azimuth and a height."""

    def pressed(depth: float, azimuth: float, height: float) -> FloatArray:
        outward = np.array([np.cos(azimuth), np.sin(azimuth), 0.0])
        vertices = mug_bench.mesh.vertices
        near = np.abs(vertices[:, 2] - height) < 4e-3
        wall = float((vertices[near] @ outward).max())
        point = outward * wall + np.array([0.0, 0.0, height])
        object_from_gel = transform(frame_facing(-outward, 0.4), point - outward * depth)
        base_from_flange: FloatArray = (
            mug_bench.base_from_object @ object_from_gel @ inverse(mug_bench.flange_from_gel)
        )
        return base_from_flange

    return pressed
