"""The body of an object of hidden size: filled as it is drawn, and scaled."""

from pathlib import Path

import numpy as np
import pytest

from harness.basics.materials import MATERIALS
from harness.basics.mesh import Mesh
from harness.basics.store import Store
from harness.sim.modal.modal import solve_modes
from harness.sim.solid.tetrahedra import Tetrahedra, tetrahedralize
from mocks.world import instrument
from tests.oracles.volume_meshes import box

CERAMIC = MATERIALS["ceramic"]


@pytest.fixture(scope="module")
def drawn() -> Mesh:
    """100 x 30 x 12 mm."""
    return box((0.1, 0.03, 0.012), (8, 3, 2)).surface


def body_of(drawn: Mesh, scale: float, store: Store) -> Tetrahedra:
    solid = Mesh(scale * drawn.vertices, drawn.faces)
    return instrument._scaled_body(solid, drawn, scale, 5.0e-3 * scale**0.5, store).fill()


@pytest.mark.slow  # what it compares is exact but for the filling
def test_it_rings_as_one_that_was_filled_at_its_own_size(drawn: Mesh, tmp_path: Path) -> None:
    scale = 1.6
    scaled = solve_modes(body_of(drawn, scale, Store(tmp_path)), CERAMIC, 40e3)
    own = Mesh(scale * drawn.vertices, drawn.faces)
    direct = solve_modes(tetrahedralize(own, 5.0e-3 * scale**0.5), CERAMIC, 40e3)
    count = min(len(scaled.frequencies), len(direct.frequencies), 7)
    assert count >= 6
    assert scaled.frequencies[:count] == pytest.approx(direct.frequencies[:count], rel=0.01)
    assert scaled.mass == pytest.approx(direct.mass, rel=1e-4)


def test_sizes_that_are_near_each_other_share_one_filling(
    drawn: Mesh, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    fills: list[float] = []

    def counted(mesh: Mesh, edge: float) -> Tetrahedra:
        fills.append(edge)
        return tetrahedralize(mesh, edge)

    monkeypatch.setattr(instrument, "tetrahedralize", counted)
    store = Store(tmp_path)
    for scale in np.geomspace(0.7, 1.4, 12):
        body_of(drawn, float(scale), store)
    rungs = np.log(2.0**0.5) / np.log(instrument.RUNG)
    assert 2 <= len(fills) <= rungs + 2
