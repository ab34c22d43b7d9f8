"""1.0's sound: what its form holds comes back, what it cannot hold is gone, and training beats silence."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from experiments.paper.rendering import FitSpec, RenderingWork
from experiments.paper.sound import (
    SpectrumBasis,
    StrikeBench,
    between_nodes,
    sound_methods,
    sound_of_spectrum,
    sum_modes,
)
from harness.authoring.audio.data import split_nodes
from harness.basics.materials import MATERIALS
from harness.basics.mesh import Mesh
from harness.basics.store import Store
from harness.sim.modal.modes import Modes
from harness.sim.solid.tetrahedra import quadratic_mesh
from tests.samples.object_bench import MODES, egg, egg_modes
from tests.samples.sounding_plate import plate_modes


def plate_bench(scale: float = 1.0) -> StrikeBench:
    modes = plate_modes(scale=scale)
    split = split_nodes(len(modes.points), seed=0)
    mesh = Mesh(modes.points, modes.faces)
    flat = np.abs(modes.normals[split.held_out, 2]) > 0.9
    return StrikeBench(mesh, MATERIALS["ceramic"], modes, split, split.held_out[flat][:3])


def test_the_exact_spectrum_sounds_as_the_sum_of_the_modes_below_8_khz() -> None:
    bench = plate_bench()
    basis = SpectrumBasis.of(bench)
    node = bench.nodes[0]
    gains = (bench.modes.shapes[node] @ bench.modes.normals[node])[basis.modes]
    exact = sum_modes(bench.modes.frequencies[basis.modes], bench.rates[basis.modes], gains, "double")
    sound = sound_of_spectrum(basis.spectrum(gains))
    assert sound.shape == exact.shape
    # A sound that begins at once has more than 8 kHz holds: what the resampler leaves out is in its onset.
    rung = slice(2205, 44100)
    wrong = np.linalg.norm(sound[rung] - exact[rung]) / np.linalg.norm(exact[rung])
    assert wrong < 0.01


def test_nothing_sounds_behind_two_seconds_nor_of_modes_above_8_khz() -> None:
    bench = plate_bench(scale=8.0)
    basis = SpectrumBasis.of(bench)
    assert (bench.modes.frequencies[basis.modes] < 8e3).all()
    assert len(basis.modes) < len(bench.modes.frequencies)
    assert not sound_of_spectrum(basis.spectrum(np.ones(len(basis.modes))))[round(2.01 * 44100) :].any()


def test_the_reference_is_no_distance_from_itself_and_silence_is() -> None:
    bench = plate_bench()
    assert bench.scores(0, bench.reference(0)) == {"stft_distance": 0.0, "envelope_distance": 0.0}
    silent = bench.scores(0, np.zeros_like(bench.reference(0)))
    assert silent["stft_distance"] > 0.0
    assert silent["envelope_distance"] > 0.0


@pytest.mark.parametrize("column", ["1.0 here", "2.0 here"])
def test_a_network_that_was_trained_for_seconds_is_nearer_than_silence(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, column: str
) -> None:
    pytest.importorskip("torch", reason="torch is in the extra `author`, which is not installed")
    small = FitSpec(depth=2, width=64, steps=100, batch=2048, rate=4e-3)
    monkeypatch.setattr("experiments.paper.sound.SPECTROGRAM", small)
    audionet = FitSpec(depth=3, width=32, octaves=4, skip=2, batch=64, rate=3e-3)
    monkeypatch.setattr("experiments.paper.sound.AUDIONET", audionet)
    bench = plate_bench()
    work = RenderingWork(Store(tmp_path), lambda doing, share: None)
    method = next(each for each in sound_methods(bench, work) if each.column == column)
    sound = method.make().render(0)
    assert np.isfinite(sound).all()
    silence = bench.scores(0, np.zeros_like(sound))
    assert bench.scores(0, sound)["stft_distance"] < silence["stft_distance"]


@pytest.fixture
def ten_node_cell() -> Modes:
    """One cell of ten nodes, its surface listed as the solver lists it."""
    corners = 0.05 * np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
    mesh = quadratic_mesh(corners, np.array([[0, 1, 2, 3]]))
    shapes = np.repeat(mesh.nodes[:, None, :], MODES, axis=1)
    return replace(egg_modes(egg()), points=mesh.nodes, faces=mesh.triangles, shapes=shapes)


def test_places_between_nodes_are_quadratic_in_a_cell_of_ten(ten_node_cell: Modes) -> None:
    def field(points: np.ndarray[tuple[int, ...], np.dtype[np.float64]]) -> object:
        x, y, z = points.T
        return 1.0 + x - 3.0 * y + x * y + 20.0 * z * z - 7.0 * x * z

    shapes = np.repeat(np.asarray(field(ten_node_cell.points))[:, None, None], 3, axis=2)
    modes = replace(ten_node_cell, frequencies=np.array([100.0]), shapes=shapes)
    found = between_nodes(modes, np.full(10, True), each=20, seed=0)
    assert len(found.points) == 80
    assert found.shapes[:, 0, 0] == pytest.approx(np.asarray(field(found.points)), rel=1e-12)


def test_places_between_nodes_never_show_a_node_that_is_held_out(ten_node_cell: Modes) -> None:
    allowed = np.full(10, True)
    allowed[0] = False
    found = between_nodes(ten_node_cell, allowed, each=5, seed=0)
    assert len(found.points) == 5  # one of four faces is without the first corner
    assert found.points.sum(axis=1) == pytest.approx(0.05, rel=1e-12)


def test_triangles_that_are_no_parts_of_larger_ones_are_linear() -> None:
    modes = egg_modes(egg())
    linear = replace(modes, shapes=np.repeat(modes.points[:, None, :], MODES, axis=1))
    found = between_nodes(linear, np.full(len(modes.points), True), each=1, seed=0)
    assert len(found.points) == len(modes.faces)
    assert np.abs(found.shapes[:, 0] - found.points).max() < 1e-15
