"""How far sounds and gains are from the ones they stand for, and what costs nothing to compare with.

The distances of ObjectFolder 2.0 (Gao et al., CVPR 2022, table 2) leave their constants open. Here
the window is Hann's of 400 samples, zero-padded to 512, every 160 samples of sound at 44.1 kHz,
unscaled; both sounds are divided by the reference's peak, as the renderer published with the paper
divides by it.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from scipy.fft import next_fast_len
from scipy.signal import hilbert
from scipy.sparse import coo_array, diags_array
from scipy.sparse.linalg import splu
from scipy.spatial import cKDTree

from harness.authoring.audio.data import Split
from harness.basics.arrays import AnyArray, FloatArray
from harness.basics.errors import WrongUse
from harness.sim.modal.modes import Modes

RATE = 44.1e3
"""Samples per second that the distances are defined at."""

DURATION = 3.0
"""s of sound that the distances are taken over."""

WINDOW, HOP, POINTS = 400, 160, 512

_SILENT = -400.0
"""dB, for two sounds that are the same."""


@dataclass(frozen=True)
class SoundDistances:
    """How far one sound is from another."""

    stft: float
    """mean over frames and bins of the squared difference of the real parts and of the imaginary parts,
    added."""
    envelope: float
    """root mean square difference of the envelopes, which are the magnitudes of the analytic signals."""
    spectral_db: float
    """energy of the difference of the spectra over the reference's, which no scale of both sounds changes."""


def sound_distances(found: FloatArray, reference: FloatArray) -> SoundDistances:
    """Of two sounds of the same length at ``RATE``.

    Raises:
        WrongUse: lengths that differ or are below a window, or a reference that is silent.
    """
    peak = float(np.abs(reference).max(initial=0.0))
    if found.shape != reference.shape or found.ndim != 1 or len(found) < WINDOW or not peak > 0.0:
        raise WrongUse(
            f"sounds of shapes {found.shape} and {reference.shape}, the second with a peak of {peak:g}, "
            f"cannot be compared; give two of the same length, {WINDOW} samples or more, that sound"
        )
    one, other = found / peak, reference / peak
    spectrum = short_time_spectrum(other)
    difference = np.abs(short_time_spectrum(one) - spectrum) ** 2
    energy = float((np.abs(spectrum) ** 2).sum())
    share = float(difference.sum()) / energy
    envelope = float(np.sqrt(((_envelope(one) - _envelope(other)) ** 2).mean()))
    level = 10.0 * np.log10(share) if share > 0.0 else _SILENT
    return SoundDistances(float(difference.mean()), envelope, float(max(level, _SILENT)))


def short_time_spectrum(sound: FloatArray) -> AnyArray:
    """``(frames, POINTS // 2 + 1)`` complex; a last part shorter than a window is left out."""
    window = 0.5 - 0.5 * np.cos(2.0 * np.pi * np.arange(WINDOW) / WINDOW)
    frames = sliding_window_view(sound, WINDOW)[::HOP] * window
    return np.asarray(np.fft.rfft(frames, POINTS, axis=1))


def _envelope(sound: FloatArray) -> FloatArray:
    whole = hilbert(sound, next_fast_len(len(sound)))[: len(sound)]
    return np.abs(np.asarray(whole))


def relative_errors(found: AnyArray, shapes: FloatArray) -> FloatArray:
    """``(k,)``: the norm over modes and directions of the difference of ``(k, m, 3)`` over the shapes'."""
    count = len(shapes)
    wrong = np.linalg.norm((found - shapes).reshape(count, -1), axis=1)
    errors: FloatArray = wrong / np.linalg.norm(shapes.reshape(count, -1), axis=1)
    return errors


def nearest_trained(modes: Modes, split: Split) -> FloatArray:
    """``(k, m, 3)`` at the held-out nodes: the shapes of the trained node nearest to each."""
    nearest = cKDTree(modes.points[split.trained]).query(modes.points[split.held_out])[1]
    found: FloatArray = modes.shapes[split.trained[nearest]]
    return found


def interpolated(modes: Modes, split: Split) -> FloatArray:
    """``(k, m, 3)`` at the held-out nodes: linear on the surface between trained ones.

    That is the piecewise linear field of least Dirichlet energy through the trained nodes (with
    weights of cotangents; Pinkall and Polthier, Experimental Mathematics 2, 1993), which is exact
    for any linear field on a flat surface.
    """
    stiffness = _dirichlet(modes)
    rows = stiffness[split.held_out]
    known = modes.shapes[split.trained].reshape(len(split.trained), -1)
    solved = splu(rows[:, split.held_out].tocsc()).solve(-(rows[:, split.trained] @ known))
    found: FloatArray = solved.reshape(len(split.held_out), *modes.shapes.shape[1:])
    return found


def _dirichlet(modes: Modes) -> Any:
    """Sparse ``(n, n)`` matrix of the energy; cotangents below zero count as none."""
    count = len(modes.points)
    corners = modes.points[modes.faces]
    rows, columns, weights = [], [], []
    for apex in range(3):
        one, other = (apex + 1) % 3, (apex + 2) % 3
        u, v = corners[:, one] - corners[:, apex], corners[:, other] - corners[:, apex]
        crossed = np.linalg.norm(np.cross(u, v), axis=1)
        cotangent = np.einsum("fd,fd->f", u, v) / np.maximum(crossed, 1e-300)
        rows.append(modes.faces[:, one])
        columns.append(modes.faces[:, other])
        weights.append(np.clip(cotangent, 1e-3, 1e3))
    half = coo_array(
        (np.concatenate(weights), (np.concatenate(rows), np.concatenate(columns))), (count, count)
    ).tocsr()
    both = half + half.T
    return (diags_array(np.asarray(both.sum(axis=1))) - both).tocsr()
