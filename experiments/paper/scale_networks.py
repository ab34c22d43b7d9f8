"""The paper's networks of scale: one reading to one size, without an interval.

They take a crop of one picture, the spectrogram of one strike, or imprints in order. None of it says where
the camera was, what the object is made of, or where the arm was.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType

import cv2
import numpy as np
from scipy.fft import rfft, rfftfreq

from experiments.scale_estimation.unseen import contact_set
from experiments.scale_estimation.unseen.network import reading_input
from harness.authoring.network_program import read_networks
from harness.basics.arrays import BoolArray, ByteArray, FloatArray
from harness.basics.errors import DataRefused, FitRefused
from harness.objectfile.entries import Tensor
from harness.objectfile.runtime import Network


@dataclass(frozen=True)
class SizeAmounts:
    """Training set sizes and epochs of the networks that estimate scale."""

    shapes: int  #: of the families, a tenth of them held out.
    samples: MappingProxyType[str, int]  #: draws of each shape, by sense.
    epochs: MappingProxyType[str, int]  #: by sense.


SIDE = 64
"""Pixels along each side of a crop."""

FIELD = 0.64
"""Width of a crop in focal lengths: the same angle of view whatever the camera's pixels are."""

WINDOW = 8.0e-3
"""S of a frame of the spectrogram: lines lie 125 Hz apart."""

HOP = 4.0e-3
"""S from one frame to the next."""

LINES = 96
"""Of the spectrogram, from 125 Hz up to 12 kHz."""

FRAMES = 40

RANGE = 60.0
"""DB below a spectrogram's loudest point at which it ends."""

_UNIT = 30.0
"""DB that are 1 in the network's input."""

STEPS = contact_set.MOST
"""Imprints of a sequence; of more, the first."""

SIZE_INPUTS: Mapping[str, tuple[tuple[str, tuple[int, ...]], ...]] = {
    "picture": (("crop", (3, SIDE, SIDE)),),
    "spectrogram": (("spectrogram", (1, LINES, FRAMES)),),
    "imprints": (("imprints", (STEPS, contact_set.IMPRINT)), ("last", (STEPS,))),
}
"""Names and shapes that each network takes."""


def crop_of(picture: ByteArray, mask: BoolArray, focal_px: float) -> FloatArray:
    """Cut the object out of an RGB picture, with a black background; the camera's pose is not used.

    Returns:
        ``(3, SIDE, SIDE)``, 0 black to 1 white, times the fraction of the pixel that the object covers.

    Raises:
        FitRefused: the mask is empty.
    """
    if not mask.any():
        raise FitRefused("the object covers no pixel of the picture; put it where the camera sees it")
    side = max(1, round(FIELD * focal_px))
    shades = np.where(mask[..., None], picture / 255.0, 0.0)
    # A margin of the crop's own size: the object's middle lies in the picture, so no crop reaches beyond.
    padded = np.pad(shades, ((side, side), (side, side), (0, 0)))
    covered = [np.flatnonzero(mask.any(axis=axis)) for axis in (1, 0)]
    top, left = (side + round(0.5 * (int(one[0]) + int(one[-1]) + 1 - side)) for one in covered)
    window = padded[top : top + side, left : left + side]
    small = cv2.resize(window, (SIDE, SIDE), interpolation=cv2.INTER_AREA)
    return np.ascontiguousarray(small.transpose(2, 0, 1))


def spectrogram_of(response: FloatArray, rate: float, band: tuple[float, float]) -> FloatArray:
    """Magnitudes of the short-time spectrum of one strike, in dB.

    Args:
        response: ``(t,)`` Pa/(N s), of one strike; silence follows its end.
        rate: Hz.
        band: Hz, that was excited; lines outside of it are empty.

    Returns:
        ``(1, LINES, FRAMES)`` dB re 1 Pa/N over 30; ``RANGE`` below the loudest point where it is quieter.

    Raises:
        FitRefused: nothing rings within the band.
    """
    length = round(WINDOW * rate)
    starts = np.round(np.arange(FRAMES) * HOP * rate).astype(int)
    long = np.append(response, np.zeros(max(0, int(starts[-1]) + length - len(response))))
    pieces = long[starts[:, None] + np.arange(length)] * np.hanning(length)
    magnitude = np.abs(rfft(pieces, axis=1)) / rate
    lines = rfftfreq(length, 1.0 / rate)
    wanted = np.arange(1, LINES + 1) / WINDOW
    inside = (wanted >= band[0]) & (wanted <= min(band[1], float(lines[-1])))
    levels = np.stack([np.interp(wanted, lines, frame) for frame in magnitude], axis=1) * inside[:, None]
    loudest = float(levels.max())
    if not loudest > 0.0:
        raise FitRefused(
            f"nothing rings from {band[0]:.0f} to {band[1]:.0f} Hz; strike a place of the object that rings"
        )
    decibels = 20.0 * np.log10(np.maximum(levels, loudest * 10.0 ** (-RANGE / 20.0)))
    return np.asarray(decibels[None] / _UNIT)


def sequence_of(imprints: Sequence[FloatArray]) -> tuple[FloatArray, FloatArray]:
    """``(STEPS, IMPRINT)`` extents of each imprint in the order of the presses; ``(STEPS,)`` 1 at the last.

    Args:
        imprints: ``(n, 3)`` m each, places of the object's surface in any frame.

    Raises:
        FitRefused: there is none.
    """
    if not imprints:
        raise FitRefused("the gel touched nothing yet")
    rows, kinds, _ = contact_set.imprint_features(imprints)
    last = np.zeros(STEPS)
    last[int(kinds[:, 0].sum()) - 1] = 1.0
    return rows, last


_GREATEST = 100.0
"""Of any number that a network takes."""

_GREATEST_LOG = 50.0
"""Of a size in m, up or down: far beyond any object, and still a number."""

_TRAIN = "python -m experiments.paper.train scale --to FOLDER"


@dataclass(frozen=True, eq=False)
class PaperNetwork:
    """A trained network."""

    network: Network  #: that runs it.

    def size(self, views: Sequence[Mapping[str, FloatArray]]) -> float:
        """Compute the geometric mean in m of the sizes from one or more readings of one object.

        Raises:
            DataRefused: inputs of another shape, or an output that is no size.
        """
        stacked = {
            tensor.name: np.stack([view[tensor.name] for view in views]).astype(np.float32)
            for tensor in self.network.inputs
        }
        logs = self.network(stacked)["log_size"].astype(np.float64)
        mean = float(logs.mean())
        if not abs(mean) < _GREATEST_LOG:
            raise DataRefused(
                f"{self.network.name} gives {mean:g} for the logarithm of a size in m, and only numbers "
                f"within {_GREATEST_LOG:g} are sizes; train it again: {_TRAIN}"
            )
        return float(np.exp(mean))


def paper_networks(folder: Path) -> dict[str, PaperNetwork]:
    """Open the paper's networks of a folder, by sense.

    Raises:
        DataRefused: there is no network, a card is missing or not JSON, or a graph is not allowed or is of
            another sense.
    """
    size = Tensor(name="log_size", dtype="float32", shape=("n", 1), unit="1", meaning="log of the size in m")
    found = {}
    for sense, data in read_networks(folder, SIZE_INPUTS, _TRAIN).items():
        inputs = [reading_input(name, shape, _GREATEST) for name, shape in SIZE_INPUTS[sense]]
        found[sense] = PaperNetwork(Network(data, f"{sense}.onnx", inputs, [size]))
    return found
