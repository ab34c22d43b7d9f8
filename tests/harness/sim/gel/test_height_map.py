"""The z-buffer: laws of geometry, and an independent ray caster as the oracle."""

import dataclasses

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st

from harness.basics import geometry
from harness.basics.arrays import FloatArray
from harness.basics.errors import MeshRefused, OutOfDomain
from harness.basics.mesh import Mesh
from harness.bench.sensor import GELSIGHT_R15
from harness.sim.gel.height_map import RasterMesh, depth_image, height_maps, penetration, rest_surface

SENSOR = GELSIGHT_R15
RADIUS = 12e-3


def _sphere(subdivisions: int = 5) -> Mesh:
    ball = trimesh.creation.icosphere(subdivisions=subdivisions, radius=RADIUS)
    return Mesh(np.asarray(ball.vertices), np.asarray(ball.faces))


def _box(size: tuple[float, float, float], centre: tuple[float, float, float] = (0.0, 0.0, 0.0)) -> Mesh:
    box = trimesh.creation.box(extents=size)
    return Mesh(np.asarray(box.vertices) + np.array(centre), np.asarray(box.faces))


def _pixel_xy() -> tuple[FloatArray, FloatArray]:
    x = (np.arange(SENSOR.columns) + 0.5 - SENSOR.columns / 2) * SENSOR.pitch
    y = (np.arange(SENSOR.rows) + 0.5 - SENSOR.rows / 2) * SENSOR.pitch
    return np.broadcast_to(x, (SENSOR.rows, SENSOR.columns)), np.broadcast_to(
        y[:, None], (SENSOR.rows, SENSOR.columns)
    )


def _pressed(depth: float) -> FloatArray:
    return geometry.translation(np.array([0.0, 0.0, RADIUS - depth]))


def test_a_sphere_reads_as_a_sphere() -> None:
    gap = height_maps(RasterMesh(_sphere()), _pressed(1e-3)[None], SENSOR)[0]
    x, y = _pixel_xy()
    true = (
        RADIUS - 1e-3 - np.sqrt(RADIUS**2 - x**2 - y**2, where=x**2 + y**2 < RADIUS**2, out=np.zeros_like(x))
    )
    inner = x**2 + y**2 < (0.8 * RADIUS) ** 2
    mesh = _sphere()
    sag = RADIUS - np.einsum("ij,ij->i", mesh.face_normals, mesh.corners[:, 0]).min()
    # A facet lies at most its sag inside the sphere; along z that is more by 1 / cos(slope), cos = 0.6 here.
    assert np.abs(gap - true)[inner].max() < sag / 0.6
    assert penetration(gap, SENSOR).max() == pytest.approx(1e-3, abs=sag)


def _cast(mesh: Mesh, origins: FloatArray) -> FloatArray:
    """Least z of the surface on lines along z: Moller and Trumbore 1997, every face against every line."""
    a, e1 = mesh.corners[:, 0], mesh.corners[:, 1] - mesh.corners[:, 0]
    e2 = mesh.corners[:, 2] - mesh.corners[:, 0]
    direction = np.array([0.0, 0.0, 1.0])
    p = np.cross(direction, e2)
    det = (e1 * p).sum(axis=1)
    with np.errstate(divide="ignore", invalid="ignore"):
        s = origins[:, None, :] - a
        u = (s * p).sum(axis=-1) / det
        q = np.cross(s, e1)
        v = (q @ direction) / det
        t = (e2 * q).sum(axis=-1) / det
        hit = (u >= 0) & (v >= 0) & (u + v <= 1)
    least: FloatArray = np.where(hit, t, np.inf).min(axis=1)
    return least


@settings(max_examples=15, deadline=None)
@given(seed=st.integers(0, 2**32 - 1))
def test_every_line_agrees_with_a_ray_caster(seed: int) -> None:
    rng = np.random.default_rng(seed)
    mesh = _sphere(2)
    mesh = Mesh(
        mesh.vertices * rng.uniform(0.5, 1.5, 3) + rng.normal(0, 0.4e-3, mesh.vertices.shape), mesh.faces
    )
    rotation = geometry.rotation_from_quaternion(rng.normal(size=4))
    pose = geometry.transform(rotation, np.array([*rng.normal(0, 3e-3, 2), 10e-3]))
    gap = height_maps(RasterMesh(mesh), pose[None], SENSOR)[0]
    x, y = _pixel_xy()
    pick = rng.choice(x.size, 300, replace=False)
    origins = np.stack([x.ravel()[pick], y.ravel()[pick], np.full(300, -50e-3)], axis=1)
    cast = _cast(Mesh(geometry.apply(pose, mesh.vertices), mesh.faces), origins) - 50e-3
    cast[cast > 20e-3] = np.inf
    drawn = gap.ravel()[pick]
    assert np.array_equal(np.isfinite(drawn), np.isfinite(cast))
    seen = np.isfinite(drawn)
    assert np.abs(drawn[seen] - cast[seen]).max(initial=0.0) < 1e-9


@settings(max_examples=20, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), deeper=st.floats(0.0, 2e-3))
def test_pressing_deeper_moves_the_whole_map_by_as_much(seed: int, deeper: float) -> None:
    rng = np.random.default_rng(seed)
    rotation = geometry.rotation_from_quaternion(rng.normal(size=4))
    poses = np.stack(
        [geometry.transform(rotation, np.array([0, 0, RADIUS - d])) for d in (0.5e-3, 0.5e-3 + deeper)]
    )
    shallow, deep = height_maps(RasterMesh(_sphere(3)), poses, SENSOR)
    seen = np.isfinite(shallow)
    assert np.array_equal(seen, np.isfinite(deep))
    assert np.allclose(shallow[seen] - deeper, deep[seen], atol=1e-12)


def test_a_batch_reads_as_its_members_one_by_one() -> None:
    raster = RasterMesh(_sphere(3))
    poses = np.stack([_pressed(d) for d in (0.2e-3, 1e-3, 1.5e-3)])
    together = height_maps(raster, poses, SENSOR)
    assert all(
        np.array_equal(height_maps(raster, p[None], SENSOR)[0], t)
        for p, t in zip(poses, together, strict=True)
    )


def test_no_line_falls_between_two_triangles() -> None:
    # Vertices and edges exactly on pixel centres are where a careless fill rule leaves holes.
    fine = np.arange(-40, 41) * SENSOR.pitch / 2
    x, y = np.meshgrid(fine, fine)
    vertices = np.stack([x.ravel(), y.ravel(), np.zeros(x.size)], axis=1)
    at = np.arange(x.size).reshape(x.shape)
    quads = np.stack([at[:-1, :-1], at[:-1, 1:], at[1:, 1:], at[1:, :-1]], axis=-1).reshape(-1, 4)
    faces = np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
    gap = height_maps(RasterMesh(Mesh(vertices, faces)), np.eye(4)[None], SENSOR)[0]
    px, py = _pixel_xy()
    inside = (np.abs(px) < 20 * SENSOR.pitch) & (np.abs(py) < 20 * SENSOR.pitch)
    assert np.isfinite(gap[inside]).all()
    assert np.isinf(gap[~inside]).all()


def test_the_face_that_is_named_is_the_one_met() -> None:
    mesh = _sphere(3)
    image = depth_image(RasterMesh(mesh), np.eye(4), 0.5e-3, 60, 61)
    i, j = np.nonzero(np.isfinite(image.depth))
    assert np.array_equal(image.face >= 0, np.isfinite(image.depth))
    met = mesh.corners[image.face[i, j], 0]
    normals = mesh.face_normals[image.face[i, j]]
    point = np.stack([(j + 0.5 - 30.5) * 0.5e-3, (i + 0.5 - 30) * 0.5e-3, image.depth[i, j]], axis=1)
    assert np.abs(((point - met) * normals).sum(axis=1)).max() < 1e-9
    assert (normals[:, 2] < 0).all()


def test_what_is_behind_the_stand_off_is_not_seen() -> None:
    # A gel inside a hollow thing touches the wall before it, not the one behind its back.
    front, back = _box((0.1, 0.1, 0.002), (0, 0, 0.0005)), _box((0.1, 0.1, 0.002), (0, 0, -0.08))
    both = Mesh(
        np.concatenate([front.vertices, back.vertices]),
        np.concatenate([front.faces, back.faces + len(front.vertices)]),
    )
    gap = height_maps(RasterMesh(both), np.eye(4)[None], SENSOR)[0]
    assert gap == pytest.approx(np.full_like(gap, -0.0005), abs=1e-15)


def test_no_object_is_infinity_and_presses_nothing() -> None:
    gap = height_maps(RasterMesh(_sphere(2)), geometry.translation(np.array([0.0, 0.0, 0.5]))[None], SENSOR)
    assert np.isposinf(gap).all()
    assert not penetration(gap, SENSOR).any()


def test_a_dome_meets_a_plane_at_its_centre_first() -> None:
    dome = dataclasses.replace(SENSOR, gel_radius=28.43e-3)
    gap = np.full((1, SENSOR.rows, SENSOR.columns), -0.2e-3)
    pressed = penetration(gap, dome)[0]
    assert pressed[60, 80] == pytest.approx(0.2e-3, rel=1e-2)
    assert pressed[0, 0] == 0.0
    assert rest_surface(dome)[0, 0] == pytest.approx(
        28.43e-3 * (np.cos(np.arcsin(np.hypot(79.5, 59.5) * 0.1245 / 28.43)) - 1), rel=1e-12
    )


def test_what_cannot_be_drawn_is_refused_and_named() -> None:
    raster = RasterMesh(_sphere(1))
    poses = np.stack([np.eye(4)] * 3)
    poses[2, 1, 3] = np.nan
    with pytest.raises(OutOfDomain, match="pose 2 of 3"):
        height_maps(raster, poses, SENSOR)
    with pytest.raises(OutOfDomain, match="pose 0 of 1"):
        height_maps(raster, np.diag([-1.0, 1, 1, 1])[None], SENSOR)
    with pytest.raises(OutOfDomain, match="n, 4, 4"):
        height_maps(raster, np.eye(4), SENSOR)
    with pytest.raises(OutOfDomain, match="contact 1"):
        penetration(np.stack([np.zeros((2, 2)), np.full((2, 2), np.nan)]), SENSOR)
    with pytest.raises(OutOfDomain, match="dome"):
        rest_surface(dataclasses.replace(SENSOR, gel_radius=5e-3))
    with pytest.raises(OutOfDomain, match="pitch"):
        depth_image(raster, np.eye(4), 0.0, 4, 4)
    with pytest.raises(MeshRefused):
        RasterMesh(Mesh(np.zeros((0, 3)), np.zeros((0, 3), np.int64)))
