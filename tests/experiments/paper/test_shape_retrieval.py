"""Choosing among known meshes: the right one at its size, turn and place, and bent to the contacts."""

from pathlib import Path

import numpy as np
import pytest
import trimesh

from experiments.paper.shape_retrieval import (
    EACH,
    LibraryShape,
    by_retrieval,
    household_library,
    library_of,
)
from experiments.shape_reconstruction.metric import shape_error
from harness.basics.errors import FitRefused, MeshRefused, WrongUse
from harness.basics.geometry import rotation_about
from harness.basics.mesh import Mesh
from harness.objectfile.surface_file import ply_bytes
from harness.objects.builtin import build
from harness.sim.solid.household.families import FAMILIES
from tests.experiments.shape_reconstruction.touched import evidence_of, look_at, presses

NAMES = ("mug", "bowl", "wrench", "tray")
LIBRARY = [LibraryShape.of(name, build(name, 8e-3)) for name in NAMES]


@pytest.mark.parametrize("name", ["mug", "wrench"])
@pytest.mark.parametrize("scale", [0.8, 1.3])
def test_the_object_itself_is_found_at_any_size_turn_and_place(name: str, scale: float) -> None:
    turn = rotation_about(np.array([0.0, 0.0, 1.0]), 2.0)
    drawn = build(name, 8e-3)
    truth = Mesh(scale * drawn.vertices @ turn.T + [0.02, -0.01, 0.0], drawn.faces)
    answer = by_retrieval(evidence_of(presses(truth, 24, seed=1), look_at(truth)), LIBRARY)
    best = answer.ranked[0]
    assert best.shape.name == name
    longest = scale * float(np.ptp(drawn.vertices, axis=0).max())
    assert best.size == pytest.approx(longest, rel=0.05)
    assert shape_error(answer.mesh, truth, samples=3000).chamfer < 2.5e-3
    assert trimesh.Trimesh(answer.mesh.vertices, answer.mesh.faces, process=False).is_watertight
    assert np.isfinite(answer.deviation).all()


def test_without_the_object_the_answer_is_less_sure_and_costs_more() -> None:
    evidence = evidence_of(presses(build("mug", 8e-3), 24, seed=1))
    known, strange = by_retrieval(evidence, LIBRARY), by_retrieval(evidence, LIBRARY[1:])
    assert known.ranked[0].cost < strange.ranked[0].cost
    assert np.median(strange.deviation) > np.median(known.deviation)


def test_the_shipped_library_is_of_household_shapes_the_same_again() -> None:
    found = household_library()
    assert len(found) == EACH * len(FAMILIES)
    assert len({shape.name for shape in found}) == len(found)
    household_library.cache_clear()
    assert all(
        np.array_equal(one.mesh.vertices, again.mesh.vertices)
        for one, again in zip(found, household_library(), strict=True)
    )


def test_a_mesh_of_another_size_is_the_same_shape() -> None:
    small, large = (
        LibraryShape.of("bowl", Mesh(s * build("bowl", 8e-3).vertices, build("bowl", 8e-3).faces))
        for s in (0.01, 70.0)
    )
    assert small.mesh.vertices == pytest.approx(large.mesh.vertices)
    assert float(np.ptp(small.mesh.vertices, axis=0).max()) == pytest.approx(1.0)
    assert small.mesh.bounds[0, 2] == pytest.approx(0.0)


def test_a_folder_gives_its_closed_meshes_and_names_the_others(tmp_path: Path) -> None:
    bowl = build("bowl", 8e-3)
    (tmp_path / "bowl.ply").write_bytes(ply_bytes(bowl))
    (tmp_path / "open.ply").write_bytes(ply_bytes(Mesh(bowl.vertices, bowl.faces[:-40])))
    (tmp_path / "empty.stl").write_bytes(b"")
    (tmp_path / "notes.txt").write_text("no mesh")
    shapes, left_out = library_of(tmp_path)
    assert "bowl.ply" in [shape.name for shape in shapes]
    assert any("empty.stl" in reason for reason in left_out)
    with pytest.raises(MeshRefused, match=r"open .*closed"):
        LibraryShape.of("open", Mesh(bowl.vertices, bowl.faces[:-40]))


def test_no_folder_no_shape_and_no_contact_are_refused_by_name(tmp_path: Path) -> None:
    with pytest.raises(WrongUse, match="nowhere"):
        library_of(tmp_path / "nowhere")
    with pytest.raises(WrongUse, match=r"\.ply.*ObjectFiles"):
        library_of(tmp_path)
    with pytest.raises(FitRefused):
        by_retrieval(evidence_of(()), LIBRARY)
