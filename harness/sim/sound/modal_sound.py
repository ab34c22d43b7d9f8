"""The pressure of struck modes: any force history, any number of strikes, exact to rounding.

A mode of undamped frequency ``f`` and damping ``d`` answers an impulse with
``(w / w_d) exp(-d t) sin(w_d t)``, ``w = 2 pi f`` and ``w_d = sqrt(w^2 - d^2)``. For any mode one
can hear the factor ``w / w_d`` is one; it carries the answer through ``d = w``, where the sine
becomes ``w t exp(-d t)``, to ``d > w``, where it becomes a hyperbolic sine.
"""

from dataclasses import dataclass

import numpy as np

from harness.basics.arrays import AnyArray, BoolArray, FloatArray
from harness.basics.errors import WrongUse
from harness.basics.mesh import Mesh
from harness.sim.modal.modes import Modes

AIR_DENSITY = 1.204
"""kg/m^3, of dry air at 20 C and 101.325 kPa (ISO 2533)."""

SPEED_OF_SOUND = 343.2
"""m/s, likewise."""

_DIRECTIONS = 24


_BLOCK = 256
"""Samples: the tables are this long in one direction and duration / block in the other."""

_HEAVY = 0.5
"""Of critical damping: a mode beyond it is over in a few periods and is summed directly."""

_LOWEST = -650.0
"""Exponent below which an answer is zero rather than a number that slows every sum (1e-282)."""


@dataclass(frozen=True, eq=False)
class Strikes:
    """Blows on one object."""

    points: FloatArray  #: ``(k, 3)`` m, in the object's frame, on its surface.
    directions: FloatArray  #: ``(k, 3)`` unit, of the force on the object.
    force: FloatArray  #: ``(k, t)`` N.
    rate: float  #: samples per second.


def audible(frequencies: FloatArray, rate: float) -> BoolArray:
    """``(m,)``: the modes below half of ``rate``; a sampled sound has no room for the others."""
    return np.asarray(frequencies < 0.5 * rate)


def is_heavy(frequencies: FloatArray, dampings: FloatArray) -> BoolArray:
    """``(m,)``: the modes damped by more than half of critical: short, or no wave at all."""
    return np.asarray(dampings > _HEAVY * 2.0 * np.pi * frequencies)


def impulse_response(
    times: FloatArray, frequencies: FloatArray, dampings: FloatArray, quadrature: bool = False
) -> FloatArray:
    """``(m, t)``: what each mode answers to a unit impulse, through every damping.

    Args:
        times: ``(t,)`` s, zero or more.
        frequencies: ``(m,)`` Hz, undamped, above zero.
        dampings: ``(m,)`` 1/s, zero or more.
        quadrature: for the cosine in place of the sine.
    """
    w, d = 2.0 * np.pi * frequencies[:, None], dampings[:, None]
    split = np.sqrt(np.abs((w - d) * (w + d)))
    over = d > w
    # The slower of the two decays is d - split, written so that nothing is lost where d is large.
    slow = np.where(over, w**2 / (d + split), d)
    decay = np.exp(np.maximum(-slow * times, _LOWEST))
    if quadrature:
        return decay * np.where(over, 0.5 * (1.0 + np.exp(np.maximum(-2.0 * split * times, _LOWEST))),
                                np.cos(split * times))  # fmt: skip
    grown = np.where(split > 0.0, split, 1.0)
    rising = -np.expm1(np.maximum(-2.0 * split * times, _LOWEST)) / (2.0 * grown)
    waving = times * np.sinc(split * times / np.pi)
    answer: FloatArray = w * decay * np.where(over & (split > 0.0), rising, waving)
    return answer


def ring(
    frequencies: FloatArray, dampings: FloatArray, amplitudes: AnyArray, force: FloatArray, rate: float
) -> FloatArray:
    """The sum of modes that a force sets ringing.

    Each sample of the force counts as an impulse of ``force / rate``.

    Args:
        frequencies: ``(m,)`` Hz, undamped; those at or above half of ``rate`` are left out
            (``audible`` says which).
        dampings: ``(m,)`` 1/s.
        amplitudes: ``(k, m)`` pressure (or whatever is wanted) per N s. A complex one turns the
            answer's phase: its imaginary part goes with the cosine.
        force: ``(k, t)`` N.
        rate: samples per second.

    Returns:
        ``(k, t)``; silence where every mode is left out or no force acts.

    Raises:
        WrongUse: shapes that do not belong together, or numbers that are not finite.
    """
    check_rate(rate)
    if force.ndim != 2 or len(amplitudes) != len(force):
        raise WrongUse(
            f"amplitudes {amplitudes.shape} and force {force.shape} do not belong together; they are "
            "(k, m) and (k, t)"
        )
    if not np.isfinite(force).all():
        raise WrongUse("a force is not a finite number; nothing rings")
    check_modes(frequencies, dampings, amplitudes)
    heard = audible(frequencies, rate)
    heavy = heard & is_heavy(frequencies, dampings)
    light = heard & ~heavy
    sound = _blocks(frequencies[light], dampings[light], amplitudes[:, light], force, rate)
    if heavy.any():
        # Modes near or beyond critical damping, whose answer is short or no wave at all.
        heavy_modes = np.arange(force.shape[1]) / rate, frequencies[heavy], dampings[heavy]
        kernels = np.real(amplitudes[:, heavy]) @ impulse_response(*heavy_modes) / rate
        if np.iscomplexobj(amplitudes):
            kernels += np.imag(amplitudes[:, heavy]) @ impulse_response(*heavy_modes, True) / rate
        # Imported here, because it takes half a second and most commands do not need it.
        from scipy.signal import oaconvolve

        sound += oaconvolve(force, kernels, axes=1)[:, : force.shape[1]]
    return sound


def _blocks(
    frequencies: FloatArray, dampings: FloatArray, amplitudes: AnyArray, force: FloatArray, rate: float
) -> FloatArray:
    """Underdamped modes: tables of one block, and the modes' states from block to block.

    Within a block the answer to its own force is a short convolution; the answer to all earlier
    force is each mode's state, turning and decaying. Both are matrix products.
    """
    count, samples = force.shape
    if len(frequencies) == 0 or samples == 0:
        return np.zeros((count, samples))
    split = np.sqrt((2.0 * np.pi * frequencies) ** 2 - dampings**2)
    exponents = (-dampings + 1j * split) / rate
    weights = amplitudes * (2.0 * np.pi * frequencies / split) / rate
    cosines = np.imag(amplitudes) / rate
    parts = np.real(weights) + 1j * cosines
    blocks = -(-samples // _BLOCK)
    padded = np.zeros((count, blocks, _BLOCK))
    padded.reshape(count, -1)[:, :samples] = force
    table = _powers(exponents, np.arange(_BLOCK))
    own = np.imag(parts @ table)
    entering = padded @ table[:, ::-1].T
    state = np.zeros((count, len(exponents)), dtype=np.complex128)
    states = np.empty((count, blocks, len(exponents)), dtype=np.complex128)
    jump = _powers(exponents, np.array([_BLOCK]))[:, 0]
    advance = _powers(exponents, np.array([1]))[:, 0]
    for block in range(blocks):
        states[:, block] = state * advance
        state = state * jump + entering[:, block]
        state[np.abs(state) < np.exp(_LOWEST)] = 0.0
    sound = np.empty((count, blocks, _BLOCK))
    for strike in range(count):
        held = parts[strike] * states[strike]
        sound[strike] = held.real @ table.imag + held.imag @ table.real
        kernel = own[strike]
        later = np.arange(len(kernel)) - np.arange(len(kernel))[:, None]
        sound[strike] += padded[strike] @ np.where(later >= 0, kernel[np.maximum(later, 0)], 0.0)
    return sound.reshape(count, -1)[:, :samples]


def _powers(exponents: AnyArray, steps: AnyArray) -> AnyArray:
    """``(m, t)``: ``exp(exponent * step)``, zero where it would be smaller than a normal number."""
    arguments = exponents[:, None] * steps
    powers: AnyArray = np.exp(arguments)
    powers[arguments.real < _LOWEST] = 0.0
    return powers


def check_modes(frequencies: FloatArray, dampings: FloatArray, amplitudes: AnyArray) -> None:
    """Refuse modes that cannot ring.

    Raises:
        WrongUse: shapes other than ``(m,)``, ``(m,)`` and ``(k, m)``, numbers that are not finite,
            a frequency that is not above zero or a damping below zero.
    """
    modes = (len(frequencies),)
    if dampings.shape != modes or amplitudes.ndim != 2 or amplitudes.shape[1:] != modes:
        raise WrongUse(
            f"{len(frequencies)} frequencies, dampings {dampings.shape} and amplitudes {amplitudes.shape} do "
            "not belong together; they are (m,), (m,) and (k, m)"
        )
    if not all(np.isfinite(part).all() for part in (frequencies, dampings, amplitudes)):
        raise WrongUse("a frequency, damping or amplitude is not a finite number; nothing rings")
    if (frequencies <= 0.0).any() or (dampings < 0.0).any():
        raise WrongUse("a mode has a frequency above 0 and a damping of 0 or more; rigid modes do not ring")


def check_rate(rate: float) -> None:
    """Refuse a rate that is not above zero, with ``WrongUse``."""
    if not (np.isfinite(rate) and rate > 0.0):
        raise WrongUse(f"{rate:g} samples per second make no sound; say a rate above 0")


def radiation(modes: Modes, distance: float) -> FloatArray:
    """``(m,)`` Pa sqrt(kg) / (N s): the pressure at a distance of each mode, for a unit gain.

    Times the gain at the struck point (``Modes.gains``) it is the amplitude that ``ring`` takes.
    A mode's surface accelerates by ``w`` times its shape for a unit impulse. Every piece of the surface is a
    source of its own in free air, rms over all directions, so that parts that move against each other cancel
    (Rayleigh's integral without baffle; the shadow of the object on its own sound is left out).

    Args:
        modes: of the object.
        distance: m from the object's middle, above zero.

    Raises:
        WrongUse: a distance that is not above zero.
    """
    if not (np.isfinite(distance) and distance > 0.0):
        raise WrongUse(f"a microphone {distance:g} m from the object hears nothing; say a distance above 0")
    omega = 2.0 * np.pi * modes.frequencies
    areas = np.zeros(len(modes.points))
    faces = Mesh(modes.points, modes.faces)
    for corner in range(3):
        np.add.at(areas, modes.faces[:, corner], faces.face_areas / 3.0)
    outward = np.einsum("nmd,nd->nm", modes.shapes, modes.normals)
    per_volume = AIR_DENSITY * omega / (4.0 * np.pi * distance)
    flow = areas[:, None] * outward
    wavenumbers = omega / SPEED_OF_SOUND
    middle = modes.points.mean(axis=0)
    height = 1.0 - (2.0 * np.arange(_DIRECTIONS) + 1.0) / _DIRECTIONS
    turn = np.pi * (1.0 + np.sqrt(5.0)) * np.arange(_DIRECTIONS)
    radius = np.sqrt(1.0 - height**2)
    directions = np.stack([radius * np.cos(turn), radius * np.sin(turn), height], axis=1)
    ahead = (modes.points - middle) @ directions.T
    total = np.zeros(len(wavenumbers))
    for mode, wavenumber in enumerate(wavenumbers):
        phase = wavenumber * ahead
        total[mode] = np.mean((flow[:, mode] @ np.cos(phase)) ** 2 + (flow[:, mode] @ np.sin(phase)) ** 2)
    return np.asarray(per_volume * np.sqrt(total))
