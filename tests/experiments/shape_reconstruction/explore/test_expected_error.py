"""The next press goes where it should bring the answer nearest to the truth, by the shapes still allowed."""

from collections.abc import Sequence

import numpy as np
import pytest

from experiments.shape_reconstruction.evidence import ShapeEvidence
from experiments.shape_reconstruction.explore.choosing import (
    distances_apart,
    error_spared,
    farthest,
    most_informative,
    readings_on,
)
from experiments.shape_reconstruction.family import layout
from experiments.shape_reconstruction.family.kind import FamilyShape
from experiments.shape_reconstruction.family.kinds import draw_shape
from experiments.shape_reconstruction.family.rays import first_hit
from experiments.shape_reconstruction.fits import ShapeEstimate
from harness.basics.arrays import FloatArray
from harness.basics.faces.ray_mesh import RayMesh
from harness.basics.geometry import frame_facing, transform
from harness.objects.builtin import build
from tests.support.family_shapes import family_fit, mixture_of, surface_of
from tests.support.shape_readings import shape_readings, touches_on


def shape_at(height: float, aside: float = 0.0) -> FamilyShape:
    """A can, or one lifted by so much: as if its top were not known."""
    can = draw_shape("can", np.random.default_rng(3))
    theta = can.theta.copy()
    theta[[layout.X, layout.Y, layout.YAW, layout.TILT_X, layout.TILT_Y]] = 0.0
    theta[layout.LIFT], theta[layout.X] = height, aside
    return FamilyShape("can", can.code, theta)


def evidence() -> ShapeEvidence:
    return shape_readings(touches_on(build("mug"), 1, 1), None)


def line(place: Sequence[float] | FloatArray, inward: Sequence[float] | FloatArray) -> FloatArray:
    return transform(frame_facing(np.array(inward), 0.0), np.array(place))


TOP = line((0.0, 0.0, 0.01), (0.0, 0.0, -1.0))
SIDE = line((0.0, 0.0, 0.04), (-1.0, 0.0, 0.0))
BESIDE = line((0.5, 0.0, 0.01), (0.0, 0.0, -1.0))
LINES = np.array([TOP, SIDE, BESIDE])


def spared(*shapes: FamilyShape, weights: tuple[float, ...] = ()) -> FloatArray:
    found = error_spared(evidence(), family_fit(mixture_of(*shapes, weights=weights)), LINES)
    assert found is not None
    return found


def test_a_press_that_tells_all_shapes_apart_spares_all_of_the_error() -> None:
    two = shape_at(0.0), shape_at(16e-3)
    expected = 0.5 * distances_apart(two)[0, 1]  # of two alike, either answer is wrong half of the time
    found = spared(*two)
    assert found[0] == pytest.approx(expected, rel=1e-3)
    assert found[1] < 0.2 * found[0]  # the can is a little narrower at its foot
    assert found[2] == pytest.approx(0.0, abs=1e-12)


def test_no_press_makes_it_worse_and_none_spares_more_than_there_is() -> None:
    random = np.random.default_rng(2)
    for _ in range(20):
        shapes = [draw_shape(name, random) for name in ("mug", "bowl", "spanner", "tray", "jug")]
        weights = random.dirichlet(np.ones(len(shapes)))
        lines = np.array([line(random.uniform(-0.05, 0.05, 3), random.normal(size=3)) for _ in range(10)])
        found = error_spared(evidence(), family_fit(mixture_of(*shapes, weights=tuple(weights))), lines)
        assert found is not None
        now = float((distances_apart(shapes) @ weights).min())
        assert np.all(found >= 0.0)
        assert np.all(found <= now)


def test_a_shape_listed_twice_counts_as_once_with_both_weights() -> None:
    a, b = shape_at(0.0), shape_at(6e-3)
    once = spared(a, b, weights=(0.6, 0.4))
    assert spared(a, b, a, weights=(0.3, 0.4, 0.3)) == pytest.approx(once, abs=1e-9)
    assert spared(b, a, weights=(0.4, 0.6)) == pytest.approx(once, abs=1e-9)


def test_what_lies_farther_apart_is_told_apart_more_surely() -> None:
    shares = []
    for by in (6e-3, 8e-3, 16e-3):
        two = shape_at(0.0), shape_at(by)
        shares.append(spared(*two)[0] / (0.5 * distances_apart(two)[0, 1]))
    assert shares == sorted(shares)
    assert shares[0] < 0.9999 < shares[-1]


def test_what_matters_little_to_the_surface_is_worth_little() -> None:
    """Two shapes that a line tells apart for certain, once far apart and once by a thin handle alone."""
    jug = draw_shape("jug", np.random.default_rng(5))
    theta = jug.theta.copy()
    theta[layout.YAW] += np.pi
    handle = distances_apart([jug, FamilyShape("jug", jug.code, theta)])[0, 1]
    moved = jug.theta.copy()
    moved[layout.X] += 0.05
    assert handle < distances_apart([jug, FamilyShape("jug", jug.code, moved)])[0, 1]


def test_the_gel_is_as_wide_as_it_is() -> None:
    """A line that passes 4 mm beside a can still meets it, by the edge of the gel."""
    can = shape_at(0.0)
    radius = float(np.abs(surface_of(can).vertices[:, 0]).max())
    beside = np.array([line((radius + 4e-3, 0.0, 0.01), (0.0, 0.0, -1.0))])
    two = family_fit(mixture_of(can, shape_at(16e-3)))
    found = error_spared(evidence(), two, beside)
    assert found is not None
    assert found[0] > 1e-3


def test_a_press_that_the_housing_stops_reads_nothing() -> None:
    """A can is read from straight aside; from 25 degrees above only by a gel that stands far out."""
    can, slant = shape_at(0.0), np.radians(25.0)
    slanting = line((0.0, 0.0, 0.005), (-np.cos(slant), 0.0, -np.sin(slant)))
    level = line((0.0, 0.0, 0.025), (-1.0, 0.0, 0.0))
    housing = evidence().housing

    def read(out: float) -> list[bool]:
        found = readings_on([can], np.array([slanting, level]), 0.15, (housing, out))
        return [bool(one) for one in np.isfinite(found[0]).all(axis=1)]

    assert read(evidence().gel_thickness) == [False, True]
    assert read(20e-3) == [True, True]


@pytest.mark.parametrize("name", ["mug", "bowl", "spanner", "tray", "jug", "bent body"])
def test_lines_meet_a_shape_where_its_surface_is(name: str) -> None:
    random = np.random.default_rng(4)
    shape = draw_shape(name, random)
    mesh = surface_of(shape)
    aims = mesh.vertices[random.integers(len(mesh.vertices), size=200)]
    ways = random.normal(size=(200, 3))
    ways /= np.linalg.norm(ways, axis=1, keepdims=True)
    starts = aims - 0.4 * ways
    rays = RayMesh(mesh).first_hits(starts, ways).distance
    found = first_hit(shape.code, shape.theta, starts, ways, 0.8)
    off = np.abs(found - rays)[np.isfinite(rays) & np.isfinite(found)]
    assert np.median(off) < 0.5e-3
    assert np.mean(np.isfinite(rays) == np.isfinite(found)) > 0.95  # but for those that graze it


def test_a_line_that_ends_before_the_shape_meets_nothing() -> None:
    can = shape_at(0.0)
    start, way = np.array([[0.0, 0.0, 1.0]]), np.array([[0.0, 0.0, -1.0]])
    far = first_hit(can.code, can.theta, start, way, 1.0)[0]
    assert first_hit(can.code, can.theta, start, way, far - 2e-3)[0] == np.inf
    assert first_hit(can.code, can.theta, start, way, far + 1e-6)[0] == pytest.approx(far, abs=0.6e-3)


def test_shapes_that_agree_leave_the_press_to_go_where_none_was() -> None:
    alike = family_fit(mixture_of(shape_at(0.0), shape_at(1.0e-3)), mesh=build("mug"))
    assert error_spared(evidence(), alike, LINES) is None
    assert np.array_equal(most_informative(evidence(), alike, LINES), farthest(evidence(), alike, LINES))


def test_an_estimate_without_hypotheses_says_nothing_of_where_it_is_unsure() -> None:
    fit = family_fit(mixture_of(shape_at(0.0), shape_at(16e-3)))
    plain = ShapeEstimate(fit.mesh, fit.deviation, fit.known_by, (), {}, (), 0.0, "test")
    assert error_spared(evidence(), fit, LINES) is not None
    assert error_spared(evidence(), plain, LINES) is None
