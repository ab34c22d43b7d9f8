"""Solids that meet keep their volume: joined in a face they are one, at an edge or a point they are two."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh

from harness.basics.arrays import FloatArray
from harness.sim.solid.intake import take_in
from tests.oracles.volume_meshes import box

SIDES = np.array([30.0, 20.0, 10.0])
APART = {
    "a face": (SIDES * [1, 0, 0], 1),
    "a part of a face": (SIDES * [1, 0.5, 0.5], 1),
    "an edge": (SIDES * [1, 1, 0], 2),
    "a point": (SIDES, 2),
}


def block(at: FloatArray, mirrored: bool = False) -> trimesh.Trimesh:
    """Mirrored, the diagonals of its faces lie the other way."""
    surface = box(tuple(SIDES), (1, 1, 1)).surface
    places, faces = surface.vertices - surface.vertices.min(axis=0), surface.faces
    if mirrored:
        places, faces = np.column_stack([places[:, 0], SIDES[1] - places[:, 1], places[:, 2]]), faces[:, ::-1]
    return trimesh.Trimesh(places + at, faces, process=False)


def written(mesh: Any, path: Path) -> None:
    mesh.export(path)


@pytest.mark.parametrize("mirrored", [False, True])
@pytest.mark.parametrize("suffix", ["stl", "ply"])
@pytest.mark.parametrize("meet", APART)
def test_two_blocks_hold_what_each_holds(meet: str, suffix: str, mirrored: bool, tmp_path: Path) -> None:
    at, pieces = APART[meet]
    both = trimesh.util.concatenate([block(np.zeros(3)), block(at, mirrored)])
    written(both, tmp_path / f"both.{suffix}")
    taken = take_in(tmp_path / f"both.{suffix}", "mm")
    assert taken.report.watertight
    assert taken.report.bodies == pieces
    assert taken.report.volume == pytest.approx(2 * SIDES.prod() * 1e-9, rel=1e-6)
    middles = taken.mesh.corners.mean(axis=1)
    if meet == "a face":
        assert not np.isclose(middles[:, 0], 0.03, atol=1e-5).any(), "a wall is left inside"


def test_a_stack_of_blocks_is_one(tmp_path: Path) -> None:
    written(trimesh.util.concatenate([block(SIDES * [0, 0, k]) for k in range(5)]), tmp_path / "stack.stl")
    report = take_in(tmp_path / "stack.stl", "mm").report
    assert (report.bodies, report.watertight) == (1, True)
    assert report.volume == pytest.approx(5 * SIDES.prod() * 1e-9, rel=1e-6)
