"""Each sense's numbers are chi-squares where the model is right: drawn from their own noise, in no bench."""

import numpy as np
import pytest
from scipy.stats import kstest

from harness.agreement.arm import ContactDepth, depth_residuals, twisted
from harness.agreement.place_noise import POSITION, shared_twists, twist_covariance
from harness.agreement.sound import ResonanceNoise, matched, resonance_residual
from harness.basics.geometry import apply, inverse, rotation_from_vector, transform
from harness.bench.gap import USUAL

POSE = transform(rotation_from_vector(np.array([0.3, 2.0, -0.4])), np.array([-0.40, 0.05, 0.31]))
ANCHOR = np.array([-0.42, 0.0, 0.25])
MODES = np.array([900.0, 1500.0, 2100.0, 3300.0, 4700.0, 6100.0, 8000.0])


def test_depths_that_share_errors_are_independent_given_those_before() -> None:
    rng = np.random.default_rng(1)
    shared = rng.normal(scale=0.5e-3, size=(5, 13))
    found = []
    for _ in range(400):
        gaps = shared @ rng.normal(size=13) + 0.3e-3 * rng.normal(size=5)
        depths = [ContactDepth(k, 1e-3 + gap, 1e-3, shared[k], 0.3e-3) for k, gap in enumerate(gaps)]
        found.append([residual.chi_square for residual in depth_residuals(depths)])
    for column in np.array(found).T:
        assert kstest(column, "chi2", args=(1,)).pvalue > 1e-3
    signs = np.sqrt(np.array(found))
    assert np.abs(np.corrcoef(signs.T) - np.eye(5)).max() < 0.2


def test_a_shared_error_is_counted_once() -> None:
    """Three contacts that are all off alike by two sigmas are one doubt, not three."""
    alike = np.zeros(13)
    alike[0] = 1e-3
    depths = [ContactDepth(k, 3e-3, 1e-3, alike, 0.05e-3) for k in range(3)]
    first, *later = (residual.chi_square for residual in depth_residuals(depths))
    assert first == pytest.approx(4.0, rel=0.02)
    assert max(later) < 0.5


@pytest.mark.parametrize("which", range(7))
def test_what_an_object_is_off_by_moves_the_gel_in_its_frame(which: int) -> None:
    """To first order, against moving the object itself."""
    # A larger object's own points are farther apart too, which no twist is: its size is seen at the centre.
    point = np.array([[0.004, -0.003, 0.0]]) * (which < 6)
    unit = np.zeros(7)
    unit[which] = 1e-2
    sigmas = np.array([POSITION] * 3 + [USUAL.tilt, USUAL.tilt, USUAL.yaw, USUAL.scale])
    moved, turn, grown = np.split(sigmas * unit, [3, 6])
    base_from_object = transform(rotation_from_vector(turn) * (1.0 + grown), ANCHOR + moved)
    undone = np.linalg.inv(base_from_object) @ POSE
    twist = shared_twists(USUAL, POSE, ANCHOR)[:, which] * 1e-2
    stated = inverse(transform(np.eye(3), ANCHOR)) @ twisted(POSE, twist)
    apart = apply(undone, point) - apply(stated, point)
    assert np.linalg.norm(apart) < 2e-2 * np.linalg.norm(twist[:3]) + 1e-7


def test_a_covariance_can_be_drawn_from() -> None:
    assert np.linalg.eigvalsh(twist_covariance(USUAL, POSE, ANCHOR)).min() > 0.0


def test_modes_that_all_sound_higher_explain_every_peak() -> None:
    found = matched(1.06 * MODES, MODES, ResonanceNoise())
    assert found.explained.all()
    assert found.factor == pytest.approx(1.06, abs=0.01)


def test_peaks_of_another_object_are_improbable() -> None:
    """Set in the middle of the gaps between modes, where no common factor brings them near."""
    noise = ResonanceNoise()
    own = resonance_residual(3, MODES, MODES, noise)
    strange = resonance_residual(3, np.sqrt(MODES[1:] * MODES[:-1]), MODES * 1.4, noise)
    assert own.chi_square == 0.0
    assert strange.numbers["unexplained"] > own.numbers["unexplained"]
    assert strange.chi_square > own.chi_square


def test_an_object_without_modes_explains_nothing() -> None:
    assert resonance_residual(0, MODES, np.zeros(0), ResonanceNoise()).numbers["unexplained"] == len(MODES)
