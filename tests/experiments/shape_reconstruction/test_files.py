"""What is written of a surface is read back."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh

from experiments.shape_reconstruction.files import FORMATS, write_surface
from experiments.shape_reconstruction.surface import SEEN, SUPPOSED, TOUCHED, ShapeEstimate
from harness.objects.builtin import build


@pytest.mark.parametrize("kind", FORMATS)
def test_every_file_has_the_surface_in_metres(tmp_path: Path, kind: str) -> None:
    mesh = build("mug", edge=8e-3)
    count = len(mesh.vertices)
    deviation = np.linspace(1e-3, 5e-3, count)
    known_by = np.arange(count) % 3
    write_surface(ShapeEstimate(mesh, deviation, known_by, (), {}, (), 0.0), tmp_path, "shape")
    found: Any = trimesh.load(tmp_path / f"shape.{kind}", force="mesh", process=False)
    assert found.vertices[found.faces] == pytest.approx(mesh.corners, abs=1e-7)
    if kind == "ply":
        attributes = found.metadata["_ply_raw"]["vertex"]["data"]
        assert np.asarray(attributes["deviation"]).ravel() == pytest.approx(deviation, rel=1e-6)
        assert set(np.asarray(attributes["known_by"]).ravel().tolist()) == {SUPPOSED, SEEN, TOUCHED}
    assert [path.name for path in tmp_path.glob(".*")] == []
