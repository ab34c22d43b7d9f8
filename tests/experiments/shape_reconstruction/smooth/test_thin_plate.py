"""A field from Hermite data is fitted wherever the data lie in their ball."""

import numpy as np
import pytest

from experiments.shape_reconstruction.smooth.hermite import SurfaceData, fitted
from harness.basics.arrays import FloatArray


def ball_data(kind: str, count: int) -> FloatArray:
    """``(n, 3)`` m within 0.1 of the origin: where the covariance is hardest to keep positive."""
    random = np.random.default_rng(5)
    unit = random.normal(size=(count, 3))
    unit /= np.linalg.norm(unit, axis=1, keepdims=True)
    angle = np.linspace(0.0, 2.0 * np.pi, count, endpoint=False)
    places: dict[str, FloatArray] = {
        "sphere": unit,
        "ball": unit * np.cbrt(random.uniform(size=(count, 1))),
        "two caps": unit[np.abs(unit[:, 2]) > 0.8],
        "ring": np.column_stack([np.cos(angle), np.sin(angle), 0.0 * angle]),
        "rod": np.column_stack([0.0 * angle, 0.0 * angle, np.linspace(-1.0, 1.0, count)]),
        "two ends": random.normal(0.0, 0.01, (count, 3))
        + np.where(angle < np.pi, 0.98, -0.98)[:, None] * [0, 0, 1],
    }
    return 0.1 * places[kind]


@pytest.mark.parametrize("kind", ["sphere", "ball", "two caps", "ring", "rod", "two ends"])
@pytest.mark.parametrize("amplitude", [None, 0.5])
def test_data_anywhere_in_a_ball_are_fitted_to_within_what_they_are_known(
    kind: str, amplitude: float | None
) -> None:
    """Of a plane known to 0.1 mm; where ``R`` only spans the ball, some eigenvalues are negative."""
    points = ball_data(kind, 120)
    normal = np.array([0.6, 0.0, 0.8])
    count = len(points)
    data = SurfaceData(
        points, points @ normal, np.full(count, 1e-4), np.tile(normal, (count, 1)), np.full(count, 0.02)
    )
    low, high = points.min(axis=0), points.max(axis=0)
    field = fitted(data, low, high, amplitude)
    assert field.values(points) == pytest.approx(points @ normal, abs=4e-4)
    deviations = field.deviations(points)
    assert np.all(np.isfinite(deviations))
    assert deviations.max() < 1.5e-4
