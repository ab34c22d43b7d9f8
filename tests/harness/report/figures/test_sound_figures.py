"""Pictures of what was heard: drawn, not empty, and showing what they were given."""

from dataclasses import replace
from io import BytesIO
from pathlib import Path

import matplotlib.image as mpl_image
import numpy as np
import pytest
from matplotlib.figure import Figure

from harness.basics.arrays import AnyArray, FloatArray
from harness.experiment.report_content import Missing
from harness.objects.household import build
from harness.report.figures.figures import Album
from harness.report.figures.pictures import Posterior, close_up, object_sides
from harness.report.figures.sound import senses_figure, spectrogram_pair

TIMES = np.linspace(0.01, 0.39, 40)
FREQUENCIES = np.linspace(0.0, 12_000.0, 120)


def decay(frequency: float) -> FloatArray:
    """Levels of one mode that dies away, over a floor of -90 dB."""
    line = -0.5 * ((FREQUENCIES - frequency) / 80.0) ** 2
    return np.maximum(line[:, None] - 100.0 * TIMES[None], -90.0)


def drawn(figure: Figure) -> AnyArray:
    file = BytesIO()
    figure.savefig(file, format="png")
    file.seek(0)
    return np.asarray(mpl_image.imread(file))[..., :3]


def ink(figure: Figure) -> float:
    """Share of the picture that is not white."""
    return float(np.mean(np.any(drawn(figure) < 0.98, axis=2)))


def levels_of(figure: Figure, panel: int) -> FloatArray:
    collection = figure.axes[panel].collections[0]
    return np.asarray(collection.get_array(), np.float64).reshape(len(FREQUENCIES), len(TIMES))


def test_a_spectrogram_pair_is_drawn_with_its_difference(tmp_path: Path) -> None:
    figure = spectrogram_pair(TIMES, FREQUENCIES, decay(4000.0), decay(4500.0))
    assert ink(figure) > 0.4
    assert np.any(levels_of(figure, 2) > 20.0)
    assert np.any(levels_of(figure, 2) < -20.0)
    picture = Album(tmp_path).photograph("sound", figure)
    assert (tmp_path / picture.file).stat().st_size > 10_000


def test_equal_sounds_differ_nowhere_whatever_their_loudness() -> None:
    figure = spectrogram_pair(TIMES, FREQUENCIES, decay(4000.0) - 5.0, decay(4000.0) + 12.0)
    assert levels_of(figure, 2) == pytest.approx(0.0, abs=1e-9)
    assert levels_of(figure, 0).max() == pytest.approx(0.0)


def test_levels_that_do_not_fit_their_axes_are_refused() -> None:
    with pytest.raises(ValueError, match="simulated"):
        spectrogram_pair(TIMES, FREQUENCIES, decay(4000.0), decay(4000.0).T)
    with pytest.raises(ValueError, match="recorded"):
        spectrogram_pair(TIMES, FREQUENCIES, np.full((120, 40), -np.inf), decay(4000.0))


def test_each_sense_has_a_column_and_its_own_place() -> None:
    mesh = build("mug")
    rng = np.random.default_rng(3)
    places = mesh.vertices[rng.integers(len(mesh.vertices), size=2000)]

    def about(centre: FloatArray, width: float) -> Posterior:
        weights = np.exp(-0.5 * (np.linalg.norm(places - centre, axis=1) / width) ** 2)
        return Posterior(places, weights, centre, centre[None], np.ones(1), 2.1 * width)

    shots = (
        *object_sides(mesh, places[0], 120).shots,
        close_up(mesh, places[0], np.array([0.2, 0.1, 1.0]), 0.04, 120),
    )
    touch = about(places[0], 0.02)
    senses = {"touch": touch, "audio": about(places[1], 0.03), "both": about(places[0], 5e-3)}
    figure = senses_figure(shots, senses, truth=places[0])
    assert len(figure.axes) == 9
    titles = [axes.get_title() for axes in figure.axes]
    assert [title.split("\n")[0] for title in titles if title] == ["touch", "audio", "both"]
    assert "10.5 mm" in titles[2]
    assert ink(figure) > 0.1
    pictures = [np.asarray(axes.images[0].get_array()) for axes in figure.axes]
    assert not np.array_equal(pictures[0], pictures[1])
    same = senses_figure(shots, {"one": touch, "other": replace(touch)})
    one, other = (np.asarray(axes.images[0].get_array()) for axes in same.axes[:2])
    assert np.array_equal(one, other)


@pytest.mark.parametrize("away", [(0.0, 0.0, 1.0), (0.3, -0.2, 0.0), (0.0, 0.5, -0.4)])
def test_a_close_up_has_its_place_in_the_middle_and_its_width_across(away: tuple[float, ...]) -> None:
    mesh = build("mug")
    place = mesh.vertices[7]
    camera = close_up(mesh, place, np.array(away), 0.05, 100).camera
    middle = camera.project(place[None])[0][0]
    assert middle == pytest.approx([50.0, 50.0], abs=1.0)
    aside = np.cross(np.array(away), [0.3, 0.4, 0.5])
    aside *= 0.01 / np.linalg.norm(aside)
    moved = camera.project((place + aside)[None])[0][0]
    assert np.linalg.norm(moved - middle) == pytest.approx(20.0, abs=0.5)


def test_a_sense_without_an_answer_leaves_the_object_bare() -> None:
    mesh = build("mug")
    shots = object_sides(mesh, mesh.vertices[0], 80).shots
    place = mesh.vertices[0]
    found = Posterior(place[None], np.ones(1), place, place[None], np.ones(1), 3e-3)
    figure = senses_figure(shots, {"touch": Missing("it is another object"), "sound": found})
    bare, heated = (np.asarray(axes.images[0].get_array()) for axes in figure.axes[:2])
    assert np.array_equal(bare, shots[0].picture())
    assert not np.array_equal(bare, heated)
    assert figure.axes[0].get_title() == "touch\nno answer"
    assert len(figure.axes[0].collections) == 0


def test_no_sense_is_no_picture() -> None:
    mesh = build("mug")
    with pytest.raises(ValueError, match="posterior"):
        senses_figure(object_sides(mesh, mesh.vertices[0], 40).shots, {})
