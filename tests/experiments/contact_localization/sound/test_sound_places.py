"""Where strikes fall under a hypothesis, the posterior they make, and the arrays for the report."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import find_peaks

from experiments.contact_localization.model import Model, Prior
from experiments.contact_localization.posterior.hypotheses import Hypotheses, anchors
from experiments.contact_localization.posterior.likelihood import Noise
from experiments.contact_localization.posterior.posterior import best_point
from experiments.contact_localization.posterior.search import MOST_HYPOTHESES, Search
from experiments.contact_localization.posterior.strikes import (
    ANCHORS,
    StrikeEvidence,
    by_sound,
    hear,
    sound_nats,
    strike_places,
)
from experiments.contact_localization.report.sound_report import sound_pair, spectrogram
from experiments.contact_localization.sound.gains import gain_table
from experiments.contact_localization.sound.likelihood import SoundNoise, SoundTerm
from experiments.contact_localization.touch.touch import Contact
from harness.basics.arrays import FloatArray
from harness.basics.geometry import frame_facing, rotation_about, transform
from harness.basics.materials import Material
from harness.bench.sensor import GELSIGHT_R15
from harness.sim.optics.tactile_calibration import shipped_calibration
from harness.strikes.peaks import SoundEvidence, analyse
from tests.samples import sounding_plate as plate

MODES = plate.plate_modes()
SPACING = 3.0e-3
MODEL = Model(
    plate.box(plate.LENGTH, plate.WIDTH, plate.THICKNESS),
    GELSIGHT_R15,
    shipped_calibration("gelsight_r15_bench"),
)
TABLE = gain_table(MODES, MODEL.surface(SPACING))
DAMPED = Material("as the strikes are made", 2500.0, 6e10, 0.2, alpha=50.0, beta=0.0)
K = 5
INDENTATION = 1.0e-3


def _search(points: FloatArray, prior: Prior) -> Search:
    """Contacts pressed by the usual millimetre, seen from a base in which the prior is the truth."""
    down = frame_facing(np.array([0.0, 0.0, -1.0]), 0.0)
    pressed = points - [0.0, 0.0, INDENTATION]
    offset = np.array([0.4, -0.1, 0.2])
    rotation = prior.base_from_object
    contacts = [Contact(transform(rotation @ down, rotation @ point + offset)) for point in pressed]
    return Search(contacts, MODEL, prior, SPACING, Noise())


def at(gels: FloatArray, yaws: FloatArray) -> Hypotheses:
    return Hypotheses(gels, yaws, np.zeros(len(yaws)))


def test_strikes_fall_where_the_gel_was_less_its_indentation() -> None:
    points = plate.places(K, np.random.default_rng(0))
    turned = rotation_about(np.array([0.0, 0.0, 1.0]), 0.7)
    search = _search(points, Prior(turned))
    aside = np.array([[0.0, 0.0, 0.0], [1e-3, 0.0, 0.0], [0.0, 2e-3, 0.0]])
    gels = points[0] - np.array([0.0, 0.0, INDENTATION]) + aside
    found, directions = strike_places(search, np.arange(K), at(gels, np.zeros(3)))
    assert found[0] == pytest.approx(points, abs=1e-12)
    assert found[1] == pytest.approx(points + aside[1], abs=1e-12)
    assert directions == pytest.approx(np.tile([0.0, 0.0, -1.0], (3, K, 1)), abs=1e-12)


def test_strikes_fall_aside_together_and_never_along_the_hammer() -> None:
    points = plate.places(K, np.random.default_rng(6))
    search = _search(points, Prior(np.eye(3)))
    gels = np.tile(points[0] - np.array([0.0, 0.0, INDENTATION]), (2, 1))
    aside = np.array([[1e-3, -2e-3, 3e-3], [0.0, 0.0, 1e-3]])
    found, _ = strike_places(search, np.arange(K), at(gels, np.zeros(2)), aside)
    assert found[0] == pytest.approx(points + np.array([1e-3, -2e-3, 0.0]), abs=1e-12)
    assert found[1] == pytest.approx(points, abs=1e-12)


def test_draws_that_fall_aside_have_summed_over_it() -> None:
    """Weights of draws at two places, each heard somewhere about them, are the integrals over the prior."""
    rng = np.random.default_rng(8)
    points = plate.places(K, rng)
    search = _search(points, Prior(np.eye(3)))
    term = SoundTerm(
        analyse(plate.strikes(MODES, points, rng)), TABLE, MODES, DAMPED, SoundNoise(weight=0.02)
    )
    here = points[0] - np.array([0.0, 0.0, INDENTATION])
    both = np.array([here, here + np.array([4e-3, 0.0, 0.0])])
    heard = StrikeEvidence(term, np.arange(K))
    many = at(np.repeat(both, 4000, axis=0), np.zeros(8000))
    drawn = np.exp(heard.nats_of_draws(search, many, rng)).reshape(2, -1)
    nodes, weights = np.polynomial.hermite_e.hermegauss(15)
    x, y = (1e-3 * each.ravel() for each in np.meshgrid(nodes, nodes, indexing="ij"))
    steps = np.column_stack([x, y, np.zeros(len(x))])
    share = np.outer(weights, weights).ravel() / (2.0 * np.pi)
    for place, one in zip(both, drawn, strict=True):
        beside = at(np.tile(place, (len(steps), 1)), np.zeros(len(steps)))
        nats = sound_nats(search, term, np.arange(K), beside, between=True, aside=steps)
        summed = share @ np.exp(nats)
        assert abs(one.mean() - summed) < 4.0 * one.std() / np.sqrt(one.size)


def test_sound_beside_images_is_weighed_as_such_and_alone_otherwise() -> None:
    rng = np.random.default_rng(9)
    strikes = plate.strikes(MODES, plate.places(K, rng), rng)
    model = replace(MODEL, modes=MODES, material=DAMPED)
    beside, alone = hear(strikes, model, SPACING), hear(strikes, model, SPACING, alone=True)
    assert beside is not None
    assert alone is not None
    assert beside.term.weight == SoundNoise().weight
    assert alone.term.weight == SoundNoise().alone


def test_only_the_struck_contacts_are_asked_for_in_their_order() -> None:
    points = plate.places(K, np.random.default_rng(1))
    search = _search(points, Prior(np.eye(3)))
    gels = points[:1] - [0.0, 0.0, INDENTATION]
    found, _ = strike_places(search, np.array([3, 1]), at(gels, np.zeros(1)))
    assert found[0] == pytest.approx(points[[3, 1]], abs=1e-12)


def test_a_yaw_turns_places_and_directions_together() -> None:
    points = plate.places(K, np.random.default_rng(2))
    nominal, off = _search(points, Prior(np.eye(3))), np.array([0.4])
    gels = points[:1] - [0.0, 0.0, INDENTATION]
    straight, _ = strike_places(nominal, np.arange(K), at(gels, np.zeros(1)))
    turned, directions = strike_places(nominal, np.arange(K), at(gels, off))
    back = rotation_about(np.array([0.0, 0.0, 1.0]), 0.4)
    assert (turned[0] - turned[0, 0]) @ back.T == pytest.approx(straight[0] - straight[0, 0], abs=1e-12)
    assert np.linalg.norm(directions, axis=2) == pytest.approx(1.0)


def test_sound_alone_finds_the_place_on_a_flat_plate() -> None:
    """Places and axes say nothing between the plate's edges."""
    errors = []
    for seed in range(4):
        rng = np.random.default_rng(seed)
        points = plate.places(K, rng)
        search = _search(points, Prior(np.eye(3)))
        term = SoundTerm(analyse(plate.strikes(MODES, points, rng)), TABLE, MODES, DAMPED)
        found = by_sound(search, term, np.arange(K), np.arange(K))
        answer = best_point(search.contact_places(K - 1, found), found.weights)
        errors.append(np.linalg.norm(answer - points[-1]))
    assert np.median(errors) < 4e-3


def test_sounds_that_say_nothing_leave_the_posterior_of_the_places() -> None:
    points = plate.places(K, np.random.default_rng(4))
    search = _search(points, Prior(np.eye(3)))
    nothing = SoundEvidence(np.ones(K, dtype=np.bool_), ("",) * K, (), (), (0.0, 0.0))
    term = SoundTerm(nothing, TABLE, MODES, DAMPED)
    half = MOST_HYPOTHESES // 2
    parts = [search.places(np.arange(K), int(anchor), most=half) for anchor in anchors(np.arange(K), ANCHORS)]
    assert len(parts) == 2
    nats = np.concatenate([weights for _, _, weights in parts])
    gels, yaws = np.concatenate([g for g, _, _ in parts]), np.concatenate([y for _, y, _ in parts])
    assert np.all(sound_nats(search, term, np.arange(K), at(gels, yaws)) == 0.0)
    found = by_sound(search, term, np.arange(K), np.arange(K))
    kept = nats > nats.max() - 18.0
    assert np.exp(nats[~kept] - nats.max()).sum() < 1e-3 * np.exp(nats - nats.max()).sum()
    assert found.log_weights == pytest.approx((nats - nats.max())[kept])
    assert found.gels == pytest.approx(gels[kept])


@pytest.mark.parametrize("slid", [0, K - 1])
def test_a_contact_that_slid_off_the_object_does_not_carry_the_others_with_it(slid: int) -> None:
    """It was met 15 mm behind the surface; where it would be put on the surface, all others were off it."""
    rng = np.random.default_rng(7)
    points = plate.places(K, rng)
    met = points.copy()
    met[slid, 2] -= 0.015
    search, told = _search(met, Prior(np.eye(3))), np.delete(np.arange(K), slid)
    term = SoundTerm(analyse(plate.strikes(MODES, points[told], rng)), TABLE, MODES, DAMPED)
    found = by_sound(search, term, told, np.arange(K))
    answer = best_point(search.contact_places(2, found), found.weights)
    assert np.linalg.norm(answer - points[2]) < 8e-3


def test_contacts_that_others_hang_on_are_the_first_and_the_last() -> None:
    assert anchors(np.array([1, 3, 4, 7]), 2).tolist() == [1, 7]
    assert anchors(np.array([5]), 2).tolist() == [5]


def test_a_spectrogram_shows_a_tone_where_it_is() -> None:
    times = np.arange(20_000) / plate.RATE
    heard = spectrogram(0.2 * np.sqrt(2.0) * np.sin(2.0 * np.pi * 3000.0 * times), plate.RATE)
    assert heard.levels.shape == (len(heard.frequencies), len(heard.times))
    assert heard.loudest == pytest.approx(0.2, rel=1e-3)
    assert heard.frequencies[np.argmax(heard.levels, axis=0)] == pytest.approx(3000.0, abs=50.0)
    silence = spectrogram(np.zeros(10), plate.RATE)
    assert np.isfinite(silence.levels).all()
    assert silence.loudest == 0.0


def test_recorded_and_simulated_ring_at_the_same_frequencies() -> None:
    rng = np.random.default_rng(5)
    points = plate.places(1, rng)
    strike = plate.strikes(MODES, points, rng, np.ones(12, dtype=np.complex128), 1e-4)[0]
    pair = sound_pair(strike, MODES, DAMPED, points[0], np.array([0.0, 0.0, -1.0]), 1.0)
    for heard in pair:
        level = heard.levels[:, heard.times > 0.03].mean(axis=1)
        tops = find_peaks(level, prominence=10.0)[0]
        assert len(tops) >= 3
        for top in tops:
            # A frame of 20 ms resolves 50 Hz.
            assert np.abs(MODES.frequencies - heard.frequencies[top]).min() < 60.0
