"""The likelihood of sound: what must not matter, what must, and that it is always a number."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from experiments.contact_localization.sound.gains import MOST_RANK, add_densities, gain_table, sound_scores
from experiments.contact_localization.sound.likelihood import (
    SoundNoise,
    SoundTerm,
    group_starts,
    likely_scales,
)
from harness.basics.arrays import AnyArray, FloatArray
from harness.basics.errors import WrongUse
from harness.basics.materials import MATERIALS
from harness.sim.modal.modes import Modes
from harness.strikes.peaks import Peak, SoundEvidence, analyse
from tests.samples import sounding_plate as plate

GLASS = MATERIALS["glass"]
K = 5
MODES = plate.plate_modes()
SURFACE = plate.plate_surface()
TABLE = gain_table(MODES, SURFACE)


def _evidence(modes: Modes, points: FloatArray, seed: int, sigma: float = 0.0) -> SoundEvidence:
    """As an analysis without error would find it, the microphone's gain drawn."""
    rng = np.random.default_rng(seed)
    gains = modes.gains(points, plate.down(len(points)))
    return _said(modes.frequencies, gains.T * _complex(rng, (len(gains.T), 1)), sigma)


def _said(frequencies: FloatArray, ys: AnyArray, sigma: float = 0.0) -> SoundEvidence:
    heard = np.ones(ys.shape[1], dtype=np.bool_)
    peaks = tuple(
        Peak(float(f), 10.0, y / np.linalg.norm(y), np.full(len(y), sigma), heard, 0.0, 0.0)
        for f, y in zip(frequencies, ys, strict=True)
    )
    return SoundEvidence(heard, ("",) * len(heard), peaks, (), (100.0, 9000.0))


def _complex(rng: np.random.Generator, shape: tuple[int, ...]) -> AnyArray:
    return np.asarray(rng.normal(size=shape) + 1j * rng.normal(size=shape))


def _hypotheses(seed: int, count: int = 40) -> FloatArray:
    rng = np.random.default_rng(seed)
    return np.array([plate.places(K, rng) for _ in range(count)])


def _term(evidence: SoundEvidence, modes: Modes = MODES, noise: SoundNoise | None = None) -> SoundTerm:
    table = TABLE if modes is MODES else gain_table(modes, SURFACE)
    return SoundTerm(evidence, table, modes, GLASS, noise)


@settings(max_examples=20, deadline=None)
@given(seed=st.integers(0, 10_000))
def test_the_microphones_gain_of_a_mode_does_not_matter(seed: int) -> None:
    rng = np.random.default_rng(seed)
    places = _hypotheses(seed)
    evidence = _evidence(MODES, places[0], seed)
    ys = np.array([peak.y for peak in evidence.peaks]) * _complex(rng, (len(evidence.peaks), 1))
    other = _said(MODES.frequencies, ys)
    expected = _term(evidence).log_likelihood(places, plate.down(K))
    assert _term(other).log_likelihood(places, plate.down(K)) == pytest.approx(expected, abs=1e-9)


@settings(max_examples=20, deadline=None)
@given(order=st.permutations(range(K)), seed=st.integers(0, 10_000))
def test_strikes_may_come_in_any_order(order: list[int], seed: int) -> None:
    places = _hypotheses(seed)
    evidence = _evidence(MODES, places[0], seed, 0.01)
    turned = _said(MODES.frequencies, np.array([peak.y[order] for peak in evidence.peaks]), 0.01)
    expected = _term(evidence).log_likelihood(places, plate.down(K))
    found = _term(turned).log_likelihood(places[:, order], plate.down(K))
    assert found == pytest.approx(expected, abs=1e-9)


@settings(max_examples=20, deadline=None)
@given(angle=st.floats(0.0, 6.3), seed=st.integers(0, 10_000))
def test_a_pair_of_equal_modes_may_come_in_any_basis(angle: float, seed: int) -> None:
    frequencies = MODES.frequencies.copy()
    frequencies[4] = frequencies[3]
    twins = replace(MODES, frequencies=frequencies)
    c, s = np.cos(angle), np.sin(angle)
    shapes = twins.shapes.copy()
    shapes[:, 3], shapes[:, 4] = (
        c * twins.shapes[:, 3] + s * twins.shapes[:, 4],
        c * twins.shapes[:, 4] - s * twins.shapes[:, 3],
    )
    turned = replace(twins, shapes=shapes)
    places = _hypotheses(seed)
    evidence = _evidence(twins, places[0], seed, 0.02)
    found = []
    for modes in (twins, turned):
        # In double: rotating would round the table's single precision anew.
        table = replace(TABLE, shapes=modes.at(SURFACE.points))
        found.append(SoundTerm(evidence, table, modes, GLASS).log_likelihood(places, plate.down(K)))
    assert found[1] == pytest.approx(found[0], abs=1e-9)


@settings(max_examples=10, deadline=None)
@given(signs=st.lists(st.booleans(), min_size=12, max_size=12), seed=st.integers(0, 1000))
def test_the_sign_of_a_mode_does_not_matter(signs: list[bool], seed: int) -> None:
    places = _hypotheses(seed)
    evidence = _evidence(MODES, places[0], seed)
    flipped = replace(MODES, shapes=MODES.shapes * np.where(signs, 1.0, -1.0)[None, :, None])
    expected = _term(evidence).log_likelihood(places, plate.down(K))
    assert _term(evidence, flipped).log_likelihood(places, plate.down(K)) == pytest.approx(expected, abs=1e-9)


def test_single_and_double_precision_agree() -> None:
    places = _hypotheses(3)
    evidence = _evidence(MODES, places[0], 3)
    exact = SoundTerm(evidence, replace(TABLE, shapes=MODES.at(SURFACE.points)), MODES, GLASS)
    expected = exact.log_likelihood(places, plate.down(K))
    assert _term(evidence).log_likelihood(places, plate.down(K)) == pytest.approx(expected, abs=1e-4)


def test_directions_once_or_for_every_hypothesis_are_the_same() -> None:
    places = _hypotheses(4)
    term = _term(_evidence(MODES, places[0], 4))
    down = plate.down(K)
    each = np.tile(down, (len(places), 1, 1))
    assert term.log_likelihood(places, each) == pytest.approx(term.log_likelihood(places, down), abs=0.0)


def test_a_strike_across_all_modes_says_nothing_of_itself() -> None:
    """The plate moves along z alone: struck along x nothing should sound, and every place is as bad."""
    places = _hypotheses(5)
    across = np.tile(np.array([1.0, 0.0, 0.0]), (K, 1))
    found = _term(_evidence(MODES, places[0], 5)).log_likelihood(places, across)
    assert np.ptp(found) == pytest.approx(0.0, abs=1e-12)


def _densities(gains: FloatArray, rows: FloatArray, y: AnyArray, count: int) -> FloatArray:
    """``(B,)`` of ``(B, K, r)`` gains and one direction."""
    side_by_side = np.ascontiguousarray(np.moveaxis(gains, 0, 2).swapaxes(0, 1))
    found, work = np.zeros(len(gains)), np.full((MOST_RANK + 2, MOST_RANK, len(gains)), np.nan)
    add_densities(side_by_side, rows, y.real.copy(), y.imag.copy(), count, 1e-12, 1.0, work, found)
    return found


@pytest.mark.parametrize("rank", [1, 2, 3, 4])
def test_the_kernel_is_the_density_it_says(rank: int) -> None:
    rng = np.random.default_rng(rank)
    gains, y = rng.normal(size=(7, K, rank)), _complex(rng, (K,))
    rows = np.array([1.0, 0.5, 0.0, 2.0, 1.0])
    unit = rows * y / np.linalg.norm(rows * y)
    scaled = gains * rows[:, None]
    matrices = np.eye(K) + scaled @ scaled.swapaxes(1, 2)
    solved = np.linalg.solve(matrices, np.tile(unit[:, None], (7, 1, 1)))[..., 0]
    quadratic = (solved @ unit.conj()).real
    expected = 1.0 / np.linalg.det(matrices) / quadratic**4
    assert _densities(gains, rows, unit, 4) == pytest.approx(expected, rel=1e-10)


def test_the_density_integrates_to_one() -> None:
    """Over all directions, drawn evenly: the mean of the density against the even one is 1."""
    rng = np.random.default_rng(0)
    gains = rng.normal(size=(1, 3, 1))
    ys = _complex(rng, (40_000, 3))
    ys /= np.linalg.norm(ys, axis=1)[:, None]
    densities = [_densities(gains, np.ones(3), y, 3)[0] for y in ys]
    assert np.mean(densities) == pytest.approx(1.0, abs=0.05)


@pytest.mark.slow  # the kernel's density stays
@settings(max_examples=20, deadline=None)
@given(seed=st.integers(0, 10_000), peaks=st.integers(1, 40), strikes=st.integers(2, 30))
def test_scores_are_the_sums_that_they_say(seed: int, peaks: int, strikes: int) -> None:
    """Against the definition in logarithms, however many peaks and strikes multiply."""
    rng = np.random.default_rng(seed)
    hypotheses, scales = 35, 3
    shapes = rng.normal(size=(50, 7, 3)).astype(np.float32)
    starts = np.array([0, 1, 3, 6, 7])
    samples = rng.integers(0, 50, (hypotheses, strikes, 1))
    down = np.tile([0.0, 0.0, -1.0], (1, strikes, 1))
    groups = rng.integers(0, 4, (peaks, 2))
    spreads = np.array([10.0, 2.5])
    rows = rng.uniform(0.1, 1.0, (2, peaks, strikes))
    ys = _complex(rng, (2, peaks, strikes))
    ys /= np.linalg.norm(ys, axis=2)[..., None]
    offsets = rng.normal(scale=3.0, size=(2, peaks))
    shares, clutter = rng.uniform(0.0, 0.4, (scales, 2 * peaks)), rng.uniform(0.1, 0.3, (scales, peaks))
    log_shares = np.log(rng.dirichlet(np.ones(scales)))
    found = sound_scores(
        shapes,
        samples,
        np.ones(samples.shape),
        down,
        np.repeat(spreads[:, None], 7, axis=1),
        rows,
        ys.real.copy(),
        ys.imag.copy(),
        np.full(peaks, strikes),
        offsets,
        np.arange(0, 2 * peaks + 1, 2),
        groups.ravel(),
        starts,
        shares,
        clutter,
        0.2,
        log_shares,
    )
    totals = np.tile(log_shares, (hypotheses, 1))
    struck = -shapes[samples[..., 0], :, 2].astype(np.float64)
    for p in range(peaks):
        terms = np.log(np.tile(clutter[:, p], (hypotheses, 1)))
        for q in range(2):
            block = struck[:, :, starts[groups[p, q]] : starts[groups[p, q] + 1]]
            nats = [offsets[c, p] + _log_density(spreads[c] * block, rows[c, p], ys[c, p]) for c in range(2)]
            both = np.logaddexp(*nats)[:, None] + np.log(shares[:, 2 * p + q])
            terms = np.logaddexp(terms, both)
        totals += 0.2 * terms
    assert found == pytest.approx(np.logaddexp.reduce(totals, axis=1), abs=1e-9)


def _log_density(gains: FloatArray, rows: FloatArray, y: AnyArray) -> FloatArray:
    scaled = gains * rows[:, None]
    matrices = np.eye(len(y)) + scaled @ scaled.swapaxes(1, 2)
    solved = np.linalg.solve(matrices, np.tile(y[:, None], (len(gains), 1, 1)))[..., 0]
    quadratic = (solved @ y.conj()).real
    return np.asarray(-np.linalg.slogdet(matrices)[1] - len(y) * np.log(quadratic))


@pytest.mark.parametrize("factor", [0.92, 1.0, 1.08])
def test_where_frequencies_tell_no_scale_the_places_do(factor: float) -> None:
    """Modes so dense that every peak has one nearby under any scale, as a pitcher's are."""
    rng = np.random.default_rng(2)
    frequencies = np.geomspace(300.0, 300.0 * 1.013**159, 160)
    shapes = rng.normal(size=(len(MODES.points), 160, 3)).cumsum(axis=0) / 8.0
    dense = replace(MODES, frequencies=frequencies, shapes=shapes - shapes.mean(axis=0))
    places = _hypotheses(2, 60)
    sounding = rng.choice(np.arange(20, 140), 12, replace=False)
    gains = dense.gains(places[0], plate.down(K))[:, sounding]
    evidence = _said(factor * frequencies[sounding], gains.T * _complex(rng, (12, 1)))
    term = _term(evidence, dense)
    assert np.argmax(term.log_likelihood(places, plate.down(K))) == 0
    assert term.scale_at(places[0], plate.down(K)) == pytest.approx(factor, rel=0.02)


def test_silence_and_noise_leave_every_place_alike() -> None:
    places = _hypotheses(6)
    nothing = SoundEvidence(np.ones(K, dtype=np.bool_), ("",) * K, (), (), (0.0, 0.0))
    term = _term(nothing)
    assert not term.says_something
    assert np.all(term.log_likelihood(places, plate.down(K)) == 0.0)
    lost_in_noise = _evidence(MODES, places[0], 6, sigma=1e4)
    assert np.abs(_term(lost_in_noise).log_likelihood(places, plate.down(K))).max() < 1e-3


def test_peaks_far_from_any_mode_are_clutter() -> None:
    places = _hypotheses(7)
    rng = np.random.default_rng(7)
    evidence = _said(np.array([40.0, 60.0]), _complex(rng, (2, K)))
    assert np.all(_term(evidence).log_likelihood(places, plate.down(K)) == 0.0)


def test_an_object_without_modes_in_reach_says_nothing() -> None:
    places = _hypotheses(8)
    dumb = replace(MODES, frequencies=np.zeros(0), shapes=np.zeros((len(MODES.points), 0, 3)))
    term = _term(_evidence(MODES, places[0], 8), dumb)
    assert np.all(term.log_likelihood(places, plate.down(K)) == 0.0)


def test_a_wrong_number_of_places_is_refused() -> None:
    places = _hypotheses(9)
    term = _term(_evidence(MODES, places[0], 9))
    with pytest.raises(WrongUse, match=r"\(40, 3, 3\).*5 strikes"):
        term.log_likelihood(places[:, :3], plate.down(K))
    with pytest.raises(WrongUse, match=r"directions .*\(3, 3\).*\(5, 3\)"):
        term.log_likelihood(places, plate.down(3))
    with pytest.raises(WrongUse, match=r"\b9 modes.*1 to 4"):
        _term(_evidence(MODES, places[0], 9), noise=SoundNoise(most=9))


@settings(max_examples=25, deadline=None)
@given(
    seed=st.integers(0, 10_000),
    sigma=st.sampled_from([0.0, 1e-9, 0.1, 1e6]),
    scale=st.floats(0.5, 2.0),
    far=st.sampled_from([0.0, 0.01, 100.0]),
)
def test_it_is_always_a_finite_number(seed: int, sigma: float, scale: float, far: float) -> None:
    rng = np.random.default_rng(seed)
    places = _hypotheses(seed, 8) + far
    ys = _complex(rng, (len(MODES.frequencies), K)) * (rng.random((len(MODES.frequencies), K)) < 0.7)
    ys[:, 0] += 1e-6
    evidence = _said(scale * MODES.frequencies, ys, sigma)
    assert np.isfinite(_term(evidence).log_likelihood(places, plate.down(K))).all()


def test_a_hundred_strikes_do_not_overflow() -> None:
    rng = np.random.default_rng(1)
    many = np.array([plate.places(200, rng) for _ in range(3)])
    evidence = _evidence(MODES, many[0], 1)
    found = _term(evidence).log_likelihood(many, plate.down(200))
    assert np.isfinite(found).all()
    assert np.argmax(found) == 0


def test_on_average_the_truth_is_the_best_place() -> None:
    """Whole chain with noise, frequency errors and an unknown microphone, against shifted places."""
    gained, errors = [], []
    for seed in range(8):
        rng = np.random.default_rng(seed)
        real = plate.plate_modes(scale=rng.normal(1.0, 0.03), wobble=rng.normal(1.0, 0.004, 12))
        points = plate.places(K, rng)
        evidence = analyse(plate.strikes(real, points, rng))
        upper = SURFACE.points[SURFACE.normals[:, 2] > 0.9]
        shifted = upper[:, None] + (points - points[0])
        inside = np.all(np.abs(shifted[..., :2]) < 0.5 * np.array([plate.LENGTH, plate.WIDTH]), axis=(1, 2))
        places = np.concatenate([points[None], shifted[inside]])
        nats = _term(evidence).log_likelihood(places, plate.down(K))
        gained.append(nats[0] - np.log(np.mean(np.exp(nats[1:]))))
        errors.append(np.linalg.norm(places[1 + np.argmax(nats[1:])] - points, axis=1).mean())
    assert np.mean(gained) > 4.0
    assert np.median(errors) < 4e-3


def test_a_wrong_object_gains_nothing() -> None:
    rng = np.random.default_rng(11)
    points = plate.places(K, rng)
    foreign = plate.plate_modes(length=0.3, width=0.06, scale=1.7)
    evidence = analyse(plate.strikes(foreign, points * [0.3 / plate.LENGTH, 0.06 / plate.WIDTH, 1.0], rng))
    places = _hypotheses(11, 400)
    own = analyse(plate.strikes(MODES, points, rng))
    best_of_foreign = _term(evidence).log_likelihood(places, plate.down(K)).max()
    assert best_of_foreign < 0.5 * _term(own).log_likelihood(points[None], plate.down(K))[0]


def test_a_silent_strike_among_good_ones_changes_little() -> None:
    rng = np.random.default_rng(12)
    places = _hypotheses(12)
    strikes = list(plate.strikes(MODES, places[0], rng))
    full = _term(analyse(strikes)).log_likelihood(places, plate.down(K))
    strikes[2] = replace(strikes[2], silent=True, pressure=0.0 * strikes[2].pressure)
    term = _term(analyse(strikes))
    part = term.log_likelihood(places, plate.down(K))
    moved = places.copy()
    moved[:, 2] = 0.0
    assert term.log_likelihood(moved, plate.down(K)) == pytest.approx(part, abs=1e-12)
    assert np.argmax(part) == np.argmax(full) == 0


def test_the_mode_table_names_the_modes() -> None:
    places = _hypotheses(13)
    term = _term(_evidence(MODES, places[0], 13))
    rows = term.mode_table(places[0], plate.down(K))
    assert [row.modes for row in rows] == [(mode,) for mode in range(len(MODES.frequencies))]
    assert [row.model_frequency for row in rows] == pytest.approx([r.frequency for r in rows], rel=0.02)
    assert all(0.0 < row.probability <= 1.0 and row.nats > 0.0 for row in rows)


def test_groups_are_as_wide_as_asked_and_no_larger() -> None:
    frequencies = np.array([100.0, 100.1, 100.2, 100.3, 200.0, 300.0, 300.5])
    no_pairs = np.zeros(6, np.bool_)
    assert group_starts(frequencies, no_pairs, SoundNoise()).tolist() == [0, 3, 4, 5, 7]
    assert group_starts(frequencies, no_pairs, SoundNoise(group=1e-9)).tolist() == list(range(8))
    assert group_starts(np.zeros(0), np.zeros(0, np.bool_), SoundNoise()).tolist() == [0]


def test_a_pair_of_a_round_object_is_one_group_though_its_frequencies_are_split_further() -> None:
    frequencies = np.array([100.0, 103.0, 150.0, 154.0, 200.0, 212.0])
    pairs = np.array([True, False, False, False, True])
    assert group_starts(frequencies, pairs, SoundNoise()).tolist() == [0, 2, 3, 4, 5, 6]


@settings(max_examples=30, deadline=None)
@given(factor=st.floats(0.9, 1.1), seed=st.integers(0, 10_000))
def test_the_scale_between_two_lists_is_among_those_kept(factor: float, seed: int) -> None:
    rng = np.random.default_rng(seed)
    heard = rng.random(len(MODES.frequencies)) < 0.8
    heard[:3] = True
    peaks = factor * MODES.frequencies[heard] * rng.normal(1.0, 0.003, int(heard.sum()))
    scales = likely_scales(np.append(peaks, rng.uniform(500.0, 6000.0, 2)), MODES.frequencies, SoundNoise())
    assert np.exp(scales.log_shares).sum() == pytest.approx(1.0)
    assert np.abs(scales.factors / factor - 1.0).min() < 0.012
