"""Points of a press are on what pressed it, and their normals are its own."""

import numpy as np
import pytest

from experiments.shape_reconstruction.contact_points import CLEAR, POINTS, ContactPoints, contact_points
from experiments.shape_reconstruction.thresholds import MIN_INDENTATION
from harness.basics.arrays import FloatArray

PITCH = 0.1245e-3
ROWS, COLUMNS = 120, 160


def across_and_along() -> tuple[FloatArray, FloatArray]:
    across = (np.arange(COLUMNS) - 0.5 * (COLUMNS - 1)) * PITCH
    along = (np.arange(ROWS) - 0.5 * (ROWS - 1)) * PITCH
    x, y = np.meshgrid(across, along)
    return x, y


def read(heights: FloatArray) -> ContactPoints:
    found = contact_points(heights, np.full(heights.shape, 5e-6), PITCH)
    assert found is not None
    return found


@pytest.mark.parametrize("radius", [8e-3, 20e-3, 60e-3])
@pytest.mark.parametrize("kind", [np.float64, np.float32])
def test_a_ball_is_met_on_its_own_surface_and_faces_away_from_its_middle(radius: float, kind: type) -> None:
    x, y = across_and_along()
    depth = 1e-3
    heights = np.maximum(0.0, depth - (radius - np.sqrt(np.maximum(radius**2 - x**2 - y**2, 0.0))))
    found = read(heights.astype(kind))
    outward = found.points - np.array([0.0, 0.0, radius - depth])
    # A pixel is off the ball by what the ball falls within a pixel, and float32 by its rounding.
    assert np.linalg.norm(outward, axis=1) == pytest.approx(radius, abs=1e-6)
    cosines = np.einsum("ij,ij->i", outward / radius, found.normals)
    # Slopes are smoothed over two pixels: at the border of what was touched that leaves some degrees.
    assert np.median(np.degrees(np.arccos(np.minimum(cosines, 1.0)))) < 1.0
    assert len(found.points) == POINTS
    assert found.error == pytest.approx(5e-6)


@pytest.mark.parametrize("slope", [(0.0, 0.0), (0.05, 0.0), (0.0, -0.08), (0.04, 0.06)])
def test_a_tilted_plane_has_one_normal(slope: tuple[float, float]) -> None:
    x, y = across_and_along()
    found = read(1.5e-3 + slope[0] * x + slope[1] * y)
    plane = np.array([-slope[0], -slope[1], -1.0])
    assert found.normals @ (plane / np.linalg.norm(plane)) == pytest.approx(1.0, abs=2e-4)


def test_points_are_spread_over_all_that_was_touched() -> None:
    x, y = across_and_along()
    heights = np.where((np.abs(x) < 7e-3) & (np.abs(y) < 2e-3), 1e-3, 0.0)
    points = read(heights).points
    assert np.ptp(points[:, 0]) > 13e-3
    assert np.ptp(points[:, 1]) > 3.5e-3
    apart = np.linalg.norm(points[:, None] - points[None], axis=2) + np.eye(len(points))
    assert apart.min() > 0.5e-3


def test_what_was_hardly_touched_is_no_contact() -> None:
    heights = np.full((ROWS, COLUMNS), 0.99 * MIN_INDENTATION)
    assert contact_points(heights, np.zeros_like(heights), PITCH) is None
    assert contact_points(np.zeros_like(heights), np.zeros_like(heights), PITCH) is None


def test_one_pixel_is_one_point_with_a_finite_normal() -> None:
    heights = np.zeros((ROWS, COLUMNS))
    heights[3, 5] = 1e-3
    found = read(heights)
    assert len(found.points) == 1
    assert np.isfinite(found.normals).all()
    assert np.linalg.norm(found.normals, axis=1) == pytest.approx(1.0)


def test_clear_places_are_on_the_face_where_nothing_was_touched_and_spread_over_it() -> None:
    x, _ = across_and_along()
    heights = np.where(np.abs(x) < 2e-3, 1e-3, 0.0)
    clear = read(heights).clear
    assert len(clear) == CLEAR
    assert np.all(np.abs(clear[:, 0]) >= 2e-3)
    assert np.all(clear[:, 2] == 0.0)
    assert np.ptp(clear[:, 0]) > 19e-3
    assert np.ptp(clear[:, 1]) > 14e-3
    # Deep enough to be of the object, or not: gel that hangs from it is neither.
    hanging = np.where(np.abs(x) < 2e-3, 1e-3, np.where(np.abs(x) < 6e-3, 2.0 * MIN_INDENTATION, 0.0))
    assert np.all(np.abs(read(hanging).clear[:, 0]) >= 6e-3)


def test_a_press_that_is_met_all_over_leaves_no_place_clear() -> None:
    assert read(np.full((ROWS, COLUMNS), 1e-3)).clear.shape == (0, 3)
