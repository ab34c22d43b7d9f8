"""The sheet of a comparison: all of the object is on it, and pictures that do not match are refused."""

from dataclasses import replace

import numpy as np
import pytest

from harness.picture.live_picture import compare_live
from harness.report.figures.tiles import live_figure
from tests.samples.exposed_pictures import bench_alone, pictured, taken

IMAGE = pictured(radius=12.0)
MASK = IMAGE.alpha >= 0.5
LARGE = pictured()
FOUND = replace(
    compare_live(taken(LARGE), LARGE, bench_alone(LARGE)),
    live=taken(IMAGE),
    simulated=taken(IMAGE, seed=2),
    silhouette=MASK,
    mask=np.roll(MASK, 3, axis=1),
)
"""Of an object too small for an exposure to be fitted, as one that was."""

WORDS = ("a", "b", "c")


def test_the_sheet_shows_the_object_three_times_and_what_is_around_it() -> None:
    panels = live_figure(FOUND, WORDS).axes
    assert [axes.get_title() for axes in panels] == ["live", "simulated, as exposed", "live - simulated, x 3"]
    shapes = [np.asarray(axes.images[0].get_array()).shape for axes in panels]
    # 24 pixels and 3 more to the right, and a third of that on each side.
    assert shapes == [(24 + 2 * 9, 27 + 2 * 10, 3)] * 3
    assert [axes.get_xlabel() for axes in panels] == ["a", "b", "c"]
    assert len(panels[0].collections) == 2


def test_an_object_at_the_edge_or_not_there_is_shown_all_the_same() -> None:
    whole = replace(FOUND, silhouette=~MASK, mask=MASK)
    none = replace(FOUND, silhouette=MASK & ~MASK, mask=MASK & ~MASK)
    for found in (whole, none):
        assert np.asarray(live_figure(found, WORDS).axes[0].images[0].get_array()).shape == (96, 96, 3)


def test_pictures_of_two_sizes_are_refused() -> None:
    for wrong in (replace(FOUND, live=FOUND.live[1:]), replace(FOUND, mask=MASK[1:])):
        with pytest.raises(ValueError, match="pictures"):
            live_figure(wrong, WORDS)
