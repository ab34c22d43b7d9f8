"""The four-node cells that benchmarks compare with are what they claim to be."""

import numpy as np
import pytest
from threadpoolctl import threadpool_limits

from harness.basics.materials import MATERIALS
from harness.sim.modal.lanczos import modes_below
from harness.sim.solid.tetrahedra import Tetrahedra, tetrahedra
from tests.oracles.exact_solids import exact_ball
from tests.oracles.four_node import four_node_system

STEEL = MATERIALS["steel"]


def ball(count: int) -> Tetrahedra:
    mesh = exact_ball(0.03, count)
    corners = int(mesh.cells[:, :4].max()) + 1
    return tetrahedra(mesh.nodes[:corners], mesh.cells[:, :4])


def test_rigid_motions_cost_nothing_and_weigh_what_the_body_does() -> None:
    filled = ball(2)
    system = four_node_system(filled, STEEL)
    stiff = system.stiffness.toarray()
    assert np.abs(stiff - stiff.T).max() < 1e-12 * np.abs(stiff).max()
    assert np.abs(stiff @ system.rigid).max() < 1e-12 * np.abs(stiff).max() * np.abs(system.rigid).max()
    assert np.abs(system.rigid.T @ system.weighted(system.rigid) - np.eye(6)).max() < 1e-12
    assert system.total == pytest.approx(STEEL.density * filled.volumes.sum(), rel=1e-12)


def test_their_frequencies_come_down_with_the_square_of_the_edge() -> None:
    """On a ball of flat faces, whose volume does too."""
    found = []
    for count in (2, 4, 8):
        with threadpool_limits(limits=1):
            pairs, _ = modes_below(four_node_system(ball(count), STEEL), np.inf, 8)
        found.append(np.sqrt(pairs.values[0]))
    assert found[0] > found[1] > found[2]
    assert np.log2((found[0] - found[1]) / (found[1] - found[2])) == pytest.approx(2.0, abs=0.5)
