"""Strikes of shapes of the families, as a microphone at a bench has them: what sound is learnt from."""

import numpy as np
from scipy.signal import fftconvolve

from experiments.scale_estimation.unseen.ringing_shape import PLACES, RingingShape
from harness.basics.arrays import FloatArray
from harness.basics.materials import MATERIALS
from harness.sim.sound.synthesis import synthesize
from harness.strikes.spectra import Analysis

RATE = 32e3
"""Hz."""

STRIKES = 3
SPEED_ERROR = 0.04
"""Of sqrt(E / density) and of the wall, relative: of all modes alike."""

MODE_ERROR = 0.01
"""Of each mode."""

EXCITED = (5.0e3, 12.0e3)
"""Hz, up to which a hammer excites; by the tip and what it meets."""

REVERBERANT = (-18.0, 0.0)
"""DB of the room's sound against the direct."""

ECHOES = (0.12, 0.4)
"""S, in which the room's sound falls by 60 dB."""


def strike_responses(
    shape: RingingShape, size: float, material: str, random: np.random.Generator
) -> tuple[FloatArray, tuple[float, float]]:
    """``(k, t)`` Pa/(N s) of up to ``STRIKES`` strikes at ``RATE``, and the band in Hz that they excited."""
    made_of = MATERIALS[material]
    highest = float(np.exp(random.uniform(*np.log(EXCITED))))
    seeming = size * float(np.exp(SPEED_ERROR * random.standard_normal()))
    frequencies, decays, amplitudes = shape.at(seeming, made_of, min(highest, 0.45 * RATE), random)
    count = STRIKES if random.random() < 0.5 else int(random.integers(1, STRIKES + 1))
    struck = amplitudes[random.choice(PLACES, count, replace=False)]
    # A place that is nearly still for a mode moves a little all the same: the tip is wide, the wall uneven.
    struck = struck + 0.1 * np.sqrt((amplitudes**2).mean(axis=0)) * random.standard_normal(struck.shape)
    settings = Analysis()
    if len(frequencies):
        frequencies = frequencies * np.exp(MODE_ERROR * random.standard_normal(len(frequencies)))
        decays = decays * np.exp(0.3 * random.standard_normal()) + settings.decay
        responses = synthesize(frequencies, decays, struck, settings.duration, RATE).sound
    else:
        responses = np.zeros((count, round(settings.duration * RATE)))
    return in_a_room(np.asarray(responses), random), (settings.lowest, highest)


def in_a_room(responses: FloatArray, random: np.random.Generator) -> FloatArray:
    """``(k, t)`` with a room's sound and a microphone's noise beside what came directly."""
    ratio, lasting = 10.0 ** (random.uniform(*REVERBERANT) / 20.0), random.uniform(*ECHOES)
    samples = round(lasting * RATE)
    tail = random.standard_normal(samples) * np.exp(-6.9 * np.arange(samples) / samples)
    room = np.append(1.0, ratio * tail / np.linalg.norm(tail))
    heard = fftconvolve(responses, room[None], axes=1)[:, : responses.shape[1]]
    noise = 10.0 ** random.uniform(-4.5, -2.5) * max(float(np.abs(heard).max()), 1e-12)
    fading = np.exp(-Analysis().decay * np.arange(heard.shape[1]) / RATE)
    return np.asarray(heard + noise * fading * random.standard_normal(heard.shape))
