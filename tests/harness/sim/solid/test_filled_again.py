"""A filling that lost a neck is made again, more closely, and refused only when that fails too."""

import numpy as np
import pytest

from harness.basics.arrays import FloatArray, IntArray
from harness.basics.errors import MeshRefused
from harness.sim.solid import tetrahedra as filling
from harness.sim.solid.tetrahedra import joined_by_faces, tetrahedra, tetrahedralize
from tests.oracles.volume_meshes import box

EDGE = 5e-3
TWO_AT_AN_EDGE = np.array([[0, 1, 2, 3], [0, 1, 4, 5]])
TWO_AT_A_FACE = np.array([[0, 1, 2, 3], [0, 1, 2, 4]])
BAR = box((0.06, 0.01, 0.01), (6, 1, 1))


def torn() -> tuple[FloatArray, IntArray]:
    """The bar without the cells of its middle, 4 % of it."""
    whole = box((0.06, 0.01, 0.01), (50, 1, 1))
    middles = whole.nodes[whole.cells].mean(axis=1)[:, 0]
    middle = whole.nodes[:, 0].mean()
    return whole.nodes, whole.cells[np.abs(middles - middle) > 1.2e-3]


@pytest.mark.parametrize(("cells", "parts"), [(TWO_AT_AN_EDGE, 2), (TWO_AT_A_FACE, 1)])
def test_cells_that_share_an_edge_only_are_two_parts(cells: IntArray, parts: int) -> None:
    assert joined_by_faces(cells) == parts


@pytest.mark.parametrize("failures", [1, 2])
def test_a_lost_neck_is_filled_again_more_closely(monkeypatch: pytest.MonkeyPatch, failures: int) -> None:
    fills: list[tuple[float, float]] = []

    def fill(_mesh: object, edge: float, envelope: float, _stop: float) -> tuple[FloatArray, IntArray]:
        fills.append((edge, envelope))
        return torn() if len(fills) <= failures else (BAR.nodes, BAR.cells)

    monkeypatch.setattr(filling, "_filled", fill)
    found = tetrahedralize(BAR.surface, EDGE)
    assert found.bodies == 1
    assert len(fills) == failures + 1
    edges, envelopes = np.array(fills).T
    assert (np.diff(envelopes) < 0.0).all()
    assert (np.diff(edges) <= 0.0).all()


def test_a_neck_that_no_filling_keeps_is_refused_without_naming_an_option(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(filling, "_filled", lambda *_: torn())
    with pytest.raises(MeshRefused, match=r"\b2 bodies .* 1\b") as refused:
        tetrahedralize(BAR.surface, EDGE)
    assert "--" not in str(refused.value)
    assert tetrahedra(*torn()).bodies == 2
