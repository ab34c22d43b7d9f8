"""The cases on which the published tactile simulators crash or err without a word."""

import dataclasses

import numpy as np
import pytest
import trimesh

from harness.basics import geometry
from harness.basics.arrays import FloatArray
from harness.basics.errors import OutOfDomain
from harness.basics.mesh import Mesh
from harness.bench.sensor import GELSIGHT_R15, TactileSensor
from harness.sim.gel.gel import R15_SKIRT, deform, over_range
from harness.sim.gel.height_map import RasterMesh, height_maps, penetration
from harness.sim.optics.inverse import Inversion, invert
from harness.sim.optics.optics import Optics, OpticsLevel, TactileImages
from harness.sim.optics.tactile_calibration import TactileCalibration, shipped_calibration

SENSOR = GELSIGHT_R15
LEVELS: tuple[OpticsLevel, ...] = ("exact", "fast", "smooth")


@pytest.fixture(scope="module")
def world() -> TactileCalibration:
    return shipped_calibration("gelsight_r15_world")


@pytest.fixture(scope="module")
def bench() -> TactileCalibration:
    return shipped_calibration("gelsight_r15_bench")


def _box(size: tuple[float, float, float]) -> Mesh:
    box = trimesh.creation.box(extents=size)
    return Mesh(np.asarray(box.vertices) + np.array([0, 0, size[2] / 2]), np.asarray(box.faces))


def _gap(
    mesh: Mesh, depth: float, x: float = 0.0, y: float = 0.0, sensor: TactileSensor = SENSOR
) -> FloatArray:
    return height_maps(RasterMesh(mesh), geometry.translation(np.array([x, y, -depth]))[None], sensor)


def _seen(gap: FloatArray, calibration: TactileCalibration, level: OpticsLevel = "exact") -> TactileImages:
    pressed, _ = over_range(penetration(gap, SENSOR), SENSOR)
    return Optics(calibration, level).render(deform(pressed, R15_SKIRT))


def _sound(read: Inversion) -> bool:
    return bool(np.isfinite(read.height).all() and np.isfinite(read.error).all() and (read.height >= 0).all())


@pytest.mark.parametrize("level", LEVELS)
def test_no_contact_is_the_untouched_picture_and_no_contact(
    level: OpticsLevel, world: TactileCalibration, bench: TactileCalibration
) -> None:
    images = _seen(_gap(_box((5e-3, 5e-3, 5e-3)), depth=-1e-3), world, level).images
    assert np.array_equal(images[0], world.background)
    assert not invert(images, bench).contact.any()


@pytest.mark.parametrize("level", LEVELS)
def test_an_object_that_covers_the_whole_sensor(
    level: OpticsLevel, world: TactileCalibration, bench: TactileCalibration
) -> None:
    seen = _seen(_gap(_box((0.1, 0.1, 0.01)), depth=1e-3), world, level)
    # A flat face over the whole window shows no slope: only the force can tell it from no contact.
    assert np.array_equal(seen.images[0], world.background)
    assert _sound(invert(seen.images, bench))


@pytest.mark.parametrize("bad", [np.nan, -np.inf])
def test_heights_that_are_not_numbers_are_refused_by_contact(bad: float) -> None:
    gap = np.repeat(_gap(_box((5e-3, 5e-3, 5e-3)), 1e-3), 3, axis=0)
    gap[2, 40:44, 60:65] = bad
    with pytest.raises(OutOfDomain, match=r"20 pixels .* contact 2"):
        penetration(gap, SENSOR)


def test_where_a_line_meets_nothing_the_gel_is_at_rest_beside_the_object(world: TactileCalibration) -> None:
    # +inf beside a corner must not be differenced into a wall of its own.
    gap = _gap(_box((4e-3, 4e-3, 4e-3)), 0.5e-3)
    assert np.isposinf(gap).any()
    assert np.isfinite(deform(penetration(gap, SENSOR), R15_SKIRT)).all()
    images = _seen(gap, world).images[0]
    assert np.array_equal(images[5:20, 5:20], world.background[5:20, 5:20])


def test_a_press_deeper_than_the_gel_is_held_and_said(
    world: TactileCalibration, bench: TactileCalibration
) -> None:
    gap = _gap(_box((4e-3, 4e-3, 9e-3)), 4e-3)
    held, beyond = over_range(penetration(gap, SENSOR), SENSOR)
    assert held.max() == SENSOR.gel_thickness
    assert beyond[0] == pytest.approx(1.5e-3, abs=1e-12)
    assert _sound(invert(_seen(gap, world).images, bench))


def test_a_sheer_step_is_held_to_the_steepest_slope_known_and_counted(
    world: TactileCalibration, bench: TactileCalibration
) -> None:
    seen = _seen(_gap(_box((6e-3, 6e-3, 9e-3)), 2.4e-3), world)
    assert seen.extrapolated[0] > 50
    read = invert(seen.images, bench)
    assert _sound(read)
    steep = ~read.trusted[0]
    assert 0.002 < steep.mean() < 0.2  # the walls, not the face and not the rest


@pytest.mark.parametrize(("x", "y"), [(9.9e-3, 0.0), (0.0, -7.4e-3), (9.5e-3, 7.0e-3)])
def test_a_contact_at_the_border_of_the_window(
    x: float, y: float, world: TactileCalibration, bench: TactileCalibration
) -> None:
    ball = trimesh.creation.icosphere(subdivisions=4, radius=6e-3)
    mesh = Mesh(np.asarray(ball.vertices) + np.array([0, 0, 6e-3]), np.asarray(ball.faces))
    gap = _gap(mesh, 1e-3, x, y)
    gel = deform(penetration(gap, SENSOR), R15_SKIRT)
    read = invert(_seen(gap, world).images, bench)
    assert np.sqrt(np.mean((read.height - gel) ** 2)) < 50e-6
    touched = gel[0] > 0.4e-3
    assert read.contact[0][touched].mean() > 0.95


def test_a_hole_in_a_mesh_shows_what_is_behind_it() -> None:
    box = _box((10e-3, 10e-3, 6e-3))
    front = box.face_normals[:, 2] < -0.5
    lid = np.flatnonzero(front)[0]
    open_box = Mesh(box.vertices, np.delete(box.faces, lid, axis=0))
    gap = _gap(open_box, 1e-3)[0]
    whole = _gap(box, 1e-3)[0]
    seen = np.isfinite(whole)
    assert np.array_equal(np.isfinite(gap), seen)
    levels = np.unique(np.round(gap[seen], 9))
    assert levels == pytest.approx([-1e-3, 5e-3])


def test_inward_normals_are_the_same_surface() -> None:
    box = _box((10e-3, 10e-3, 6e-3))
    assert np.array_equal(_gap(Mesh(box.vertices, box.faces[:, ::-1]), 1e-3), _gap(box, 1e-3))


def test_degenerate_faces_draw_nothing() -> None:
    box = _box((10e-3, 10e-3, 6e-3))
    slivers = np.array([[0, 0, 1], [2, 2, 2], [0, 1, 1]])
    assert np.array_equal(_gap(Mesh(box.vertices, np.vstack([slivers, box.faces])), 1e-3), _gap(box, 1e-3))


def test_an_edge_seen_edge_on_is_drawn_once_and_finite() -> None:
    # Walls parallel to the lines of sight have no area in the picture; only their rims may count.
    gap = _gap(_box((10e-3, 10e-3, 6e-3)), 1e-3)[0]
    assert gap[np.isfinite(gap)] == pytest.approx(-1e-3, abs=1e-12)
    covered = np.isfinite(gap).sum() * SENSOR.pitch**2
    assert covered == pytest.approx(100e-6, rel=0.03)


def test_texture_finer_than_four_pixels_is_drawn_too_shallow_and_finer_pixels_cure_it() -> None:
    # Ridges of 0.3 mm under pixels of 0.1245 mm: point samples miss the crests. Quarter pixels do not.
    x = np.arange(-60, 61) * 0.0375e-3
    crest = np.where(np.arange(121) % 8 < 4, np.arange(121) % 8, 8 - np.arange(121) % 8) * 0.0375e-3
    vertices = np.array([[a, b, -c] for a, c in zip(x, crest, strict=True) for b in (-4e-3, 4e-3)])
    k = np.arange(120) * 2
    faces = np.concatenate([np.stack([k, k + 1, k + 2], 1), np.stack([k + 1, k + 3, k + 2], 1)])
    ridges = Mesh(vertices, faces)
    fine = dataclasses.replace(SENSOR, rows=480, columns=640, pitch=SENSOR.pitch / 4)
    slopes = []
    for sensor in (SENSOR, fine):
        gap = _gap(ridges, 0.0, sensor=sensor)[0]
        row = gap[sensor.rows // 2]
        row = row[np.isfinite(row)]
        slopes.append(np.sqrt(np.mean(((row[2:] - row[:-2]) / (2 * sensor.pitch)) ** 2)))
    assert slopes[0] < 0.8  # of the ridges' slope of 1
    assert slopes[1] > 0.85


@pytest.mark.parametrize("level", LEVELS)
def test_the_seam_of_directions_is_a_border_as_any_other(
    level: OpticsLevel, world: TactileCalibration
) -> None:
    """A table steps from bin to bin, across the seam no more than elsewhere; without bins nothing steps."""
    y, x = np.mgrid[:120, :160] * SENSOR.pitch
    optics = Optics(world, level)

    def seen(direction: float) -> FloatArray:
        plane = 0.3 * (x * np.cos(direction) + y * np.sin(direction))
        return optics.render(plane[None]).images.astype(np.float64)

    borders = 2.0 * np.pi / 119 * np.arange(1, 120) - np.pi
    steps = np.array([np.abs(seen(d + 1e-4) - seen(d - 1e-4)).mean() for d in borders])
    assert steps[-1] <= steps[:-1].max()
    if level == "smooth":
        assert steps.max() < 0.05


def test_deeper_presses_never_raise_the_gel() -> None:
    ball = trimesh.creation.icosphere(subdivisions=3, radius=5e-3)
    mesh = Mesh(np.asarray(ball.vertices) + np.array([0, 0, 5e-3]), np.asarray(ball.faces))
    gels = [deform(penetration(_gap(mesh, depth), SENSOR), R15_SKIRT) for depth in (0.2e-3, 0.6e-3, 1.0e-3)]
    assert (gels[1] >= gels[0] - 2e-5).all()
    assert gels[2].sum() > gels[1].sum() > gels[0].sum()
