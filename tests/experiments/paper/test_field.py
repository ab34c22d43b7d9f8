"""Looks of 1.0 and 2.0: rays that meet nothing are white, objects are where they are, training finds them."""

from pathlib import Path

import numpy as np
import pytest
import trimesh

from experiments.paper.hexahedra import is_within
from experiments.paper.look import DISTANCE, CellFields, UniformField, ball_of
from harness.authoring.vision.data import around
from harness.basics.arrays import FloatArray
from harness.basics.faces.ray_mesh import RayMesh
from harness.basics.mesh import Mesh
from harness.objectfile.published.look import FOCAL, SIZE
from harness.objectfile.published.volume_render import stretched_sigmoid
from harness.objectfile.vision.graph import VisionNetworks
from harness.objectfile.vision.render import open_vision
from harness.picture.pinhole import DirectionalLight
from tests.samples.look_bench import BOX, box_file

DENSE = 1e4


def ball(radius: float) -> Mesh:
    solid = trimesh.creation.icosphere(subdivisions=3, radius=radius)
    return Mesh(np.asarray(solid.vertices) + np.array([0.1, 0.0, -0.05]), np.asarray(solid.faces))


def black_ball(points: FloatArray, views: FloatArray, light: FloatArray) -> FloatArray:
    """Dense and black within half the frame's radius."""
    found = np.full((len(points), 4), -20.0)
    found[:, 3] = np.where(np.linalg.norm(points, axis=1) < 0.5, DENSE, 0.0)
    return found


def test_the_ball_around_the_object_fills_the_papers_view() -> None:
    mesh = ball(0.03)
    camera = around(mesh, np.array([1.0, 0.0, 0.0]), SIZE, SIZE, DISTANCE)
    assert camera.focal_px == pytest.approx(FOCAL, rel=1e-9)


def test_a_solid_ball_is_drawn_where_it_is_and_the_rest_is_white() -> None:
    mesh = ball(0.03)
    middle, radius = ball_of(mesh)
    camera = around(mesh, np.array([0.6, 0.0, 0.8]), 64, 64, DISTANCE)
    field = UniformField(black_ball, middle, radius, 128)
    picture = field.picture(camera, DirectionalLight(np.array([0.0, 0.0, 1.0])))
    assert (picture[0, 0] == 255).all()
    assert (picture[32, 32] == 0).all()
    away = DISTANCE * mesh.diagonal / radius
    seen = np.pi * (camera.focal_px * np.tan(np.arcsin(0.5 / away))) ** 2
    assert (picture[..., 0] < 128).sum() == pytest.approx(seen, rel=0.06)


def test_what_a_field_holds_outside_of_the_ball_is_not_drawn() -> None:
    def black_outside(points: FloatArray, views: FloatArray, light: FloatArray) -> FloatArray:
        found = np.full((len(points), 4), -20.0)
        found[:, 3] = np.where(np.linalg.norm(points, axis=1) > 1.0, DENSE, 0.0)
        return found

    mesh = ball(0.03)
    camera = around(mesh, np.array([0.0, 1.0, 0.0]), 16, 16, DISTANCE)
    picture = UniformField(black_outside, *ball_of(mesh), 64).picture(
        camera, DirectionalLight(np.array([0.0, 0.0, 1.0]))
    )
    assert (picture == 255).all()


def test_networks_of_cells_are_drawn_where_the_object_is_in_their_colour(tmp_path: Path) -> None:
    of, light = box_file(tmp_path / "box"), DirectionalLight(np.array([0.0, 0.0, 1.0]))
    assert of.description.vision is not None
    camera = around(BOX, np.array([0.6, 0.3, 0.8]), 32, 32, DISTANCE)
    fields = CellFields(VisionNetworks(of.read(of.description.vision.network)), BOX, 8)
    picture, wanted = fields.picture(camera, light), open_vision(of, 1).picture(camera, light).image.display()
    covered, wanted_covered = ((each != 255).any(axis=2) for each in (picture, wanted))
    assert covered[wanted_covered].mean() > 0.95  # the others are pixels of an edge
    assert covered.sum() < 1.2 * wanted_covered.sum()  # by the voxels before the surface
    assert np.abs(picture[16, 16].astype(int) - wanted[16, 16]).max() <= 1


def test_colours_are_stretched_as_published() -> None:
    raw = np.array([-50.0, 0.0, 2.0, 50.0])
    assert stretched_sigmoid(raw) == pytest.approx(1.2 * (1.0 / (1.0 + np.exp(-raw)) - 0.5) + 0.5)


def test_places_within_a_closed_surface_are_told_from_those_without() -> None:
    mesh = ball(0.03)
    middle, _ = ball_of(mesh)
    random = np.random.default_rng(3)
    points = middle + 0.05 * (random.random((2000, 3)) - 0.5) * 2.0
    apart = np.linalg.norm(points - middle, axis=1)
    clear = np.abs(apart - 0.03) > 1e-3
    found = is_within(RayMesh(mesh), points, mesh.face_normals, random)
    assert (found[clear] == (apart < 0.03)[clear]).all()


def test_a_field_that_was_trained_for_seconds_beats_white_alone() -> None:
    pytest.importorskip("torch", reason="torch is in the extra `author`, which is not installed")
    from experiments.paper.look import ViewBench, open_field, shown
    from experiments.paper.rendering import FieldSpec
    from experiments.paper.rendering_training import train_field
    from harness.authoring.vision.data import held_out_pictures
    from harness.authoring.vision.metrics import reference_pictures
    from harness.sim.light.appearance_source import builtin_appearance
    from harness.sim.light.direct_image import LitObject

    lit = LitObject(builtin_appearance("bowl", edge=6e-3))
    views = held_out_pictures(lit.appearance.mesh, 1, 48, 48, 0, DISTANCE)
    bench = ViewBench(lit, views, tuple(shown(each) for each in reference_pictures(lit, views, 3)))
    spec = FieldSpec(depth=2, width=64, octaves=5, samples=64, places=60_000, steps=150, batch=2048)
    field = open_field(train_field(bench, spec, lambda doing, share: None), lit.appearance.mesh, 64)
    picture = field.picture(views.cameras[0], views.lights[0])
    white = bench.scores(0, np.full_like(picture, 255))["psnr_db"]
    assert bench.scores(0, picture)["psnr_db"] > white + 3.0
