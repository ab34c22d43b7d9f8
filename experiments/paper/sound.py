"""Tables 1 and 2 of audio: strikes and their reference, 1.0's two forms, the paper's network, ours.

1.0's network predicts the short-time spectrum of a strike, bin by bin, in the published form: 16 kHz, two
seconds, Hann windows of 400 samples padded to 512 every 160 samples; five inputs, the place, the frequency
and the time, each 0 to 1, and real and imaginary part for unit forces along x, y and z. What lies above 8 kHz
or behind two seconds cannot be in it.
"""

import time
from collections.abc import Mapping
from dataclasses import astuple, dataclass
from functools import cached_property, partial
from typing import Final

import numpy as np
from scipy.signal import ShortTimeFFT, get_window, resample_poly

from experiments.paper.hexahedra import CELLS, hexahedral_modes
from experiments.paper.rendering import (
    Column,
    FitSpec,
    MadeMethod,
    Render,
    RenderingMethod,
    RenderingWork,
    Sense,
    grid_points,
    train_network,
)
from harness.authoring.audio.audio import opened, waves_graph
from harness.authoring.audio.data import SoundSamples, Split, canonical, split_nodes, wave_number
from harness.authoring.audio.metrics import DURATION, RATE, sound_distances
from harness.authoring.audio.object_audio import MODES
from harness.authoring.audio.profiles import PROFILES, WavesSpec
from harness.authoring.audio.waves import fit_enough_waves
from harness.basics.arrays import AnyArray, BoolArray, FloatArray, IntArray
from harness.basics.errors import MeshRefused
from harness.basics.materials import Material
from harness.basics.mesh import Mesh
from harness.basics.store import digest
from harness.objectfile.audio.part import NETWORK, network_tensors
from harness.objectfile.entries import Domain, Input, Tensor
from harness.objectfile.runtime import Network
from harness.objectfile.vision_tensors import graph_input
from harness.sim.modal.modal import HEARING, default_edge, solved_once
from harness.sim.modal.modes import Modes, dampings
from harness.sim.sound.modal_sound import audible
from harness.sim.sound.synthesis import SynthesisLevel, synthesize

SPECTROGRAM: Final = FitSpec(steps=320)
"""1.0's AudioNet: 4 layers of 256 for its 3 x 8."""

AUDIONET: Final = FitSpec(depth=8, skip=5, batch=256, rate=1e-3)
"""2.0's AudioNet, with the published layers; it learns for epochs, not for steps."""

AUDIONET_EPOCHS: Final = 12
"""Passes over the nodes to learn from, and as many places between them."""

STRIKE_SEED = 0
"""Of the split, and of first weights."""


@dataclass(frozen=True, eq=False)
class StrikeBench:
    """Unit impulses along the normal at held-out nodes."""

    mesh: Mesh  #: of the object.
    material: Material  #: of all of it.
    modes: Modes  #: of the reference, quadratic tetrahedra, canonical.
    split: Split  #: of its surface's nodes.
    nodes: AnyArray  #: ``(n,)`` held-out nodes that are struck.

    sense: Sense = "audio"

    @property
    def count(self) -> int:
        """Strikes."""
        return len(self.nodes)

    @cached_property
    def identity(self) -> str:
        """Of the reference and of the strikes."""
        return digest([self.lesson, self.rates, self.nodes])

    @cached_property
    def lesson(self) -> str:
        """Of all that networks learn from."""
        modes = self.modes
        return digest([modes.points, modes.shapes, modes.frequencies, self.rates, self.split.trained])

    @cached_property
    def rates(self) -> FloatArray:
        """``(m,)`` 1/s: dampings of the reference's modes."""
        return dampings(self.modes.frequencies, self.material)

    def strike(self, number: int) -> tuple[FloatArray, FloatArray]:
        """``(3,)`` m and ``(3,)`` unit: place and normal of a strike."""
        node = self.nodes[number]
        return self.modes.points[node], self.modes.normals[node]

    def reference(self, number: int) -> FloatArray:
        """``(t,)`` the exact sum of the reference's modes."""
        node = self.nodes[number]
        gains = self.modes.shapes[node] @ self.modes.normals[node]
        return sum_modes(self.modes.frequencies, self.rates, gains, "double")

    def scores(self, number: int, rendered: AnyArray) -> Mapping[str, float]:
        """STFT distance and envelope distance."""
        found = sound_distances(rendered, self.reference(number))
        return {"stft_distance": found.stft, "envelope_distance": found.envelope}


def sum_modes(
    frequencies: FloatArray, rates: FloatArray, gains: AnyArray, level: SynthesisLevel = "fast"
) -> FloatArray:
    """Synthesize the ``(t,)`` sound of ``(m,)`` gains, with the length and the rate of the distances."""
    return synthesize(frequencies, rates, np.asarray(gains)[None], DURATION, RATE, level).sound[0]


def strike_bench(mesh: Mesh, material: Material, strikes: int, work: RenderingWork) -> StrikeBench:
    """Choose the strikes of an object; its modes are solved once.

    Raises:
        MeshRefused: a surface that cannot be filled or solved, or without an audible mode.
    """
    work.report("audio: solving the reference's elements", 0.0)
    edge = default_edge(mesh, material, HEARING, MODES)
    modes = canonical(solved_once(mesh, material, HEARING, edge, MODES, work.store)[0])
    if len(modes.frequencies) == 0:
        raise MeshRefused(
            f"the object has no mode up to {HEARING:g} Hz, so it has no sound; take another object"
        )
    split = split_nodes(len(modes.points), seed=STRIKE_SEED)
    chosen = np.linspace(0, len(split.held_out) - 1, min(strikes, len(split.held_out))).astype(np.int64)
    return StrikeBench(mesh, material, modes, split, split.held_out[chosen])


SPECTRUM_RATE = 16e3
SECONDS = 2.0
_WINDOW, _HOP, _POINTS = 400, 160, 512
_UP, _DOWN = 441, 160
"""From 16 kHz to 44.1 kHz."""

_AT_ONCE = 16384
SPECTRUM_FILE = "audio_spectrum.onnx"


@dataclass(frozen=True, eq=False)
class SpectrumBasis:
    """Short-time spectra of single modes: that of a strike is their sum, each times its gain."""

    spectra: AnyArray  #: ``(m, f, t)`` complex64, of each mode below 8 kHz with a gain of 1.
    modes: AnyArray  #: ``(m,)`` which modes of the object these are.

    @classmethod
    def of(cls, bench: StrikeBench) -> "SpectrumBasis":
        """Of the reference's modes."""
        below = np.flatnonzero(audible(bench.modes.frequencies, SPECTRUM_RATE))
        frequencies, rates = bench.modes.frequencies[below], bench.rates[below]
        gains = np.eye(len(below))
        sounds = synthesize(frequencies, rates, gains, SECONDS, SPECTRUM_RATE, "double").sound
        return cls(np.stack([transform().stft(each) for each in sounds]).astype(np.complex64), below)

    @property
    def bins(self) -> tuple[int, int]:
        """Frequencies and frames."""
        return self.spectra.shape[1], self.spectra.shape[2]

    @cached_property
    def places(self) -> FloatArray:
        """``(f t, 2)``: frequency and time of each bin, 0 to 1."""
        return grid_points(0.0, self.bins)

    def spectrum(self, gains: AnyArray) -> AnyArray:
        """``(f, t)`` complex: of ``(m,)`` gains of the modes that are in it."""
        return np.tensordot(gains, self.spectra, axes=1)


def transform() -> ShortTimeFFT:
    """The short-time transform of version 1.0."""
    return ShortTimeFFT(get_window("hann", _WINDOW), _HOP, SPECTRUM_RATE, mfft=_POINTS)


def sound_of_spectrum(spectrum: AnyArray) -> FloatArray:
    """``(t,)``: the sound of an ``(f, t)`` spectrum at 44.1 kHz, with silence behind its end."""
    sound = transform().istft(spectrum, k1=round(SECONDS * SPECTRUM_RATE))
    faster = np.asarray(resample_poly(np.asarray(sound, np.float64), _UP, _DOWN))
    return np.pad(faster, (0, round(DURATION * RATE) - len(faster)))


def spectrum_pair() -> tuple[Input, Tensor]:
    """Describe the input and the output tensor of the network."""
    box = Domain(low=(0.0,) * 5, high=(1.0,) * 5)
    place = graph_input("place", "float64", ("n", 5), "1", "x y z, frequency, time: 0 to 1", box)
    meaning, unit = "real parts for unit forces along x, y, z, then imaginary ones", "s/sqrt(kg)"
    return place, Tensor(name="spectrum", dtype="float32", shape=("n", 6), unit=unit, meaning=meaning)


ANYWHERE = 1.0
"""m: a network that belongs to no object yet does not limit how near to a surface a point is."""

_PROFILES: tuple[tuple[str, Column], ...] = (
    ("smoke", "ours, smallest"),
    ("shipped", "ours"),
    ("standard", "ours, largest"),
)


def sound_methods(bench: StrikeBench, work: RenderingWork) -> list[RenderingMethod]:
    """Return every method of sound."""
    silence = np.zeros(round(DURATION * RATE))
    ours = [
        RenderingMethod(
            f"modes, gains by waves, profile {name}",
            column,
            astuple(PROFILES[name].network),
            partial(_by_waves, bench, PROFILES[name].network),
        )
        for name, column in _PROFILES
    ]
    return [
        RenderingMethod("silence", "other", (), lambda: MadeMethod(lambda _: silence), "needs no training"),
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
            f"its layers; trained here for {AUDIONET_EPOCHS} epochs, last layer solved",
        ),
        *ours,
    ]


def _by_waves(bench: StrikeBench, spec: WavesSpec) -> MadeMethod:
    modes, begun = bench.modes, time.process_time()
    trained = bench.split.trained
    nodes = SoundSamples(modes.points[trained], modes.shapes[trained])
    fit = fit_enough_waves(nodes, np.arange(len(trained)), wave_number(modes), spec, STRIKE_SEED)
    network = opened(waves_graph(fit.network, spec.storage), len(modes.frequencies))
    return MadeMethod(_by_gains(bench, network), time.process_time() - begun)


def _by_audionet(bench: StrikeBench, work: RenderingWork) -> MadeMethod:
    lesson, settings = bench.lesson, AUDIONET_EPOCHS
    data, seconds = train_network(work, "audionet", "AudioNet", bench, AUDIONET, lesson, settings)
    points, gains = network_tensors(len(bench.modes.frequencies), ANYWHERE)
    return MadeMethod(_by_gains(bench, Network(data, NETWORK, [points], [gains])), seconds)


def _by_gains(bench: StrikeBench, network: Network) -> Render:
    def observe(number: int) -> AnyArray:
        point, normal = bench.strike(number)
        gains = network({"points": point[None]})["gains"][0].astype(np.float64) @ normal
        return sum_modes(bench.modes.frequencies, bench.rates, gains)

    return observe


def _by_spectrogram(bench: StrikeBench, work: RenderingWork) -> MadeMethod:
    what = "the spectrogram network"
    data, seconds = train_network(work, "spectrogram", what, bench, SPECTROGRAM, bench.lesson)
    place, spectrum = spectrum_pair()
    network, basis = Network(data, SPECTRUM_FILE, [place], [spectrum]), SpectrumBasis.of(bench)
    low, high = bench.mesh.bounds

    def sound(number: int) -> FloatArray:
        point, normal = bench.strike(number)
        rows = np.empty((len(basis.places), 5))
        rows[:, :3], rows[:, 3:] = (point - low) / (high - low), basis.places
        starts = range(0, len(rows), _AT_ONCE)
        runs = [network({"place": rows[k : k + _AT_ONCE]})["spectrum"] for k in starts]
        values = np.concatenate(runs).astype(np.float64)
        along = values[:, :3] @ normal + 1j * (values[:, 3:] @ normal)
        return sound_of_spectrum(along.reshape(basis.bins))

    return MadeMethod(sound, seconds)


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
        return sum_modes(modes.frequencies, rates, modes.at(point) @ normal)

    return MadeMethod(observe, time.process_time() - begun)


_QUADRATIC_PARTS = 4
"""Triangles that the surface of a ten-node cell's face is listed as."""


def between_nodes(modes: Modes, allowed: BoolArray, each: int, seed: int) -> SoundSamples:
    """Sample points between nodes, equally many in each face, with the interpolated mode shapes.

    The interpolation is quadratic in each face of a ten-node cell if ``modes`` lists the middle nodes,
    else linear in each triangle. Places and shapes of the curved face belong together. Faces with a node that
    is not among the ``(n,)`` allowed ones give nothing.
    """
    faces, quadratic = _elements(modes.faces)
    faces = np.repeat(faces[allowed[faces].all(axis=1)], each, axis=0)
    shares = np.random.default_rng([seed, 2]).dirichlet(np.ones(3), size=len(faces))
    weights = shares
    if quadratic:
        # Shape functions of a six-node triangle: corners, then middles of ab, bc, ca.
        a, b, c = shares.T
        corners = [a * (2.0 * a - 1.0), b * (2.0 * b - 1.0), c * (2.0 * c - 1.0)]
        weights = np.stack([*corners, 4.0 * a * b, 4.0 * b * c, 4.0 * c * a], axis=1)
    points = np.einsum("kc,kcd->kd", weights, modes.points[faces])
    shapes = np.zeros((len(faces), *modes.shapes.shape[1:]))
    for node in range(faces.shape[1]):
        shapes += weights[:, node, None, None] * modes.shapes[faces[:, node]]
    return SoundSamples(points, shapes)


def _elements(faces: IntArray) -> tuple[IntArray, bool]:
    """Group faces into quadratic triangles ``(f, 6)`` and return True, or return the triangles and False."""
    count, rest = divmod(len(faces), _QUADRATIC_PARTS)
    if rest or count == 0:
        return faces, False
    first, second, third, inner = faces.reshape(_QUADRATIC_PARTS, count, 3)
    middles = (first[:, 1], second[:, 2], third[:, 0])
    again = (second[:, 0], third[:, 1], first[:, 2])
    same = [np.array_equal(inner[:, side], middles[side]) for side in range(3)]
    if not all(same) or not all(map(np.array_equal, middles, again)):
        return faces, False
    corners = (first[:, 0], second[:, 1], third[:, 2])
    return np.stack([*corners, *middles], axis=1), True
