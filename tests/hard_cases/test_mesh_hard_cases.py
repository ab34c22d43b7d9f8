"""Meshes as they come from scanners, exporters and broken disks."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import trimesh

from harness.basics.arrays import FloatArray, IntArray
from harness.basics.errors import MeshRefused, WrongUse
from harness.basics.mesh import Mesh
from harness.objects.household import build
from harness.sim.solid.intake import Intake, take_in

Soup = tuple[FloatArray, IntArray]


@pytest.fixture(scope="module")
def mug() -> Mesh:
    return build("mug", 5e-3)


def take(soup: Soup, tmp_path: Path) -> Intake:
    path = tmp_path / "case.off"
    vertices, faces = soup
    rows = [" ".join(f"{c:.9f}" for c in v) for v in vertices]
    rows += [f"3 {a} {b} {c}" for a, b, c in faces]
    path.write_text(f"OFF\n{len(vertices)} {len(faces)} 0\n" + "\n".join(rows) + "\n")
    return take_in(path, "m")


def closed_volume(mesh: Mesh) -> float:
    return float(trimesh.Trimesh(mesh.vertices, mesh.faces, process=False).volume)


def some(count: int, share: float) -> IntArray:
    return np.random.default_rng(5).choice(count, int(share * count), replace=False).astype(np.int64)


def every_face_alone(mesh: Mesh) -> Soup:
    return mesh.corners.reshape(-1, 3), np.arange(3 * len(mesh.faces)).reshape(-1, 3)


def a_third_turned_round(mesh: Mesh) -> Soup:
    faces = mesh.faces.copy()
    turned = some(len(faces), 0.3)
    faces[turned] = faces[turned][:, ::-1]
    return mesh.vertices, faces


def inside_out(mesh: Mesh) -> Soup:
    return mesh.vertices, mesh.faces[:, ::-1]


def some_faces_twice(mesh: Mesh) -> Soup:
    again = mesh.faces[some(len(mesh.faces), 0.2)]
    return mesh.vertices, np.vstack([mesh.faces, np.roll(again, 1, axis=1)])


def every_face_from_both_sides(mesh: Mesh) -> Soup:
    return mesh.vertices, np.vstack([mesh.faces, mesh.faces[:, ::-1]])


def collapsed_faces(mesh: Mesh) -> Soup:
    bad = mesh.faces[some(len(mesh.faces), 0.1)].copy()
    bad[:, 2] = bad[:, 1]
    return mesh.vertices, np.vstack([mesh.faces, bad])


def a_flap_pressed_flat(mesh: Mesh) -> Soup:
    a, b, _ = mesh.faces[7]
    tip = np.vstack([mesh.vertices, mesh.vertices[a] + [0.0, 0.0, 2e-3]])
    return tip, np.vstack([mesh.faces, [[a, b, len(tip) - 1], [b, a, len(tip) - 1]]])


def dust_beside_it(mesh: Mesh) -> Soup:
    speck = trimesh.creation.icosphere(subdivisions=1, radius=4e-4)
    vertices, faces = [mesh.vertices], [mesh.faces]
    for k in range(5):
        faces.append(speck.faces + sum(len(v) for v in vertices))
        vertices.append(speck.vertices + np.array([0.09, 0.01 * k, 0.05]))
    return np.vstack(vertices), np.vstack(faces)


def a_few_faces_missing(mesh: Mesh) -> Soup:
    centres = mesh.corners.mean(axis=1)
    far_apart = [int(np.argmin(np.linalg.norm(centres - p, axis=1))) for p in SPOTS]
    return mesh.vertices, np.delete(mesh.faces, far_apart, axis=0)


def unused_vertices_that_are_not_numbers(mesh: Mesh) -> Soup:
    return np.vstack([mesh.vertices, np.full((3, 3), np.nan)]), mesh.faces


def vertices_off_by_less_than_paper(mesh: Mesh) -> Soup:
    vertices, faces = every_face_alone(mesh)
    return vertices + np.random.default_rng(2).uniform(-2e-8, 2e-8, vertices.shape), faces


SPOTS = np.array([[-0.04, 0.0, 0.03], [0.0, 0.04, 0.06], [0.0, -0.04, 0.05]])

DAMAGE: dict[str, Callable[[Mesh], Soup]] = {
    damage.__name__: damage
    for damage in (
        every_face_alone,
        a_third_turned_round,
        inside_out,
        some_faces_twice,
        every_face_from_both_sides,
        collapsed_faces,
        a_flap_pressed_flat,
        dust_beside_it,
        a_few_faces_missing,
        unused_vertices_that_are_not_numbers,
        vertices_off_by_less_than_paper,
    )
}


@pytest.mark.parametrize("damage", DAMAGE)
def test_a_damaged_mug_is_the_mug_again(mug: Mesh, tmp_path: Path, damage: str) -> None:
    taken = take(DAMAGE[damage](mug), tmp_path)
    assert taken.report.watertight, taken.report
    assert taken.report.bodies == 1
    # A filled hole is flat where the wall was round: three 5 mm triangles of it.
    assert closed_volume(taken.mesh) == pytest.approx(closed_volume(mug), rel=1e-4)
    assert taken.mesh.bounds == pytest.approx(mug.bounds, abs=1e-6)
    if damage != "unused_vertices_that_are_not_numbers":
        assert taken.report.repairs


@pytest.mark.parametrize("turned", [False, True])
def test_an_open_cup_without_thickness_faces_the_room(tmp_path: Path, turned: bool) -> None:
    sphere = trimesh.creation.icosphere(subdivisions=4, radius=0.05)
    bottom = np.asarray(sphere.vertices)[sphere.faces][:, :, 2].mean(axis=1) < 0.02
    faces = np.asarray(sphere.faces)[bottom]
    taken = take((np.asarray(sphere.vertices), faces[:, ::-1] if turned else faces), tmp_path)
    outward = np.einsum("ij,ij->i", taken.mesh.face_normals, taken.mesh.corners.mean(axis=1))
    assert (outward > 0.0).all()
    assert not taken.report.watertight
    assert taken.report.mass(2500.0) is None
    assert any("open" in warning for warning in taken.report.warnings)


def test_the_wall_of_a_cavity_faces_into_the_cavity(tmp_path: Path) -> None:
    outer = trimesh.creation.icosphere(subdivisions=3, radius=0.05)
    inner = trimesh.creation.icosphere(subdivisions=3, radius=0.04)
    vertices = np.vstack([outer.vertices, inner.vertices])
    taken = take((vertices, np.vstack([outer.faces, inner.faces + len(outer.vertices)])), tmp_path)
    assert taken.report.volume == pytest.approx(outer.volume - inner.volume, rel=1e-6)


def test_overlapping_bodies_become_one_skin(tmp_path: Path) -> None:
    one = trimesh.creation.box((0.1, 0.02, 0.02))
    other = trimesh.creation.box((0.02, 0.1, 0.02))
    other.apply_translation((0.001, 0.0, 0.003))
    vertices = np.vstack([one.vertices, other.vertices])
    taken = take((vertices, np.vstack([one.faces, other.faces + len(one.vertices)])), tmp_path)
    assert taken.report.bodies == 1
    assert taken.report.volume == pytest.approx(2 * 4e-5 - 0.02 * 0.02 * 0.017, rel=1e-5)


def test_two_pieces_that_do_not_touch_are_one_object_with_a_warning(tmp_path: Path) -> None:
    box = trimesh.creation.box((0.03, 0.03, 0.03))
    vertices = np.vstack([box.vertices, box.vertices + np.array([0.1, 0.0, 0.0])])
    taken = take((vertices, np.vstack([box.faces, box.faces + 8])), tmp_path)
    assert taken.report.bodies == 2
    assert any("pieces" in warning for warning in taken.report.warnings)


def test_a_soup_of_a_thousand_loose_triangles_is_taken_as_it_is(tmp_path: Path) -> None:
    rng = np.random.default_rng(1)
    vertices = rng.uniform(0.0, 0.1, (3000, 3))
    taken = take((vertices, np.arange(3000).reshape(-1, 3)), tmp_path)
    assert len(taken.mesh.faces) == 1000
    assert any("patches" in repair for repair in taken.report.repairs)


TRIANGLE = "OFF\n3 1 0\n0 0 0\n0.1 0 0\n0 0.1 0\n3 0 1 2\n"
POINT = "OFF\n4 4 0\n" + "1 1 1\n" * 4 + "3 0 1 2\n3 0 2 3\n3 0 3 1\n3 1 3 2\n"
LINE = "OFF\n4 4 0\n0 0 0\n.1 0 0\n.2 0 0\n.3 0 0\n3 0 1 2\n3 0 2 3\n3 0 3 1\n3 1 3 2\n"
TETRAHEDRON = "OFF\n4 4 0\n0 0 0\n.1 0 0\n0 .1 0\n0 0 {z}\n3 0 2 1\n3 0 1 3\n3 1 2 3\n3 0 3 2\n"

HOPELESS = {
    "empty.obj": (b"", "empty"),
    "only_words.obj": (b"this is not a mesh\n", "triangle"),
    "only_points.obj": (b"v 0 0 0\nv 1 0 0\nv 0 1 0\n", "triangle"),
    "noise.stl": (bytes(range(256)) * 3, "cut short"),
    "cut_short.stl": (
        b"\0" * 80 + (5000).to_bytes(4, "little") + b"\0" * 400,
        "5000 triangles.* 8 ",
    ),
    "noise.ply": (b"ply\nformat ascii 1.0\nelement vertex 9\n", "cut short"),
    "unknown.xyzzy": (b"data", "is not that of a mesh"),
    "one_triangle.off": (TRIANGLE.encode(), "4 faces .*area"),
    "all_in_a_point.off": (POINT.encode(), "point"),
    "all_on_a_line.off": (LINE.encode(), "4 faces .*area|triangle"),
    "not_a_number.off": (TETRAHEDRON.format(z="nan").encode(), "finite"),
    "infinite.off": (TETRAHEDRON.format(z="inf").encode(), "finite"),
    "beyond_the_vertices.obj": (b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n", "vertex 9.* 3 vertices"),
}


@pytest.mark.parametrize("name", HOPELESS)
def test_a_hopeless_file_is_refused_with_its_reason(tmp_path: Path, name: str) -> None:
    content, reason = HOPELESS[name]
    (tmp_path / name).write_bytes(content)
    with pytest.raises(MeshRefused, match=reason) as refused:
        take_in(tmp_path / name, "m")
    assert "\n" not in str(refused.value)
    assert name in str(refused.value)


def test_one_stray_vertex_far_away_is_a_matter_of_size_and_welds_nothing(mug: Mesh, tmp_path: Path) -> None:
    vertices = mug.vertices.copy()
    vertices[11] = [0.0, 0.0, 1e9]
    with pytest.raises(MeshRefused, match=r"1e\+09 m.*5 mm to 2 m"):
        take((vertices, mug.faces), tmp_path)


def test_a_missing_file_is_refused(tmp_path: Path) -> None:
    with pytest.raises(WrongUse, match=r"nowhere\.stl"):
        take_in(tmp_path / "nowhere.stl", "m")
