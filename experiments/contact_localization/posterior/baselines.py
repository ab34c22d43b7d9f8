"""What an answer is worth that reads no image: the rows that every table must carry.

The translations between contacts alone say much about where on a known object they were
made; a method that reads tactile images must be seen beside them.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.fft import dct, rfft, rfftfreq

from experiments.contact_localization.model import Model, Prior
from experiments.contact_localization.posterior.estimate import Particles, filtered
from experiments.contact_localization.posterior.likelihood import GeometryNoise, Noise
from experiments.contact_localization.posterior.posterior import best_point
from experiments.contact_localization.posterior.search import Search
from experiments.contact_localization.sound.gains import GainTable
from experiments.contact_localization.touch.touch import Contact
from harness.basics.arrays import AnyArray, FloatArray, IntArray, read_only
from harness.basics.errors import WrongUse
from harness.basics.faces.nearest_surface import nearest_point
from harness.basics.materials import Material
from harness.basics.mesh import Mesh
from harness.bench.acquisition import Strike
from harness.sim.modal.modes import Modes, dampings
from harness.sim.solid.surface_samples import random_points

_BY_PLACES = Noise(unread=GeometryNoise(gap=1.2e-3))
"""Noise of the baselines: without sound they have fewer attitudes to choose from."""


def mean_random_error(mesh: Mesh, truth_in_object: FloatArray, count: int = 4000) -> float:
    """Metres: the mean distance from a point drawn evenly from the surface to a ``(3,)`` truth."""
    points = random_points(mesh, count, np.random.default_rng(0))[0]
    return float(np.linalg.norm(points - truth_in_object, axis=1).mean())


def without_images(
    base_from_gels: Sequence[FloatArray], model: Model, prior: Prior, spacing: float, use_axis: bool = False
) -> FloatArray:
    """``(3,)`` metres, on the surface: the last contact, by this alone that all contacts lie on the object.

    Args:
        base_from_gels: ``(4, 4)`` each, in order; only the translations between them are used.
        model: of the object.
        prior: of its orientation.
        spacing: metres between surface samples.
        use_axis: whether the tool is taken to have stood near the surface's normal at every contact.
    """
    contacts = [Contact(np.asarray(pose)) for pose in base_from_gels]
    search = Search(contacts, model, prior, spacing, _BY_PLACES)
    last = len(contacts) - 1
    hypotheses = search.grid(np.arange(len(contacts)), last, use_axis)
    points = search.contact_places(last, hypotheses)
    return nearest_point(model.mesh, best_point(points, hypotheses.weights))


_CHUNK = 512


@dataclass(frozen=True)
class Mfcc:
    """How the features are made."""

    duration: float = 0.5
    """s from the strike on; the paper's are 3 s, a strike at the bench has rung out before."""
    frame: float = 0.046  #: s of one Hann window; frames do not overlap.
    bands: int = 64  #: triangles, evenly spaced in mel.
    lowest: float = 50.0  #: Hz.
    highest: float = 20_000.0  #: Hz, or half the rate if that is lower.
    coefficients: int = 20  #: of the cosine transform that are kept, the first being the mean level.
    range: float = 80.0  #: dB below the loudest band of the sound at which a band's level is cut off.


def mfcc(sound: FloatArray, rate: float, settings: Mfcc) -> FloatArray:
    """``(frames, coefficients)`` of ``(t,)`` sound; all zero for silence.

    Args:
        sound: from the strike on; what is missing of the duration is silence.
        rate: Hz.
        settings: of the features.
    """
    return np.asarray(cepstra(_band_powers(sound[None], rate, settings), settings)[0])


def cepstra(powers: FloatArray, settings: Mfcc) -> FloatArray:
    """``(..., frames, coefficients)`` of ``(..., frames, bands)`` powers, as dB below the loudest."""
    loudest = powers.max(axis=(-2, -1), keepdims=True)
    floor = 10.0 ** (-settings.range / 10.0)
    relative = powers / np.where(loudest > 0.0, loudest, 1.0)
    levels = 10.0 * np.log10(np.maximum(relative, floor))
    heard = np.where(loudest > 0.0, levels, 0.0)
    return np.asarray(dct(heard, type=2, norm="ortho", axis=-1)[..., : settings.coefficients])


def mel_weights(rate: float, size: int, settings: Mfcc) -> FloatArray:
    """``(bands, size / 2 + 1)`` triangles over the lines of a transform of so many samples.

    Raises:
        WrongUse: a band so narrow that no line falls into it.
    """
    highest = min(settings.highest, 0.5 * rate)
    mels = np.linspace(_mel(settings.lowest), _mel(highest), settings.bands + 2)
    edges = np.asarray(700.0 * (10.0 ** (mels / 2595.0) - 1.0))
    lines = rfftfreq(size, 1.0 / rate)
    rising = (lines - edges[:-2, None]) / (edges[1:-1] - edges[:-2])[:, None]
    falling = (edges[2:, None] - lines) / (edges[2:] - edges[1:-1])[:, None]
    weights = np.maximum(0.0, np.minimum(rising, falling))
    if not weights.any(axis=1).all():
        raise WrongUse(
            f"{settings.bands} mel bands from {settings.lowest:g} Hz are narrower than the lines of a "
            f"frame of {settings.frame * 1e3:g} ms; ask for fewer bands or longer frames"
        )
    return np.asarray(weights)


class MfccTable:
    """Features of a strike along the inward normal at every sample of an object, made once.

    Args:
        table: the modes at the samples.
        modes: of the object.
        material: for their damping.
        rate: Hz, of the strikes that will be compared.
        settings: of the features.
    """

    def __init__(
        self, table: GainTable, modes: Modes, material: Material, rate: float, settings: Mfcc | None = None
    ) -> None:
        self._settings, self._rate = settings or Mfcc(), rate
        self._features = self._unit_features(table, modes, material)

    def similarities(self, strike: Strike) -> FloatArray:
        """``(samples,)`` from -1 to 1: the cosine between a strike's features and each sample's.

        Zeros for a strike that cannot be used.
        """
        if strike.fault:
            return np.zeros(len(self._features))
        heard = mfcc(strike.pressure[strike.onset :], strike.rate, self._settings).ravel()
        length = float(np.linalg.norm(heard))
        if length == 0.0:
            return np.zeros(len(self._features))
        return np.asarray(self._features @ (heard / length), dtype=np.float64)

    def _unit_features(self, table: GainTable, modes: Modes, material: Material) -> AnyArray:
        below = modes.frequencies < 0.5 * self._rate
        times = np.arange(round(self._settings.duration * self._rate)) / self._rate
        decays = dampings(modes.frequencies, material)
        powers = np.concatenate(
            [
                _band_powers(
                    (np.exp(-d * times) * np.sin(2.0 * np.pi * f * times) * sounds)[None],
                    self._rate,
                    self._settings,
                )
                for f, d, sounds in zip(modes.frequencies, decays, below, strict=True)
            ]
            or [np.zeros((0, _frames(self._rate, self._settings), self._settings.bands))]
        )
        frames, bands = powers.shape[1:]
        normals = table.surface.normals
        rows = []
        for first in range(0, len(normals), _CHUNK):
            chosen = slice(first, first + _CHUNK)
            gains = np.einsum("nmd,nd->nm", table.at_samples[chosen], normals[chosen])
            # Modes are many lines apart, so that powers add; their interference is left out.
            summed = (gains**2) @ powers.reshape(len(powers), -1)
            features = cepstra(summed.reshape(-1, frames, bands), self._settings).reshape(len(gains), -1)
            lengths = np.linalg.norm(features, axis=1, keepdims=True)
            rows.append((features / np.where(lengths > 0.0, lengths, 1.0)).astype(np.float32))
        return read_only(np.concatenate(rows))


def mfcc_filter(
    search: Search,
    table: MfccTable,
    strikes: Sequence[Strike | None],
    particles: int,
    seed: int,
) -> Particles:
    """The paper's filter over all contacts, by sound alone.

    Args:
        search: the run; its surface is the one that the table was made for.
        table: features of the object.
        strikes: one a contact, None where there is none.
        particles: how many.
        seed: of the start and of the resampling.
    """

    def heard(k: int, at: IntArray, _yaws: FloatArray) -> FloatArray | None:
        strike = strikes[k]
        return None if strike is None else table.similarities(strike)[at]

    return filtered(search, len(strikes), heard, particles, seed)


def _band_powers(sounds: FloatArray, rate: float, settings: Mfcc) -> FloatArray:
    """``(n, frames, bands)`` of ``(n, t)``."""
    size, frames = round(settings.frame * rate), _frames(rate, settings)
    piece = sounds[:, : frames * size]
    padded = np.zeros((len(sounds), frames * size))
    padded[:, : piece.shape[1]] = piece
    window = 0.5 - 0.5 * np.cos(2.0 * np.pi * (np.arange(size) + 0.5) / size)
    spectra = np.abs(rfft(padded.reshape(len(sounds), frames, size) * window, axis=2)) ** 2
    return np.asarray(spectra @ mel_weights(rate, size, settings).T)


def _frames(rate: float, settings: Mfcc) -> int:
    return max(1, round(settings.duration * rate) // round(settings.frame * rate))


def _mel(hertz: float) -> float:
    return float(2595.0 * np.log10(1.0 + hertz / 700.0))
