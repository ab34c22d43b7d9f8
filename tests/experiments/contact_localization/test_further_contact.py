"""A further contact is recommended only where one can distinguish the places that stay likely."""

import numpy as np
import pytest
import trimesh

from experiments.contact_localization.report.result import further_contact
from harness.basics.arrays import FloatArray
from harness.basics.mesh import Mesh
from harness.basics.symmetry import find_symmetries
from harness.objects.builtin import build

BALL = trimesh.creation.icosphere(subdivisions=4, radius=0.04)
CUP = trimesh.creation.cylinder(radius=0.03, height=0.1, sections=96).subdivide().subdivide()


@pytest.mark.parametrize(
    ("mesh", "places", "helps"),
    [
        (Mesh(BALL.vertices, BALL.faces), [[0.04, 0.0, 0.0], [0.0, 0.0, 0.04]], False),
        (Mesh(CUP.vertices, CUP.faces), [[0.03, 0.0, 0.02], [0.0, 0.03, 0.02]], False),
        (Mesh(CUP.vertices, CUP.faces), [[0.03, 0.0, 0.02], [0.0, 0.03, 0.02], [0.0, 0.03, 0.04]], True),
        (build("mug"), [[0.04, 0.0, 0.05], [0.0, 0.04, 0.05]], True),
    ],
)
def test_a_further_contact_is_recommended_where_it_can_help(
    mesh: Mesh, places: list[list[float]], helps: bool
) -> None:
    points: list[FloatArray] = [np.array(place) for place in places]
    said = further_contact(points, find_symmetries(mesh), mesh)
    assert ("symmetry" in said) is not helps
