from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from harness.authoring.audio.data import (
    canonical,
    clusters,
    node_areas,
    split_nodes,
    wave_number,
)
from harness.basics.errors import WrongUse
from harness.sim.modal.modes import Modes


def repeated(modes: Modes) -> Modes:
    """The same with the second to fourth frequency equal."""
    frequencies = modes.frequencies.copy()
    frequencies[1:4] = frequencies[1]
    return replace(modes, frequencies=frequencies)


def turned(modes: Modes, seed: int) -> Modes:
    """Another solution of the same equations: signs, and a rotation of the equal frequencies."""
    random = np.random.default_rng(seed)
    turn = np.diag(random.choice([-1.0, 1.0], len(modes.frequencies)))
    turn[1:4, 1:4] = np.linalg.qr(random.normal(size=(3, 3)))[0]
    return replace(modes, shapes=np.einsum("nmd,mk->nkd", modes.shapes, turn))


@pytest.mark.parametrize("seed", range(5))
def test_signs_and_bases_of_a_solver_leave_no_trace(egg: Modes, seed: int) -> None:
    wanted = canonical(repeated(egg))
    found = canonical(turned(repeated(egg), seed))
    assert np.abs(found.shapes - wanted.shapes).max() < 1e-9 * np.abs(wanted.shapes).max()
    assert found.frequencies == pytest.approx(wanted.frequencies, rel=1e-14)


@pytest.mark.parametrize("order", [2, 4, 6, 9])
def test_a_pair_that_goes_round_many_times_has_one_basis(egg: Modes, order: int) -> None:
    radius = np.linalg.norm(egg.points[:, :2], axis=1, keepdims=True)
    outward = np.concatenate([egg.points[:, :2] / np.maximum(radius, 1e-9), np.zeros_like(radius)], axis=1)
    angle = np.arctan2(egg.points[:, 1], egg.points[:, 0])
    pair = np.stack([np.cos(order * angle), np.sin(order * angle)], axis=1) * radius
    shapes = pair[:, :, None] * outward[:, None, :]
    found = []
    for turn in (0.0, 0.7, 2.0):
        rotation = np.array([[np.cos(turn), np.sin(turn)], [-np.sin(turn), np.cos(turn)]])
        given_ = np.einsum("nmd,mk->nkd", shapes, rotation)
        found.append(canonical(replace(egg, frequencies=np.full(2, 900.0), shapes=given_)).shapes)
    assert np.abs(found[1] - found[0]).max() < 1e-9 * np.abs(shapes).max()
    assert np.abs(found[2] - found[0]).max() < 1e-9 * np.abs(shapes).max()


def test_numbering_of_nodes_leaves_no_trace(egg: Modes) -> None:
    order = np.random.default_rng(3).permutation(len(egg.points))
    back = np.argsort(order)
    renumbered = replace(
        turned(repeated(egg), 1), points=egg.points[order], normals=egg.normals[order], faces=back[egg.faces]
    )
    renumbered = replace(renumbered, shapes=turned(repeated(egg), 1).shapes[order])
    wanted = canonical(repeated(egg)).shapes[order]
    assert np.abs(canonical(renumbered).shapes - wanted).max() < 1e-9 * np.abs(wanted).max()


def test_the_sum_over_a_cluster_is_the_solver_s(egg: Modes) -> None:
    modes = repeated(egg)
    found = canonical(modes)
    for one, other in ((modes.shapes, found.shapes),):
        before = np.einsum("md,me->de", one[5, 1:4], one[90, 1:4])
        after = np.einsum("md,me->de", other[5, 1:4], other[90, 1:4])
        assert after == pytest.approx(before, rel=1e-12)


def test_frequencies_apart_are_never_mixed(egg: Modes) -> None:
    found = canonical(egg)
    assert np.array_equal(found.frequencies, egg.frequencies)
    assert np.abs(np.abs(found.shapes) - np.abs(egg.shapes)).max() < 1e-14


def test_clusters_are_chains_of_near_frequencies() -> None:
    found = clusters(np.array([100.0, 200.0, 200.1, 200.2, 300.0]), gap=1e-3)
    assert [len(one) for one in found] == [1, 3, 1]


@settings(deadline=None)
@given(count=st.integers(2, 500), share=st.floats(0.01, 0.99), seed=st.integers(0, 99))
def test_every_node_is_on_one_side(count: int, share: float, seed: int) -> None:
    try:
        split = split_nodes(count, share, seed)
    except WrongUse:
        assert round(share * count) in (0, count)
        return
    both = np.sort(np.concatenate([split.trained, split.held_out]))
    assert np.array_equal(both, np.arange(count))
    assert len(split.held_out) == round(share * count)


@pytest.mark.parametrize("share", [0.0, 1.0, -0.1, float("nan")])
def test_a_share_that_leaves_nothing_is_refused(share: float) -> None:
    with pytest.raises(WrongUse, match=r" of 100 nodes"):
        split_nodes(100, share)


def test_the_wave_number_is_near_the_fastest_wave_s(egg: Modes) -> None:
    # A wave along a surface shows all of its slope, one into it none: between half and all of 80.
    assert 40.0 < wave_number(egg) < 80.0


def test_areas_of_nodes_add_up_to_the_surface(egg: Modes) -> None:
    corners = egg.points[egg.faces]
    crosses = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    assert node_areas(egg).sum() == pytest.approx(0.5 * np.linalg.norm(crosses, axis=1).sum(), rel=1e-12)
