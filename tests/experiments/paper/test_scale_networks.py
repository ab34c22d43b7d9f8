"""The paper's own networks: what they take obeys its laws, and rows come from a run's readings."""

from pathlib import Path

import numpy as np
import pytest
from onnx import ModelProto

from experiments.paper.scale_networks import (
    FRAMES,
    LINES,
    RANGE,
    SIDE,
    SIZE_INPUTS,
    STEPS,
    WINDOW,
    crop_of,
    paper_networks,
    sequence_of,
    spectrogram_of,
)
from experiments.paper.scale_samples import PAPER_MAKERS, crop_camera
from experiments.paper.scale_table import PAPER_ROWS, PaperReadings, paper_sizes
from experiments.paper.train import main
from experiments.scale_estimation.explorer import plan
from experiments.scale_estimation.touch.fit import Patch
from experiments.scale_estimation.unseen import train as own
from experiments.scale_estimation.unseen.training.outlines import PLACE, drawn_camera
from experiments.scale_estimation.unseen.training.samples import shape_of
from harness.basics.arrays import BoolArray, ByteArray, FloatArray
from harness.basics.errors import DataRefused, FitRefused, WrongUse
from harness.basics.geometry import transform
from harness.basics.mesh import Mesh
from harness.bench.scene import scene_from_json
from harness.bench.station_file import Station
from harness.objectfile.graph import Nodes, float_value
from harness.objects.household import build
from harness.sim.light.appearance import Appearance, smooth_normals
from harness.sim.light.direct_image import LitObject
from harness.sim.sound.synthesis import synthesize
from mocks.world.world import Body, SceneView

FOCAL = 600.0
RATE = 32e3
BAND = 150.0, 11e3


@pytest.fixture(autouse=True)
def own_store(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("TOUCHSTONE_CACHE", str(tmp_path / "cache"))


def blob(top: int, left: int, rows: int = 480, columns: int = 640) -> tuple[ByteArray, BoolArray]:
    """A box of 60 x 90 pixels whose shade rises along it, on a bench of noise."""
    random = np.random.default_rng(3)
    picture = random.integers(0, 256, (rows, columns, 3)).astype(np.uint8)
    mask = np.zeros((rows, columns), bool)
    mask[top : top + 60, left : left + 90] = True
    picture[top : top + 60, left : left + 90] = np.arange(90)[:, None] + [80, 100, 120]
    return picture, mask


def ringing(rate: float, loudness: float = 1.0) -> FloatArray:
    """``(t,)`` Pa/(N s): two modes, 1 and 3.5 kHz."""
    modes = np.array([1000.0, 3500.0]), np.array([60.0, 90.0]), loudness * np.array([[1.0, 0.5]])
    return np.asarray(synthesize(*modes, 0.3, rate).sound[0])


def test_a_crop_does_not_depend_on_where_the_object_is_or_what_is_behind_it() -> None:
    here, there = (crop_of(*blob(*place), FOCAL) for place in ((200, 250), (80, 20)))
    assert np.array_equal(here, there)
    picture, mask = blob(200, 250)
    picture[~mask] = 255
    assert np.array_equal(crop_of(picture, mask, FOCAL), here)
    assert here.shape == (3, SIDE, SIDE)
    assert here.min() == 0.0
    assert 0.3 < here.max() <= 1.0


def test_a_crop_is_of_an_angle_not_of_pixels() -> None:
    picture, mask = blob(200, 250)
    finer = picture.repeat(2, axis=0).repeat(2, axis=1), mask.repeat(2, axis=0).repeat(2, axis=1)
    assert crop_of(*finer, 2.0 * FOCAL) == pytest.approx(crop_of(picture, mask, FOCAL), abs=1e-6)


@pytest.mark.parametrize("place", [(0, 0), (420, 550), (0, 550)])
def test_an_object_at_the_picture_s_border_is_cropped_all_the_same(place: tuple[int, int]) -> None:
    found = crop_of(*blob(*place), FOCAL)
    assert np.isfinite(found).all()
    assert found == pytest.approx(crop_of(*blob(200, 250), FOCAL))


def test_no_object_is_refused_by_name() -> None:
    picture, mask = blob(200, 250)
    with pytest.raises(FitRefused, match="pixel"):
        crop_of(picture, np.zeros_like(mask), FOCAL)


@pytest.mark.parametrize(("number", "size"), [(0, 0.3), (4, 0.2), (6, 0.5)])
def test_a_crop_to_learn_from_has_the_object_where_the_bench_s_camera_sees_it(
    number: int, size: float
) -> None:
    shape = shape_of(number, 2).surface
    base_from_object = transform(np.eye(3), PLACE)
    base_from_camera = drawn_camera(np.random.default_rng(number))
    body = Body(Mesh(shape.vertices * size, shape.faces), base_from_object, (255, 255, 255))
    seen = SceneView(base_from_camera, 480, 640, FOCAL, []).picture([body])
    mask = (seen != SceneView(base_from_camera, 480, 640, FOCAL, []).picture([])).any(axis=2)
    covered = crop_of(np.full_like(seen, 255), mask, FOCAL)[0]
    count = len(shape.faces)
    tints, places, untextured = np.ones((count, 3, 3)), np.zeros((count, 3, 2)), np.full(count, -1)
    lit = LitObject(Appearance(shape, smooth_normals(shape), tints, places, untextured))
    alpha = lit.render(crop_camera(shape, size, base_from_object, base_from_camera), [], 4).image.alpha
    assert alpha.sum() == pytest.approx(covered.sum(), rel=0.03)
    assert np.abs(alpha - covered).sum() < 0.1 * covered.sum()


def test_a_spectrogram_has_its_modes_on_their_lines_and_fades_as_they_do() -> None:
    found = spectrogram_of(ringing(RATE), RATE, BAND)
    assert found.shape == (1, LINES, FRAMES)
    early = found[0, :, 0]
    loudest = int(early.argmax())
    assert (loudest + 1) / WINDOW == pytest.approx(1000.0)
    late = int(early[20:].argmax()) + 20
    assert (late + 1) / WINDOW == pytest.approx(3500.0)
    # 20 log10(e^-60) a second is 521 dB/s: 12.5 dB in six frames of 4 ms.
    assert 30.0 * (found[0, loudest, 1] - found[0, loudest, 7]) == pytest.approx(12.5, abs=0.3)


def test_the_same_sound_at_another_rate_has_the_same_spectrogram() -> None:
    one, other = (spectrogram_of(ringing(rate), rate, BAND) for rate in (32e3, 50e3))
    above = one > one.max() - 40.0 / 30.0
    assert above.sum() > 50
    assert one[above] == pytest.approx(other[above], abs=0.05)


def test_ten_times_as_loud_is_twenty_decibels_more_everywhere() -> None:
    quiet, loud = (spectrogram_of(ringing(RATE, gain), RATE, BAND) for gain in (1.0, 10.0))
    assert loud - quiet == pytest.approx(20.0 / 30.0)


def test_lines_that_were_not_excited_are_at_the_floor() -> None:
    found = spectrogram_of(ringing(RATE), RATE, (150.0, 2000.0))
    lines = np.arange(1, LINES + 1) / WINDOW
    assert found[0, lines > 2000.0] == pytest.approx(found.max() - RANGE / 30.0)


@pytest.mark.parametrize("response", [np.zeros(9600), np.zeros(10)])
def test_silence_has_no_spectrogram(response: FloatArray) -> None:
    with pytest.raises(FitRefused, match="150 to 11000 Hz"):
        spectrogram_of(response, RATE, BAND)


def test_imprints_are_in_order_and_no_more_than_there_is_room_for() -> None:
    random = np.random.default_rng(1)
    imprints = [random.normal(0.0, 1e-3 * (k + 1), (12, 3)) for k in range(STEPS + 3)]
    rows, last = sequence_of(imprints[:4])
    assert list(np.flatnonzero(last)) == [3]
    backward, _ = sequence_of(imprints[3::-1])
    assert np.array_equal(rows[:4], backward[3::-1])
    everything, at_end = sequence_of(imprints)
    assert list(np.flatnonzero(at_end)) == [STEPS - 1]
    assert np.array_equal(everything[:4], rows[:4])
    with pytest.raises(FitRefused, match="gel"):
        sequence_of([])


def test_imprints_say_nothing_of_where_the_arm_was() -> None:
    random = np.random.default_rng(2)
    imprints = [random.normal(0.0, 2e-3, (12, 3)) for _ in range(3)]
    turn = np.linalg.qr(random.standard_normal((3, 3)))[0]
    moved = [places @ turn.T + random.standard_normal(3) for places in imprints]
    assert sequence_of(moved)[0] == pytest.approx(sequence_of(imprints)[0])


@pytest.mark.parametrize("sense", list(PAPER_MAKERS))
def test_samples_fit_their_network_and_come_again(sense: str) -> None:
    made, again = (PAPER_MAKERS[sense](5, 3, 6) for _ in range(2))
    assert made
    for (inputs, size), (same, as_large) in zip(made, again, strict=True):
        assert {name: values.shape for name, values in inputs.items()} == dict(SIZE_INPUTS[sense])
        assert all(np.isfinite(values).all() for values in inputs.values())
        assert all(np.array_equal(values, same[name]) for name, values in inputs.items())
        assert 0.05 <= size == as_large <= 0.6


def mean_graph(sense: str) -> ModelProto:
    """A graph that gives the mean of the first input as the logarithm."""
    nodes, (name, shape) = Nodes(), SIZE_INPUTS[sense][0]
    axes = list(range(1, len(shape) + 1))
    mean = nodes.add("ReduceMean", name, axes=axes, keepdims=0)
    nodes.add("Unsqueeze", mean, nodes.constant(np.array([1], np.int64)), name="log_size")
    inputs = [float_value(each, ("n", *size)) for each, size in SIZE_INPUTS[sense]]
    return nodes.model(sense, inputs, [float_value("log_size", ("n", 1))], "a mean")


def write_means(folder: Path, *senses: str) -> None:
    for sense in senses:
        (folder / f"{sense}.onnx").write_bytes(mean_graph(sense).SerializeToString())
        (folder / f"{sense}.json").write_text("{}")


def test_a_network_answers_with_the_geometric_mean_of_its_views(tmp_path: Path) -> None:
    write_means(tmp_path, "spectrogram")
    network = paper_networks(tmp_path)["spectrogram"]
    views = [{"spectrogram": np.full((1, LINES, FRAMES), level)} for level in (-1.0, -2.0)]
    assert network.size(views) == pytest.approx(np.exp(-1.5))
    with pytest.raises(DataRefused, match=r"spectrogram\.onnx.*10000.*50 "):
        network.size([{"spectrogram": np.full((1, LINES, FRAMES), 1e4)}])


def test_a_folder_without_networks_without_cards_or_with_another_sense_s_is_refused(tmp_path: Path) -> None:
    with pytest.raises(DataRefused, match=r"picture\.onnx, spectrogram\.onnx, imprints\.onnx"):
        paper_networks(tmp_path)
    write_means(tmp_path, "picture")
    (tmp_path / "picture.json").unlink()
    with pytest.raises(DataRefused, match=r"/picture\.onnx .*scale --to FOLDER"):
        paper_networks(tmp_path)
    write_means(tmp_path, "spectrogram")
    (tmp_path / "spectrogram.onnx").rename(tmp_path / "picture.onnx")
    (tmp_path / "picture.json").write_text("{}")
    with pytest.raises(DataRefused, match=r"picture\.onnx.*'crop'"):
        paper_networks(tmp_path)


def test_rows_are_of_the_networks_there_and_a_missing_reading_is_a_refusal(tmp_path: Path) -> None:
    write_means(tmp_path, *SIZE_INPUTS)
    networks = paper_networks(tmp_path)
    picture, mask = blob(200, 250)
    bare = picture.copy()
    bare[mask] = 0
    patch = Patch(np.random.default_rng(1).normal(0.0, 1e-3, (12, 3)), np.array([0.0, 0.0, 1.0]))
    found = paper_sizes(networks, PaperReadings((picture, bare), FOCAL, [], [patch]))
    assert list(found) == list(PAPER_ROWS.values())
    assert isinstance(found[PAPER_ROWS["spectrogram"]][0], FitRefused)
    assert found[PAPER_ROWS["picture"]][0] == pytest.approx(
        np.exp(crop_of(picture, mask, FOCAL).mean()), rel=1e-3
    )
    assert found[PAPER_ROWS["imprints"]][0] == pytest.approx(
        np.exp(sequence_of([patch.points])[0].mean()), rel=1e-5
    )
    nothing = paper_sizes({"picture": networks["picture"]}, PaperReadings(None, 0.0, [], []))
    assert list(nothing) == [PAPER_ROWS["picture"]]
    assert isinstance(nothing[PAPER_ROWS["picture"]][0], FitRefused)


def test_a_run_that_names_the_networks_of_a_table_is_refused(station: Station) -> None:
    tree = {"schema": 1, "object": {"mesh": "builtin:mug"}, "scale": {"paper_networks": "somewhere"}}
    with pytest.raises(WrongUse, match="tables scale-estimation --set paper_networks"):
        plan(scene_from_json(tree, "the test"), station, build("mug"), 0)


def test_the_command_line_of_the_paper_s_profile_is_refused_in_words(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    to = ["--to", str(tmp_path / "none")]
    assert main(["scale", "--only", "sound", *to]) == 2
    assert "picture, spectrogram, imprints" in capsys.readouterr().err
    assert own.main(["--profile", "paper", *to]) == 2
    assert "experiments.paper.train scale --to FOLDER" in capsys.readouterr().err
    monkeypatch.setattr("harness.authoring.network_program.find_spec", lambda _name: None)
    assert main(["scale", *to]) == 2
    assert "torch" in capsys.readouterr().err
    assert not (tmp_path / "none").exists()
