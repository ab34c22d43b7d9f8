"""Gains between a surface's samples: of the place that is struck, and of the face that the hammer meets."""

import numpy as np
import pytest

from experiments.contact_localization.sound.gains import GainTable
from experiments.contact_localization.sound.likelihood import SoundTerm
from harness.basics.arrays import FloatArray
from harness.basics.geometry import rotation_about
from harness.basics.materials import MATERIALS
from harness.objects.household import build
from harness.sim.modal.modes import Modes
from harness.sim.solid.surface_samples import Surface, sample_surface
from harness.strikes.peaks import Peak, SoundEvidence
from tests.samples import sounding_plate as plate

SPACING = 2.0e-3
FLAT = plate.plate_surface(spacing=SPACING)
TOP = 0.5 * plate.THICKNESS
ROUND = build("plate")
RIM = 106.0e-3
"""Metres from a dinner plate's axis, 4 mm inside of its rim: closer there is more rim than plate."""


def _on_top(count: int, inside: float) -> FloatArray:
    """``(count, 3)`` metres, at random on the flat plate's upper face, at least so far inside."""
    reach = np.array([0.5 * plate.LENGTH - inside, 0.5 * plate.WIDTH - inside])
    flat = np.random.default_rng(0).uniform(-reach, reach, (count, 2))
    return np.column_stack([flat, np.full(count, TOP)])


def _blend(points: FloatArray, values: FloatArray) -> FloatArray:
    samples, shares = _table(FLAT).about(points, plate.down(len(points)))
    return np.asarray(np.sum(shares * values[samples], axis=1))


def _table(surface: Surface) -> GainTable:
    return GainTable(surface, np.zeros((len(surface.points), 1, 3), np.float32), np.ones(1))


def test_a_gain_is_that_of_the_place_and_not_of_the_samples_about_it() -> None:
    points = _on_top(2000, 2.0 * SPACING)
    aside = np.hypot(*(_blend(points, FLAT.points[:, axis]) - points[:, axis] for axis in (0, 1)))
    assert aside.max() < 0.05 * SPACING


def test_how_far_a_place_is_off_the_surface_along_the_hammer_does_not_matter() -> None:
    points = _on_top(200, 2.0 * SPACING)
    values = FLAT.points[:, 0]
    raised = points + np.array([0.0, 0.0, 0.4e-3])
    assert _blend(raised, values) == pytest.approx(_blend(points, values), abs=0.1 * SPACING)


def test_beside_an_edge_the_samples_are_of_the_face_that_the_hammer_meets() -> None:
    points = _on_top(500, 0.0)
    points[:, 0] = 0.5 * plate.LENGTH - 0.2e-3
    samples, shares = _table(FLAT).about(points, plate.down(len(points)))
    below = FLAT.normals[samples, 2] < 0.5
    assert np.any(FLAT.normals[_table(FLAT).nearest(points), 2] < 0.5), "no place is nearest to a side"
    assert np.all(shares[below] == 0.0)


def test_beyond_an_edge_a_place_has_the_gains_of_the_edge() -> None:
    points = _on_top(500, 2.0 * SPACING)
    points[:, 0] = 0.5 * plate.LENGTH + 4.0 * SPACING
    found = _blend(points, FLAT.points[:, 0])
    assert found == pytest.approx(0.5 * plate.LENGTH, abs=SPACING)


def test_a_hammer_that_no_face_looks_at_has_the_nearest_sample() -> None:
    points = _on_top(50, 5.0 * SPACING)
    samples, shares = _table(FLAT).about(points, np.tile([1.0, 0.0, 0.0], (len(points), 1)))
    assert np.all(shares[:, 0] == 1.0)
    assert np.array_equal(samples[:, 0], _table(FLAT).nearest(points))


def _pairs(surface: Surface) -> tuple[Modes, GainTable]:
    """Pairs of modes of a round plate with 2 to 9 waves about the axis, moving along it, more at the rim."""

    def shapes(points: FloatArray) -> FloatArray:
        angle, out = np.arctan2(points[:, 1], points[:, 0]), np.hypot(points[:, 0], points[:, 1]) / RIM
        waves = [f(n * angle) * out**n for n in range(2, 10) for f in (np.cos, np.sin)]
        return np.asarray(np.array(waves).T[..., None] * np.array([0.0, 0.0, 1.0]))

    frequencies = np.repeat(700.0 * np.arange(1.0, 9.0) ** 1.2, 2) * np.tile([1.0, 1.001], 8)
    modes = Modes(
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
    at_samples = shapes(surface.points)
    along = np.einsum("smi,si->sm", at_samples, surface.normals)
    return modes, GainTable(surface, np.ascontiguousarray(at_samples, np.float32), np.mean(along**2, axis=0))


def _heard(gains: FloatArray, frequencies: FloatArray) -> SoundEvidence:
    """``(K, m)`` gains as strikes without noise: of every pair one peak, both modes as loud."""
    heard = np.ones(len(gains), dtype=np.bool_)
    ys = gains[:, 0::2] + 1j * gains[:, 1::2]
    peaks = tuple(
        Peak(float(f), 10.0, y / np.linalg.norm(y), np.full(len(y), 0.02), heard, 0.0, 0.0)
        for f, y in zip(frequencies[0::2], ys.T, strict=True)
    )
    return SoundEvidence(heard, ("",) * len(heard), peaks, (), (100.0, 9000.0))


def test_turning_a_round_object_under_its_strikes_says_nothing() -> None:
    """By its pairs of modes a round object sounds alike however it is turned, whatever samples are about."""
    surface = sample_surface(ROUND, SPACING)
    modes, table = _pairs(surface)
    turns = [rotation_about(np.array([0.0, 0.0, 1.0]), np.radians(angle)) for angle in np.arange(0.0, 30.0)]
    first = np.array(
        [(RIM - 1e-3 * k) * np.array([np.cos(a), np.sin(a), 0.0]) for k, a in enumerate(_ANGLES)]
    )
    first[:, 2] = _height(first)
    evidence = _heard(modes.gains(first, plate.down(len(first))), modes.frequencies)
    term = SoundTerm(evidence, table, modes, MATERIALS["ceramic"])
    turned = np.array([first @ turn.T for turn in turns])
    nats = term.log_likelihood(turned, plate.down(len(first)), between=True)
    assert np.std(nats) < 1.0


_ANGLES = np.radians([0.0, 9.0, 21.0, 30.0, 44.0, 52.0])


def _height(points: FloatArray) -> FloatArray:
    """``(n,)`` metres: of the round plate's upper side above places near its rim."""
    near = np.hypot(ROUND.vertices[:, 0], ROUND.vertices[:, 1])
    upper = ROUND.vertex_normals[:, 2] > 0.5
    order = np.argsort(near[upper])
    return np.asarray(
        np.interp(np.hypot(points[:, 0], points[:, 1]), near[upper][order], ROUND.vertices[upper, 2][order])
    )
