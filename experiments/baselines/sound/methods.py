"""Ways from a strike to its sound: 1.0's two, the paper's network, ours at three profiles, and silence."""

import time
from dataclasses import astuple

import numpy as np

from experiments.baselines.bench import Column, MadeMethod, Render, RenderingMethod, RenderingWork
from experiments.baselines.settings import AUDIONET, SPECTROGRAM
from experiments.baselines.sound.bench import SEED, StrikeBench, summed
from experiments.baselines.sound.hexahedra import CELLS, hexahedral_modes
from experiments.baselines.sound.spectrogram import (
    SPECTRUM_FILE,
    SpectrumBasis,
    SpectrumNetwork,
    sound_of_spectrum,
    spectrum_pair,
)
from experiments.baselines.stored_graph import stored_graph
from harness.authoring.audio.audio import opened, waves_graph
from harness.authoring.audio.data import SoundSamples, wave_number
from harness.authoring.audio.object_audio import MODES
from harness.authoring.audio.profiles import PROFILES, WavesSpec
from harness.authoring.audio.waves import fit_enough_waves
from harness.basics.arrays import AnyArray, FloatArray
from harness.objectfile.audio.part import NETWORK, network_tensors
from harness.objectfile.runtime import Network
from harness.sim.modal.modal import HEARING
from harness.sim.modal.modes import dampings

_ANYWHERE = 1.0
"""m: a network that belongs to no object yet does not limit how near to a surface a point is."""

_PROFILES: tuple[tuple[str, Column], ...] = (
    ("smoke", "ours, smallest"),
    ("shipped", "ours"),
    ("standard", "ours, largest"),
)


def sound_methods(bench: StrikeBench, work: RenderingWork) -> list[RenderingMethod]:
    """Every row of sound.

    Args:
        bench: of the strikes.
        work: where networks are stored.
    """
    ours = [_profile(bench, name, column) for name, column in _PROFILES]
    return [
        RenderingMethod("silence", "other", (), lambda: _silence(bench), "costs nothing"),
        RenderingMethod(
            "spectrogram AudioNet (1.0)",
            "1.0 here",
            astuple(SPECTROGRAM),
            lambda: _by_spectrogram(bench, work),
            "16 kHz and 2 s, as published",
        ),
        RenderingMethod(
            "exact spectrogram, no network",
            "other",
            (),
            lambda: _exact_spectrogram(bench),
            "the least that 1.0's form can be off by",
        ),
        RenderingMethod(
            "exact gains of hexahedra (1.0)",
            "other",
            (CELLS,),
            lambda: _by_hexahedra(bench),
            f"{CELLS} cubes along the longest side",
        ),
        RenderingMethod(
            "AudioNet (2.0)",
            "2.0 here",
            astuple(AUDIONET),
            lambda: _by_audionet(bench, work),
            f"its layers; trained here for {AUDIONET.epochs} epochs, last layer solved",
        ),
        *ours,
    ]


def _profile(bench: StrikeBench, name: str, column: Column) -> RenderingMethod:
    spec = PROFILES[name].network
    assert isinstance(spec, WavesSpec)
    row = f"modes, gains by waves, profile {name}"
    return RenderingMethod(row, column, astuple(spec), lambda: _by_waves(bench, spec))


def _silence(bench: StrikeBench) -> MadeMethod:
    samples = len(bench.reference(0))
    return MadeMethod(lambda _: np.zeros(samples))


def _by_waves(bench: StrikeBench, spec: WavesSpec) -> MadeMethod:
    modes, begun = bench.modes, time.process_time()
    trained = bench.split.trained
    nodes = SoundSamples(modes.points[trained], modes.shapes[trained])
    fit = fit_enough_waves(nodes, np.arange(len(trained)), wave_number(modes), spec, SEED)
    network = opened(waves_graph(fit.network, spec.storage), len(modes.frequencies))
    return MadeMethod(_by_gains(bench, network), time.process_time() - begun)


def _by_audionet(bench: StrikeBench, work: RenderingWork) -> MadeMethod:
    def train() -> bytes:
        from experiments.baselines.training.published import train_audionet

        return train_audionet(bench, AUDIONET, work.report)

    identity = ("audionet", bench.lesson, astuple(AUDIONET))
    data, seconds = stored_graph(work.store, identity, "AudioNet", train)
    points, gains = network_tensors(len(bench.modes.frequencies), _ANYWHERE)
    return MadeMethod(_by_gains(bench, Network(data, NETWORK, [points], [gains])), seconds)


def _by_gains(bench: StrikeBench, network: Network) -> Render:
    def observe(number: int) -> AnyArray:
        point, normal = bench.strike(number)
        gains = network({"points": point[None]})["gains"][0].astype(np.float64) @ normal
        return summed(bench.modes.frequencies, bench.rates, gains)

    return observe


def _by_spectrogram(bench: StrikeBench, work: RenderingWork) -> MadeMethod:
    def train() -> bytes:
        from experiments.baselines.training.spectrogram import train_spectrogram

        return train_spectrogram(bench, SPECTROGRAM, work.report)

    identity = ("spectrogram", bench.lesson, astuple(SPECTROGRAM))
    data, seconds = stored_graph(work.store, identity, "the spectrogram network", train)
    place, spectrum = spectrum_pair()
    low, high = bench.mesh.bounds
    network = SpectrumNetwork(
        Network(data, SPECTRUM_FILE, [place], [spectrum]), low, high, SpectrumBasis.of(bench)
    )
    return MadeMethod(lambda number: network.sound(*bench.strike(number)), seconds)


def _exact_spectrogram(bench: StrikeBench) -> MadeMethod:
    basis = SpectrumBasis.of(bench)

    def observe(number: int) -> AnyArray:
        node = bench.nodes[number]
        gains: FloatArray = bench.modes.shapes[node] @ bench.modes.normals[node]
        return sound_of_spectrum(basis.spectrum(gains[basis.modes]))

    return MadeMethod(observe)


def _by_hexahedra(bench: StrikeBench) -> MadeMethod:
    begun = time.process_time()
    modes = hexahedral_modes(bench.mesh, bench.material, HEARING, MODES)
    rates = dampings(modes.frequencies, bench.material)

    def observe(number: int) -> AnyArray:
        point, normal = bench.strike(number)
        return summed(modes.frequencies, rates, modes.at(point) @ normal)

    return MadeMethod(observe, time.process_time() - begun)
