from dataclasses import replace

import numpy as np
import pytest
import trimesh

from harness.authoring.audio.data import Split, split_nodes
from harness.authoring.audio.metrics import (
    RATE,
    interpolated,
    nearest_trained,
    relative_errors,
    short_time_spectrum,
    sound_distances,
)
from harness.basics.errors import WrongUse
from harness.sim.modal.modes import Modes

TIMES = np.arange(44_100) / RATE
RING = np.exp(-8.0 * TIMES) * np.sin(2.0 * np.pi * 1234.5 * TIMES)


def test_a_sound_is_at_no_distance_from_itself() -> None:
    found = sound_distances(RING, RING)
    assert (found.stft, found.envelope, found.spectral_db) == (0.0, 0.0, -400.0)


@pytest.mark.parametrize("scale", [1e-6, 1.0, 3e4])
def test_a_scale_of_both_sounds_changes_nothing(scale: float) -> None:
    other = RING + 0.01 * np.cos(2.0 * np.pi * 900.0 * TIMES)
    wanted, found = sound_distances(other, RING), sound_distances(scale * other, scale * RING)
    assert vars(found) == pytest.approx(vars(wanted), rel=1e-9)


def test_a_share_that_is_missing_is_that_many_decibels() -> None:
    assert sound_distances(0.9 * RING, RING).spectral_db == pytest.approx(-20.0, abs=1e-9)


def test_the_envelope_of_a_decay_is_its_exponential() -> None:
    found = sound_distances(0.9 * RING, RING)
    peak = np.abs(RING).max()
    wanted = np.sqrt(np.mean((0.1 * np.exp(-8.0 * TIMES) / peak) ** 2))
    assert found.envelope == pytest.approx(wanted, rel=2e-3)  # the analytic signal of a finite sound


def test_the_spectrum_is_hann_s_of_400_zero_padded_to_512() -> None:
    bin_hz = RATE / 512
    wave = np.cos(2.0 * np.pi * 100 * bin_hz * TIMES)
    spectrum = short_time_spectrum(wave)
    assert spectrum.shape == (1 + (44_100 - 400) // 160, 257)
    assert np.abs(spectrum[3, 100]) == pytest.approx(100.0, rel=1e-3)  # half of the window's sum of 200
    assert np.abs(spectrum[0]).argmax() == 100


@pytest.mark.parametrize(
    ("found", "reference"), [(RING, 0.0 * RING), (RING[:-1], RING), (RING[:100], RING[:100])]
)
def test_what_cannot_be_compared_is_refused(
    found: np.ndarray[tuple[int, ...], np.dtype[np.float64]],
    reference: np.ndarray[tuple[int, ...], np.dtype[np.float64]],
) -> None:
    with pytest.raises(WrongUse, match=r"shapes \(\d+,\) and \(\d+,\)"):
        sound_distances(found, reference)


def test_relative_errors_are_over_modes_and_directions() -> None:
    shapes = np.ones((2, 4, 3))
    wrong = shapes.copy()
    wrong[1, 2, 0] += 0.5
    assert relative_errors(wrong, shapes) == pytest.approx([0.0, 0.5 / np.sqrt(12.0)])


def test_linear_fields_on_a_flat_face_are_interpolated_exactly(egg: Modes) -> None:
    box = trimesh.creation.box([0.1, 0.1, 0.1]).subdivide().subdivide().subdivide()
    points = np.asarray(box.vertices, dtype=np.float64)
    inside = np.flatnonzero((np.abs(points) < 0.03).sum(axis=1) == 2)  # no edge of the box near
    modes = replace(
        egg,
        points=points,
        faces=np.asarray(box.faces, dtype=np.int64),
        shapes=np.repeat(points[:, None, :], 6, axis=1),
    )
    held = inside[::3]
    split = Split(np.setdiff1d(np.arange(len(points)), held), held)
    assert len(held) > 10
    assert np.abs(interpolated(modes, split) - modes.shapes[held]).max() < 1e-12


def test_baselines_are_ordered_on_a_smooth_field(egg: Modes) -> None:
    split = split_nodes(len(egg.points))
    truth = egg.shapes[split.held_out]
    linear = np.median(relative_errors(interpolated(egg, split), truth))
    nearest = np.median(relative_errors(nearest_trained(egg, split), truth))
    assert 0.0 < linear < 0.5 * nearest < 0.5
