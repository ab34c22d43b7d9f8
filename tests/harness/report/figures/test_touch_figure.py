"""The picture of a press: as many panels as there are pictures, and none of another size."""

from dataclasses import replace

import numpy as np
import pytest

from harness.report.figures.touch import TouchPictures, touch_figure

SHOWN = TouchPictures(
    heights=np.linspace(0.0, 1e-3, 12 * 16).reshape(12, 16),
    image=np.full((12, 16, 3), 90, np.uint8),
    background=np.full((12, 16, 3), 80, np.uint8),
    live=None,
    pitch=0.1245e-3,
    words=("deep", "sensor", "", "", "41.00 dB", "20.00 dB"),
)


def titles(shown: TouchPictures) -> list[str]:
    return [axes.get_title() for axes in touch_figure(shown).axes if axes.get_title()]


def test_a_simulated_press_is_three_pictures_and_a_bar_in_millimetres() -> None:
    assert titles(SHOWN) == ["indentation", "simulated", "simulated - background, x 3"]
    figure = touch_figure(SHOWN)
    assert figure.axes[-1].get_ylabel() == "mm"
    drawn = figure.axes[0].images[0].get_array()
    assert drawn is not None
    assert np.asarray(drawn).max() == pytest.approx(1.0)
    assert figure.axes[0].get_ylim()[0] > figure.axes[0].get_ylim()[1]  # rows go down, as in the image


def test_a_live_press_adds_it_and_both_differences() -> None:
    live = replace(SHOWN, live=np.full((12, 16, 3), 95, np.uint8))
    assert titles(live)[3:] == ["live", "live - simulated, x 3", "live - background, x 3"]
    captions = [axes.get_xlabel() for axes in touch_figure(live).axes]
    assert "41.00 dB" in captions
    assert "20.00 dB" in captions
    changed = next(axes for axes in touch_figure(live).axes if axes.get_title().startswith("live - sim"))
    seen = changed.images[0].get_array()
    assert seen is not None
    assert (np.asarray(seen) == int(127.5 + 3 * 5)).all()


def test_a_map_of_nothing_has_a_scale_all_the_same() -> None:
    touch_figure(replace(SHOWN, heights=np.zeros((12, 16))))


def test_pictures_of_another_size_are_refused() -> None:
    for bad in (
        replace(SHOWN, image=np.zeros((12, 15, 3), np.uint8)),
        replace(SHOWN, live=np.zeros((11, 16, 3), np.uint8)),
        replace(SHOWN, heights=np.full((12, 16), np.nan)),
    ):
        with pytest.raises(ValueError, match="pictures"):
            touch_figure(bad)
    with pytest.raises(ValueError, match="captions"):
        touch_figure(replace(SHOWN, live=SHOWN.image, words=SHOWN.words[:3]))
