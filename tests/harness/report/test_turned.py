"""A surface that a reader turns: few faces that look like all of them, and a script that draws it."""

import base64
import json
import shutil
import subprocess
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh
from matplotlib.path import Path as Polygon

from harness.basics.faces.nearest_surface import NearestSurface
from harness.basics.mesh import Mesh
from harness.objects.builtin import build
from harness.report.figures.shape import KnownSurface, seen_from
from harness.report.turned import fewer_faces, turned_surface

MUG = build("mug", 4e-3)
CONTACTS = np.array([[0.04, 0.0, 0.05], [-0.04, 0.0, 0.03]])


def shown(mesh: Mesh = MUG) -> KnownSurface:
    return KnownSurface(mesh, 1e-3 + 0.05 * mesh.vertices[:, 2].clip(0.0), CONTACTS, ())


def numbers(text: str, kind: str) -> np.ndarray[Any, Any]:
    return np.frombuffer(base64.b64decode(text), kind).reshape(-1, 3)


def test_few_faces_are_kept_as_they_are() -> None:
    mesh, values = fewer_faces(MUG, MUG.vertices[:, 2], len(MUG.faces))
    assert mesh is MUG
    assert np.array_equal(values, MUG.vertices[:, 2])


@pytest.mark.parametrize("name", ["mug", "plate", "wrench"])
@pytest.mark.parametrize("most", [1000, 4000])
def test_fewer_faces_lie_near_the_surface_and_carry_its_values(name: str, most: int) -> None:
    mesh = build(name, 3e-3)
    found, values = fewer_faces(mesh, mesh.vertices[:, 2], most)
    assert 0.3 * most < len(found.faces) <= most
    assert np.isfinite(found.vertices).all()
    assert float(NearestSurface(mesh).distances(found.vertices).max()) < 4e-3
    assert values == pytest.approx(found.vertices[:, 2], abs=1e-12)


def test_the_two_sides_of_a_thin_wall_stay_apart() -> None:
    made = trimesh.creation.box((0.1, 0.1, 1e-3)).subdivide_to_size(2e-3)
    board = Mesh(made.vertices + np.array([0.0, 0.0, 1e-3]), made.faces)  # within one layer of cells
    found, _ = fewer_faces(board, board.vertices[:, 2], 800)
    within = (np.abs(found.vertices[:, :2]) < 0.045).all(axis=1)
    assert np.abs(found.vertices[within, 2] - 1e-3) == pytest.approx(0.5e-3, abs=1e-6)


def test_places_and_colours_are_those_of_the_surface() -> None:
    surface = turned_surface(shown(), most_faces=len(MUG.faces))
    places, colours = numbers(surface.places, "<i2"), numbers(surface.colours, "u1")
    middle = MUG.bounds.mean(axis=0)
    step = np.abs(MUG.vertices - middle).max() / np.abs(places).max()
    assert step * places == pytest.approx(MUG.vertices - middle, abs=1e-5)
    assert step * numbers(surface.marks, "<i2") == pytest.approx(CONTACTS - middle, abs=1e-5)
    assert np.array_equal(numbers(surface.faces, "<u2"), MUG.faces)
    low, high = MUG.vertices[:, 2].argmin(), MUG.vertices[:, 2].argmax()
    assert colours[low].sum() > colours[high].sum() + 200  # the pale end is the well known one


def drawn_by_node(tmp_path: Path, surface: KnownSurface) -> dict[str, Any]:
    node = shutil.which("node")
    if node is None:
        pytest.skip("node is not there to run the page's script")
    page = tmp_path / "page.html"
    page.write_text(" ".join(f'data-{k}="{v}"' for k, v in vars(turned_surface(surface)).items()))
    script = files("harness.report") / "turned.js"
    done = subprocess.run(
        [node, str(Path(__file__).with_name("turned_canvas.js")), str(script), str(page)],
        capture_output=True,
        check=True,
        timeout=600,
    )
    found: dict[str, Any] = json.loads(done.stdout)
    return found


def test_the_script_shows_the_surface_and_turns_it_by_a_drag_and_a_key(tmp_path: Path) -> None:
    found = drawn_by_node(tmp_path, shown())
    assert found["hidden"] is False
    marks = [one for one in found["first"] if len(one["path"]) == 1]
    assert len(marks) == len(CONTACTS)
    corners = np.array([one["path"] for one in found["first"] if len(one["path"]) == 3])
    assert len(corners) > 500
    # Within the canvas, in its middle, and as large as it can be turned.
    assert corners.min() >= 0.0
    assert corners[:, :, 1].max() <= 400.0
    assert corners.reshape(-1, 2).mean(axis=0) == pytest.approx([300.0, 200.0], abs=40.0)
    assert found["untouched"] == found["back"] == found["first"]
    assert found["dragged"] != found["first"]
    assert found["key"] != found["first"]


@pytest.mark.parametrize("order", [(0, 1), (1, 0)])
def test_what_is_nearer_to_the_viewer_hides_what_is_behind(tmp_path: Path, order: tuple[int, int]) -> None:
    towards = seen_from(-55.0, 35.0)[2]
    ball = trimesh.creation.icosphere(2, 0.03)
    balls = [ball.vertices + way * 0.05 * towards for way in (1.0, -1.0)]
    vertices = np.concatenate([balls[k] for k in order])
    mesh = Mesh(vertices, np.concatenate([ball.faces, ball.faces + len(ball.vertices)]))
    near = mesh.vertices @ towards > 0.0
    surface = KnownSurface(mesh, np.where(near, 1e-4, 1e-2), np.zeros((0, 3)), ())
    drawn = drawn_by_node(tmp_path, surface)["first"]
    covering = [one for one in drawn if Polygon(one["path"]).contains_point((300.3, 199.6))]
    assert len(covering) == 2
    brightness = [sum(map(int, one["colour"][4:-1].split(","))) for one in covering]
    assert brightness[1] > brightness[0]  # the nearer is the better known, and pale
