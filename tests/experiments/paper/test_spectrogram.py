"""1.0's sound: what its form holds comes back, what it cannot hold is gone, and training beats silence."""

from pathlib import Path

import numpy as np
import pytest

from experiments.paper.rendering import FitSpec, RenderingWork
from experiments.paper.sound import SpectrumBasis, StrikeBench, sound_methods, sound_of_spectrum, summed
from harness.authoring.audio.data import split_nodes
from harness.basics.materials import MATERIALS
from harness.basics.mesh import Mesh
from harness.basics.store import Store
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
    exact = summed(bench.modes.frequencies[basis.modes], bench.rates[basis.modes], gains, "double")
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


def test_a_network_that_was_trained_for_seconds_is_nearer_than_silence(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    pytest.importorskip("torch", reason="torch is in the extra `author`, which is not installed")
    small = FitSpec(depth=2, width=64, steps=100, batch=2048, rate=4e-3)
    monkeypatch.setattr("experiments.paper.sound.SPECTROGRAM", small)
    bench = plate_bench()
    work = RenderingWork(Store(tmp_path), lambda doing, share: None)
    method = next(each for each in sound_methods(bench, work) if each.column == "1.0 here")
    sound = method.make().render(0)
    assert np.isfinite(sound).all()
    silence = bench.scores(0, np.zeros_like(sound))
    assert bench.scores(0, sound)["stft_distance"] < silence["stft_distance"]
