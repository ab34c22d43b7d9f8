"""Gains at any place of a surface: the modes' own, without jumps."""

import functools
from dataclasses import replace

import numpy as np
import pytest

from experiments.contact_localization.sound.gains import (
    GainTable,
    faces_about,
    find_rotation_pairs,
    gain_table,
)
from experiments.contact_localization.sound.likelihood import SoundTerm
from harness.basics.arrays import FloatArray, IntArray
from harness.basics.geometry import rotation_about
from harness.basics.materials import MATERIALS
from harness.objects.household import build
from harness.sim.modal.modes import Modes
from harness.sim.solid.surface_samples import Surface, sample_surface
from harness.strikes.peaks import Peak, SoundEvidence
from tests.samples import sounding_plate as plate

ROUND = build("plate")
RIM = 106.0e-3
"""Metres from a dinner plate's axis, 4 mm inside of its rim: closer there is more rim than plate."""


@functools.cache
def samples() -> Surface:
    """The plate's."""
    return sample_surface(ROUND, 2.0e-3)


def _beside(count: int, off: float, seed: int = 0) -> FloatArray:
    """``(count, 3)`` metres, all over the round plate, its rim and foot too, and so far off at most."""
    random = np.random.default_rng(seed)
    chosen = random.integers(len(samples().points), size=count)
    away = random.uniform(-off, off, (count, 1))
    return np.asarray(samples().points[chosen] + away * samples().normals[chosen])


def _shapes(rows: IntArray, shares: FloatArray, table: GainTable) -> FloatArray:
    return np.asarray(np.einsum("nc,ncmd->nmd", shares, table.shapes[rows].astype(np.float64)))


def test_gains_are_the_modes_own_at_any_place(table: GainTable, modes: Modes) -> None:
    """Beside a rim too, and off the surface: linear on the face that is nearest, no mean of samples about."""
    points = _beside(3000, 0.5e-3)
    rows, shares = table.about(points)
    found, own = _shapes(rows, shares, table), modes.at(points)
    off = np.abs(found - own).max(axis=(1, 2)) > 1e-3 * np.abs(own).max()
    assert off.mean() < 0.01  # those nearly as near to a face that is no candidate


def test_shares_are_of_one_face_and_sum_to_one(table: GainTable) -> None:
    points = _beside(1000, 3.0e-3, seed=1)
    rows, shares = table.about(points)
    assert shares.min() >= 0.0
    assert shares.sum(axis=1) == pytest.approx(1.0)
    faces = {tuple(face) for face in np.sort(table.faces, axis=1)}
    assert all(tuple(face) in faces for face in np.sort(rows - len(table.surface.points), axis=1))


def test_gains_do_not_jump_from_one_place_to_the_next(table: GainTable) -> None:
    """A search compares places: by steps of a hundredth of a face they change by as little."""
    angles = np.radians(np.arange(0.0, 6.0, 0.02))
    points = RIM * np.column_stack([np.cos(angles), np.sin(angles), np.zeros(len(angles))])
    points[:, 2] = _height(points)
    along = _shapes(*table.about(points), table)
    steps = np.abs(np.diff(along, axis=0)).max(axis=(1, 2))
    assert steps.max() < 0.02 * np.abs(along).max()


def test_a_face_without_area_has_the_gains_of_a_corner(modes: Modes) -> None:
    points = np.array([[0.0, 0.0, 0.0], [0.0, 0.0, 0.0], [0.0, 0.0, 0.0]])
    nodes, shares = faces_about(
        np.array([[0.1, 0.0, 0.0]]),
        np.zeros(1, np.int64),
        np.zeros((1, 1), np.int32),
        points,
        np.array([[0, 1, 2]]),
    )
    assert np.array_equal(nodes, [[0, 1, 2]])
    assert np.array_equal(shares, [[1.0, 0.0, 0.0]])


def _pairs() -> Modes:
    """Pairs of modes of a round plate with 2 to 9 waves about the axis, moving along it, more at the rim."""

    def shapes(points: FloatArray) -> FloatArray:
        angle, out = np.arctan2(points[:, 1], points[:, 0]), np.hypot(points[:, 0], points[:, 1]) / RIM
        waves = [f(n * angle) * out**n for n in range(2, 10) for f in (np.cos, np.sin)]
        return np.asarray(np.array(waves).T[..., None] * np.array([0.0, 0.0, 1.0]))

    frequencies = np.repeat(700.0 * np.arange(1.0, 9.0) ** 1.2, 2) * np.tile([1.0, 1.001], 8)
    return Modes(
        frequencies=frequencies,
        points=ROUND.vertices,
        normals=ROUND.vertex_normals,
        faces=ROUND.faces,
        shapes=shapes(ROUND.vertices),
        limit=20_000.0,
        mass=1.0,
        rigid=6,
        nodes=len(ROUND.vertices),
        elements=1,
        residual=0.0,
        seconds={},
    )


def _heard(gains: FloatArray, frequencies: FloatArray) -> SoundEvidence:
    """``(K, m)`` gains as strikes without noise: of every pair one peak, both modes as loud."""
    heard = np.ones(len(gains), dtype=np.bool_)
    ys = gains[:, 0::2] + 1j * gains[:, 1::2]
    peaks = tuple(
        Peak(float(f), 10.0, y / np.linalg.norm(y), np.full(len(y), 0.02), heard, 0.0, 0.0)
        for f, y in zip(frequencies[0::2], ys.T, strict=True)
    )
    return SoundEvidence(heard, ("",) * len(heard), peaks, (), (100.0, 9000.0))


@pytest.fixture(scope="module")
def modes() -> Modes:
    """Of the round plate."""
    return _pairs()


@pytest.fixture(scope="module")
def table(modes: Modes) -> GainTable:
    """Theirs."""
    return gain_table(modes, samples())


def test_only_the_two_modes_of_a_wave_about_the_axis_are_a_pair(modes: Modes) -> None:
    assert find_rotation_pairs(modes, samples().points).tolist() == [k % 2 == 0 for k in range(15)]


@pytest.mark.parametrize("turn", [0.0, 0.3, 1.0])
def test_which_modes_are_pairs_does_not_depend_on_the_azimuth_of_their_nodal_lines(
    modes: Modes, turn: float
) -> None:
    cosine, sine = modes.shapes[:, 0::2], modes.shapes[:, 1::2]
    shapes = np.empty_like(modes.shapes)
    shapes[:, 0::2] = np.cos(turn) * cosine + np.sin(turn) * sine
    shapes[:, 1::2] = np.cos(turn) * sine - np.sin(turn) * cosine
    pairs = find_rotation_pairs(replace(modes, shapes=shapes), samples().points)
    assert pairs.tolist() == [k % 2 == 0 for k in range(15)]


def test_modes_of_a_bar_are_no_pairs(modes: Modes) -> None:
    """Waves along x alone, however near their frequencies are to each other."""
    along = ROUND.vertices[:, 0] / RIM
    waves = np.array([np.cos(n * np.pi * along) for n in range(1, 17)]).T
    bar = replace(modes, shapes=waves[..., None] * np.array([0.0, 0.0, 1.0]))
    assert not find_rotation_pairs(bar, samples().points).any()


def test_turning_a_round_object_under_its_strikes_says_nothing(table: GainTable, modes: Modes) -> None:
    """By its pairs of modes a round object sounds alike however it is turned, whatever samples are about."""
    turns = [rotation_about(np.array([0.0, 0.0, 1.0]), np.radians(angle)) for angle in np.arange(0.0, 30.0)]
    first = np.array(
        [(RIM - 1e-3 * k) * np.array([np.cos(a), np.sin(a), 0.0]) for k, a in enumerate(_ANGLES)]
    )
    first[:, 2] = _height(first)
    evidence = _heard(modes.gains(first, plate.down(len(first))), modes.frequencies)
    term = SoundTerm(evidence, table, modes, MATERIALS["ceramic"])
    turned = np.array([first @ turn.T for turn in turns])
    nats = term.log_likelihood(turned, plate.down(len(first)), between=True)
    assert np.std(nats) < 0.3


_ANGLES = np.radians([0.0, 9.0, 21.0, 30.0, 44.0, 52.0])


def _height(points: FloatArray) -> FloatArray:
    """``(n,)`` metres: of the round plate's upper side above places near its rim."""
    near = np.hypot(ROUND.vertices[:, 0], ROUND.vertices[:, 1])
    upper = ROUND.vertex_normals[:, 2] > 0.5
    order = np.argsort(near[upper])
    return np.asarray(
        np.interp(np.hypot(points[:, 0], points[:, 1]), near[upper][order], ROUND.vertices[upper, 2][order])
    )
