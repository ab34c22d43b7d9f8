"""Pictures of a strike: what is loud is bright there, what is at rest is white, what is small is refined."""

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from matplotlib.figure import Figure

from harness.basics.arrays import FloatArray
from harness.basics.mesh import Mesh
from harness.objects.household import build
from harness.report.figures.figures import Album
from harness.report.figures.pictures import box
from harness.report.figures.sound import (
    MODE_FLOOR,
    SHOWN,
    ShownStrike,
    colourable,
    spectrogram,
    strike_figure,
)

RATE = 44_100.0
FREQUENCIES = np.array([800.0, 2400.0, 5200.0])
DAMPINGS = np.array([8.0, 15.0, 40.0])


def ringing(seconds: float = 1.0) -> FloatArray:
    times = np.arange(round(seconds * RATE)) / RATE
    parts = np.exp(-DAMPINGS[:, None] * times) * np.sin(2.0 * np.pi * FREQUENCIES[:, None] * times)
    return np.asarray(np.array([1.0, 0.5, 0.1]) @ parts)


def height_at_corners(mesh: Mesh, modes: int) -> FloatArray:
    """Each mode pushes up above the middle and down below it."""
    height = mesh.corners[:, :, 2] - mesh.bounds[:, 2].mean()
    return np.repeat(height[:, :, None], modes, axis=2)


@cache
def bowl() -> Mesh:
    return colourable(build("bowl"))


def shown(modes: int = 3) -> ShownStrike:
    mesh = bowl()
    return ShownStrike(
        title="bowl",
        mesh=mesh,
        place=mesh.vertices[5],
        sound=ringing(),
        rate=RATE,
        frequencies=FREQUENCIES[:modes],
        dampings=DAMPINGS[:modes],
        amplitudes=np.array([1.0, 0.5, 0.1])[:modes],
        pushes=height_at_corners(mesh, modes),
    )


def tiles(figure: Figure) -> list[FloatArray]:
    return [np.asarray(axes.images[0].get_array(), np.float64) for axes in figure.axes if axes.images]


def test_a_spectrogram_has_its_modes_where_they_are_and_decays_as_they_do() -> None:
    times, frequencies, levels = spectrogram(ringing(), RATE)
    assert levels.max() == 0.0
    assert levels.min() == MODE_FLOOR
    for frequency, rate in zip(FREQUENCIES, DAMPINGS, strict=True):
        row = levels[np.argmin(np.abs(frequencies - frequency))]
        inside = (times > 0.05) & (times < 0.15)
        slope = np.polyfit(times[inside], row[inside], 1)[0]
        assert slope == pytest.approx(-8.686 * rate, rel=0.05)
    between = levels[np.argmin(np.abs(frequencies - 4000.0)), times > 0.05]
    assert between.max() < -60.0


def test_what_is_silent_is_not_shown() -> None:
    long = np.concatenate([ringing(0.2), np.zeros(round(2.0 * RATE))])
    times = spectrogram(long, RATE)[0]
    assert 0.2 <= times[-1] < 0.3


@pytest.mark.parametrize("samples", [1, 7, 40])
def test_a_sound_of_few_samples_has_a_spectrogram_too(samples: int) -> None:
    for rate in (100.0, RATE):
        times, frequencies, levels = spectrogram(np.ones(samples), rate)
        assert levels.shape == (len(frequencies), len(times))
        assert np.isfinite(levels).all()


def test_red_is_a_push_of_one_sign_and_blue_of_the_other() -> None:
    drawn = tiles(strike_figure(shown(1)))
    assert len(drawn) == 1
    reddish = drawn[0][..., 0] - drawn[0][..., 2]
    upper, lower = reddish[:150], reddish[-150:]
    assert upper.max() > 0.3
    assert lower.min() < -0.2
    flipped = replace(shown(1), pushes=-shown(1).pushes)
    other = tiles(strike_figure(flipped))[0]
    assert (other[..., 2] - other[..., 0])[:150].max() > 0.2


def test_a_mode_at_rest_is_white_and_draws_without_a_warning() -> None:
    still = replace(shown(1), pushes=np.zeros_like(shown(1).pushes))
    drawn = tiles(strike_figure(still))[0]
    assert np.ptp(drawn, axis=2).max() < 0.06


def test_every_mode_is_labelled_and_no_more_than_fit_are_drawn(tmp_path: Path) -> None:
    figure = strike_figure(shown())
    texts = [text.get_text() for axes in figure.axes for text in axes.texts]
    assert len(texts) == 3
    assert "800 Hz" in texts[0]
    assert "60 dB in 0.86 s" in texts[0]
    assert "here at 0 dB" in texts[0]
    assert "here at -20 dB" in texts[2]
    picture = Album(tmp_path).photograph("strike", figure)
    assert (tmp_path / picture.file).stat().st_size > 20_000
    many = shown()
    numbers = np.linspace(500.0, 6000.0, 12)
    twelve = replace(
        many,
        frequencies=numbers,
        dampings=np.zeros(12),
        amplitudes=np.append(np.ones(11), 0.0),
        pushes=height_at_corners(many.mesh, 12),
    )
    drawn = strike_figure(twelve)
    assert len(tiles(drawn)) == SHOWN
    assert any("undamped" in text.get_text() for axes in drawn.axes for text in axes.texts)


def test_a_box_of_twelve_faces_is_refined_until_a_mode_is_linear_in_each() -> None:
    coarse = box(np.zeros(3), np.array([0.2, 0.1, 0.01]))
    fine = colourable(coarse)
    sides = np.linalg.norm(fine.corners - np.roll(fine.corners, 1, axis=1), axis=2)
    assert sides.max() <= 0.04 * coarse.diagonal
    assert fine.face_areas.sum() == pytest.approx(coarse.face_areas.sum())
    assert fine.bounds == pytest.approx(coarse.bounds)
    assert colourable(fine) is fine
