"""The measured beams and hammer blows of the real data, and what beam theory says of them."""

from pathlib import Path
from typing import Literal

import numpy as np
from scipy.io import loadmat
from scipy.optimize import brentq

from harness.basics.arrays import FloatArray
from harness.strikes.pole_fit import ComplexArray

Ends = Literal["free-free", "cantilever"]

HAMMER_RATE = 25600.0
RULER_STEP = 20000.0 / 32768.0
"""Hz between lines: 20 kHz, transforms of 32768 samples."""

MAINS = 50.0


def suspended_beam(data: Path) -> tuple[FloatArray, ComplexArray]:
    """``(1001,)`` Hz and ``(3, 1001)`` accelerance at three places; pyuff's example (ladisk, MIT)."""
    folder = data / "vibration" / "pyuff_accelerance"
    rows = [(folder / f"meas_point_{place}.txt").read_text(encoding="ascii").split() for place in (1, 2, 3)]
    values = np.array([[complex(number) for number in row] for row in rows])
    return np.arange(values.shape[1], dtype=np.float64), values


def ruler(data: Path) -> tuple[FloatArray, ComplexArray]:
    """Hz and ``(10, f)``: acceleration at ten places along a steel ruler (pydvma, BSD-3-Clause)."""
    values = loadmat(data / "vibration" / "ruler_grid" / "ruler_grid_acc_3.mat")["yspec"].T
    return RULER_STEP * np.arange(values.shape[1]), np.asarray(values, np.complex128)


def hammer_blows(data: Path) -> tuple[FloatArray, FloatArray]:
    """``(3, t)`` N and ``(3, t)`` m/s^2 of three blows with an instrumented hammer (pyFRF's example)."""
    folder = data / "vibration" / "pyfrf_hammer"
    takes = np.array([np.load(folder / f"measurement_{blow}.npy") for blow in (1, 2, 3)])
    return takes[:, 1], takes[:, 2]


def beam_roots(ends: Ends, count: int) -> FloatArray:
    """``b L`` of a thin uniform beam: ``cos cosh = 1`` free-free, ``-1`` cantilevered, without rigid motions.

    Frequencies go with their squares (Blevins, Formulas for Natural Frequency and Mode Shape, 1979,
    table 8-1).
    """
    sign = 1.0 if ends == "free-free" else -1.0
    first = 1.5 if ends == "free-free" else 0.5
    middles = np.pi * (first + np.arange(count))
    return np.array([brentq(lambda x: np.cos(x) - sign / np.cosh(x), m - 0.4, m + 0.4) for m in middles])


def beam_ratios(ends: Ends, count: int) -> FloatArray:
    """``(count,)`` frequencies over the first."""
    squares = beam_roots(ends, count) ** 2
    return np.asarray(squares / squares[0])


def free_shape(root: float, places: FloatArray) -> FloatArray:
    """Deflection of a free-free beam at shares of its length, one at its end."""
    sigma = (np.cosh(root) - np.cos(root)) / (np.sinh(root) - np.sin(root))
    x = root * places
    shape = np.cosh(x) + np.cos(x) - sigma * (np.sinh(x) + np.sin(x))
    return np.asarray(shape / shape[0])


def alike(first: ComplexArray | FloatArray, second: ComplexArray | FloatArray) -> float:
    """Modal assurance criterion: 1 where the two are one shape (Allemang and Brown, 1982)."""
    across = abs(np.vdot(first, second)) ** 2
    return float(across / (np.vdot(first, first).real * np.vdot(second, second).real))
