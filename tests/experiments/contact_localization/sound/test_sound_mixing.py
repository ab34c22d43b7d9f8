"""Pairs of modes that an uneven material mixes: how far, and how surely their split fixes an azimuth."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.linalg import eigh
from scipy.special import logsumexp

from experiments.contact_localization.sound.gains import GainTable, gain_table
from experiments.contact_localization.sound.likelihood import SoundTerm
from experiments.contact_localization.sound.matching import SoundNoise
from experiments.contact_localization.sound.mixing import (
    ModeMixing,
    admixtures,
    couplings,
    mixed_groups,
)
from harness.basics.arrays import AnyArray, FloatArray
from harness.basics.materials import MATERIALS
from harness.objects.household import build
from harness.sim.modal.modes import Modes
from harness.sim.solid.surface_samples import sample_surface
from harness.strikes.peaks import Peak, SoundEvidence
from tests.samples import sounding_plate as plate

MIXING = ModeMixing()
ORDERS = np.arange(2, 8)
RIM = 0.09
MESH = build("plate", 8e-3)
SURFACE = sample_surface(MESH, 4e-3)


def round_modes(split: float) -> Modes:
    """Pairs of waves about an axis, ``split`` apart in frequency: the first of each pair has a crest on x."""
    points = MESH.vertices
    angle, radius = np.arctan2(points[:, 1], points[:, 0]), np.hypot(points[:, 0], points[:, 1]) / RIM
    waves = [wave(n * angle) * radius**n for n in ORDERS for wave in (np.cos, np.sin)]
    frequencies = np.repeat(700.0 * 1.6 ** (ORDERS - 2.0), 2) * np.tile([1.0, 1.0 + split], len(ORDERS))
    shapes = np.zeros((len(points), len(waves), 3))
    shapes[..., 2] = np.array(waves).T
    flat = plate.plate_modes()
    return replace(
        flat,
        frequencies=frequencies,
        points=points,
        normals=MESH.vertex_normals,
        faces=MESH.faces,
        shapes=shapes,
    )


def unit(shapes: AnyArray) -> AnyArray:
    """Each of unit mean square."""
    return np.asarray(shapes / np.sqrt(np.mean(np.sum(shapes**2, axis=2), axis=0))[:, None])


def mixed(modes: Modes, table: GainTable, rng: np.random.Generator) -> Modes:
    """The modes of one object whose material is uneven: each pair turned as its drawn coupling asks for."""
    i = np.arange(0, len(modes.frequencies), 2)
    drawn = rng.standard_normal(len(i)) * couplings(unit(table.shapes), SURFACE.points, i, i + 1, MIXING)
    shapes = modes.shapes.copy()
    for first, coupling in zip(i, drawn, strict=True):
        squares = modes.frequencies[first : first + 2] ** 2
        across = coupling * np.sqrt(squares.prod())
        turned = eigh([[squares[0], across], [across, squares[1]]])[1]
        shapes[:, first : first + 2] = np.einsum("nrd,rs->nsd", modes.shapes[:, first : first + 2], turned)
    return replace(modes, shapes=shapes)


def heard_of(modes: Modes, places: FloatArray, rng: np.random.Generator) -> SoundEvidence:
    """Every mode's shares as an analysis without error would find them."""
    heard = np.ones(len(places), dtype=np.bool_)
    ys: AnyArray = modes.gains(places, plate.down(len(places))).T + 0.05 * rng.normal(
        size=(len(modes.frequencies), len(places))
    )
    peaks = tuple(
        Peak(float(f), 10.0, y / np.linalg.norm(y) + 0j, np.zeros(len(y)), heard, 0.0, 0.0)
        for f, y in zip(modes.frequencies, ys, strict=True)
    )
    return SoundEvidence(heard, ("",) * len(heard), peaks, (), (100.0, 20_000.0))


def turned_by(angles: FloatArray, places: FloatArray) -> FloatArray:
    """``(h, K, 3)``: the places turned about the axis by ``(h,)`` rad."""
    cosines, sines, flat = np.cos(angles), np.sin(angles), np.zeros(len(angles))
    turns = np.array([[cosines, -sines, flat], [sines, cosines, flat], [flat, flat, flat + 1.0]])
    return np.asarray(np.einsum("ijh,kj->hki", turns, places))


def share_of_truth(table: GainTable, modes: Modes, seed: int) -> float:
    """Logarithm of the share of an unevenly made object's true azimuth, among 61 a degree apart."""
    rng, angles = np.random.default_rng(seed), np.radians(np.arange(-30.0, 30.5, 1.0))
    about = rng.uniform(0.0, 2.0 * np.pi) + rng.uniform(-0.2, 0.2, 5)
    flat = rng.uniform(0.05, RIM, 5) * np.array([np.cos(about), np.sin(about)])
    places = np.column_stack([*flat, np.full(5, 0.015)])
    evidence = heard_of(mixed(modes, table, rng), places, rng)
    term = SoundTerm(evidence, table, modes, MATERIALS["ceramic"], SoundNoise(weight=1.0))
    nats = term.log_likelihood(turned_by(angles, places), plate.down(5), between=True)
    return float(nats[len(angles) // 2] - logsumexp(nats))


def test_a_split_pair_fixes_an_azimuth_less_surely_where_the_material_turns_it() -> None:
    """Of drawn objects the true azimuth is more probable, on average, than were each mode the drawing's."""
    modes = round_modes(0.011)
    tables = [gain_table(modes, SURFACE, replace(MIXING, uneven=uneven)) for uneven in (MIXING.uneven, 0.0)]
    scores = np.array([[share_of_truth(table, modes, seed) for table in tables] for seed in range(25)])
    assert np.mean(scores[:, 0] - scores[:, 1]) > 0.2


@settings(max_examples=50, deadline=None)
@given(split=st.floats(0.0, 0.2), coupling=st.floats(1e-6, 0.2))
def test_a_pair_is_admixed_as_its_perturbed_eigenvectors_are(split: float, coupling: float) -> None:
    found = admixtures(np.array([[0.0, coupling], [coupling, 0.0]]), np.array([0.0, 0.5 * split]))
    vectors = eigh([[0.0, coupling], [coupling, split]])[1] ** 2
    assert found[0, 1] == pytest.approx(vectors[1, 0] / vectors[0, 0], rel=1e-6)
    assert found[1, 0] == found[0, 1]


def test_uncoupled_modes_stay_apart_at_any_split() -> None:
    assert np.all(admixtures(np.zeros((3, 3)), np.array([6.0, 6.0, 6.001])) == 0.0)


def test_a_coupling_is_that_of_drawn_fields() -> None:
    """Stiffness and density drawn from their covariance itself, by its factor, over the samples."""
    modes = round_modes(0.03)
    few = slice(None, None, 12)
    points, shapes = SURFACE.points[few], unit(gain_table(modes, SURFACE).shapes[few].astype(np.float64))
    gaps = np.sum((points[:, None] - points) ** 2, axis=2) / MIXING.length**2
    factor = np.linalg.cholesky(np.exp(-0.5 * gaps) + 1e-6 * np.eye(len(points)))
    fields = MIXING.uneven * factor @ np.random.default_rng(1).standard_normal((len(points), 4000))
    i, j = np.array([0, 2, 0]), np.array([1, 3, 4])
    drawn = np.sum(shapes[:, i] * shapes[:, j], axis=2).T @ fields / len(points)
    expected = np.sqrt(2.0) * drawn.std(axis=1)
    assert couplings(shapes, points, i, j, MIXING) == pytest.approx(expected, rel=0.25)


def test_groups_hold_their_own_modes_first_and_no_more_than_can_be_weighed() -> None:
    modes = round_modes(0.03)
    table = gain_table(modes, SURFACE)
    groups = mixed_groups(table.shapes, SURFACE.points, modes.frequencies, MIXING)
    assert groups.own_starts.tolist() == list(range(13))
    assert groups.modes[groups.starts[:-1]].tolist() == list(range(12))
    assert np.all(groups.weights[groups.starts[:-1]] == 1.0)
    assert np.diff(groups.starts).max() <= 4
    # The lowest pair is the most coupled, and its modes are admixed to each other.
    assert groups.modes[1] == 1
    assert 0.1 <= groups.weights[1] < 1.0
    assert groups.weights.min() >= MIXING.least
    even = mixed_groups(table.shapes, SURFACE.points, modes.frequencies, replace(MIXING, uneven=0.0))
    assert even.modes.tolist() == list(range(12))


def test_no_modes_make_no_groups() -> None:
    none = mixed_groups(np.zeros((40, 0, 3)), np.zeros((40, 3)), np.zeros(0), MIXING)
    assert none.starts.tolist() == [0]
    assert len(none.modes) == len(none.weights) == len(none.frequencies) == 0
