"""The blow of a round hammer tip: Hertz's quasi-static impact, and the sound that it strikes.

Two bodies press on each other with ``F = K x^(3/2)`` where they approach by ``x``, ``K = 4/3 E* sqrt(R)``
(Hertz, Ueber die Beruehrung fester elastischer Koerper, 1882; Johnson, Contact Mechanics, 1985,
sections 4.2 and 11.4). With the mass ``m`` of both in series and the speed ``V`` at first touch the
deepest approach is ``x1 = (5 m V^2 / (4 K))^(2/5)``, the contact lasts ``2.943 x1 / V``, and no energy is
lost: the impulse is ``2 m V``. It holds while the contact lasts long against the waves in the hammer,
and for a tip that does not yield.

A force that was measured needs no theory: ``harness.sim.sound.modal_sound.ring`` takes it as it is.
"""

import math
import time
from dataclasses import dataclass

import numpy as np
from scipy.special import beta, betaincinv

from harness.basics.arrays import AnyArray, FloatArray, read_only
from harness.basics.errors import WrongUse
from harness.basics.materials import Material
from harness.sim.sound.modal_sound import check_modes, check_rate, impulse_response, is_heavy
from harness.sim.sound.synthesis import Synthesis, SynthesisLevel, decibels, faded_after, loudest, synthesize

_A, _B = 0.4, 0.5
"""With ``s = (x / x1)^(5/2)`` the time is ``x1 / V`` times 2/5 of the incomplete beta function of s."""

DURATION = 0.8 * float(beta(_A, _B))
"""2.943: the contact's duration in units of ``x1 / V``."""

_NODES, _MISSED = 24, 1e-9
"""Of a quadrature over one sample's time, and the most it was seen to miss of a sound's peak, times five."""

_LEGENDRE = np.polynomial.legendre.leggauss(_NODES)


@dataclass(frozen=True)
class Hammer:
    """What strikes."""

    radius: float  #: m, of the tip's sphere.
    young: float  #: Pa, of the tip.
    poisson: float  #: of the tip.
    mass: float  #: kg, that moves with the tip.


@dataclass(frozen=True)
class HertzPulse:
    """The force of one blow, from the first touch on."""

    duration: float  #: s, of the contact.
    peak: float  #: N, at half of it.
    impulse: float  #: N s.
    approach: float  #: m, the deepest.

    def force(self, times: FloatArray) -> FloatArray:
        """N at times in s since the first touch; zero outside the contact."""
        return np.asarray(self.peak * self._depth(times) ** 0.6)

    def delivered(self, times: FloatArray) -> FloatArray:
        """N s: the impulse up to times in s since the first touch."""
        left = np.sqrt(1.0 - self._depth(times))
        return np.asarray(0.5 * self.impulse * np.where(times < 0.5 * self.duration, 1.0 - left, 1.0 + left))

    def sampled(self, rate: float) -> FloatArray:
        """``(t,)`` N: means over one sample's time about each sample, which add up to the impulse.

        For ``ring``, next to measured forces. It softens what is near half the rate; ``struck`` does not.

        Args:
            rate: samples per second.
        """
        check_rate(rate)
        edges = (np.arange(np.ceil(self.duration * rate) + 2.0, dtype=np.float64) - 0.5) / rate
        return np.asarray(np.diff(self.delivered(edges)) * rate)

    def _depth(self, times: FloatArray) -> FloatArray:
        """``(x / x1)^(5/2)``: the share of the energy that the contact holds."""
        from_end = np.minimum(times, self.duration - times)
        share = np.minimum(np.maximum(2.0 * from_end / self.duration, 0.0), 1.0)
        return np.asarray(betaincinv(_A, _B, share))


def hertz_pulse(
    hammer: Hammer, speed: float, struck: Material, curvature: float = 0.0, mass: float = math.inf
) -> HertzPulse:
    """The blow of a hammer on an object.

    Args:
        hammer: that strikes.
        speed: m/s, at the first touch, above zero.
        struck: the object's material.
        curvature: 1/m, of the object's surface there: one over its radius, zero where it is flat,
            negative in a hollow.
        mass: kg, of the object, where it is free to give way; infinite where it is not.

    Raises:
        WrongUse: a quantity that is not above zero, or a tip that fits into the hollow.
    """
    given = {
        "the tip's radius": (hammer.radius, "m"),
        "the tip's Young's modulus": (hammer.young, "Pa"),
        "the hammer's mass": (hammer.mass, "kg"),
        "the hammer's speed": (speed, "m/s"),
    }
    for name, (value, unit) in given.items():
        if not (math.isfinite(value) and value > 0.0):
            raise WrongUse(f"{name} is {value:g} {unit}; a blow needs one above 0")
    if not mass > 0.0:
        raise WrongUse(f"the struck object's mass is {mass:g} kg; say one above 0, or none where it is held")
    if not 1.0 / hammer.radius + curvature > 0.0:
        raise WrongUse(
            f"a tip of radius {hammer.radius:g} m lies in a hollow of radius {-1.0 / curvature:g} m and "
            "touches it along a line or an area; take a tip of smaller radius"
        )
    radius = 1.0 / (1.0 / hammer.radius + curvature)
    modulus = 1.0 / ((1.0 - hammer.poisson**2) / hammer.young + (1.0 - struck.poisson**2) / struck.young)
    together = 1.0 / (1.0 / hammer.mass + 1.0 / mass)
    stiffness = 4.0 / 3.0 * modulus * math.sqrt(radius)
    approach = (1.25 * together * speed**2 / stiffness) ** 0.4
    return HertzPulse(
        duration=DURATION * approach / speed,
        peak=stiffness * approach**1.5,
        impulse=2.0 * together * speed,
        approach=approach,
    )


def struck(
    frequencies: FloatArray,
    dampings: FloatArray,
    amplitudes: AnyArray,
    pulse: HertzPulse,
    duration: float,
    rate: float,
    level: SynthesisLevel = "fast",
) -> Synthesis:
    """The sounds of modes that a pulse sets ringing, its force neither sampled nor filtered.

    While the contact lasts every sample is an integral over the force up to it. At its end each mode
    has the size and phase that the whole force gave it, and rings on as after an impulse.

    Args:
        frequencies: ``(m,)`` Hz, as ``synthesize`` takes them.
        dampings: ``(m,)`` 1/s.
        amplitudes: ``(k, m)`` real, per N s.
        pulse: its first touch is at the first sample.
        duration: s, of the sound; longer than the contact.
        rate: samples per second.
        level: of what rings on.

    Raises:
        WrongUse: as ``synthesize``; complex amplitudes; a sound shorter than the contact.
    """
    check_rate(rate)
    check_modes(frequencies, dampings, amplitudes)
    touching = int(np.ceil(pulse.duration * rate))
    if np.iscomplexobj(amplitudes):
        raise WrongUse("amplitudes of a blow are real; a phase of its own has no cause in a force")
    if not duration * rate >= touching + 1:
        raise WrongUse(
            f"a sound of {duration:g} s ends within the contact of {pulse.duration:g} s; say a longer one"
        )
    heard = frequencies < 0.5 * rate
    heavy = heard & is_heavy(frequencies, dampings)
    light = heard & ~heavy
    begun = time.perf_counter()
    contact, turned = _during(
        frequencies[light], dampings[light], amplitudes[:, light], pulse, rate, touching
    )
    rest = duration - touching / rate
    free = synthesize(frequencies[light], dampings[light], turned, rest, rate, level)
    sound = np.concatenate([contact, free.sound], axis=1)
    if heavy.any():
        sound += _heavy(
            frequencies[heavy], dampings[heavy], amplitudes[:, heavy], pulse, rate, sound.shape[1]
        )
    # Error of the free vibration as stated, plus that of the quadrature.
    peaks = loudest(sound)
    error = decibels(loudest(free.sound) * 10.0 ** (free.error / 20.0) + _MISSED * peaks, peaks)
    return Synthesis(read_only(sound), rate, read_only(~heard), error, time.perf_counter() - begun)


def _during(
    frequencies: FloatArray,
    dampings: FloatArray,
    amplitudes: FloatArray,
    pulse: HertzPulse,
    rate: float,
    count: int,
) -> tuple[FloatArray, AnyArray]:
    """``(k, count)`` sounds of underdamped modes, and the ``(k, m)`` amplitudes with which they go on.

    A mode's state, the integral of ``F(u) exp(z (t - u))``, turns from sample to sample and gains the
    force's part since the last one.
    """
    omega = 2.0 * np.pi * frequencies
    split = np.sqrt((omega - dampings) * (omega + dampings))
    z = -dampings + 1j * split
    times, impulses = _quadrature(pulse, rate, count)
    gained = np.empty((count, len(z)), dtype=np.complex128)
    gained[:-1] = impulses[:-1] @ np.exp(np.outer(1.0 / rate - times[0], z))
    gained[-1] = impulses[-1] @ np.exp(np.outer(count / rate - times[-1], z))
    states = np.zeros((count + 1, len(z)), dtype=np.complex128)
    turn = np.exp(z / rate)
    for sample, part in enumerate(gained):
        states[sample + 1] = states[sample] * turn + part
    contact = amplitudes @ (omega / split * states[:-1].imag).T
    return contact, amplitudes * (states[-1].real + 1j * (omega / split) * states[-1].imag)


def _heavy(
    frequencies: FloatArray,
    dampings: FloatArray,
    amplitudes: FloatArray,
    pulse: HertzPulse,
    rate: float,
    count: int,
) -> FloatArray:
    """``(k, count)`` sounds of modes near or beyond critical damping, each sample a quadrature."""
    touching = int(np.ceil(pulse.duration * rate))
    last = min(count, touching + faded_after(frequencies, dampings, rate))
    times, impulses = _quadrature(pulse, rate, touching)
    sound = np.zeros((len(amplitudes), count))
    for sample in range(1, last):
        before = slice(0, min(sample, touching))
        answers = impulse_response(sample / rate - times[before].ravel(), frequencies, dampings)
        sound[:, sample] = amplitudes @ (answers @ impulses[before].ravel())
    return sound


def _quadrature(pulse: HertzPulse, rate: float, count: int) -> tuple[FloatArray, FloatArray]:
    """``(count, nodes)`` times in s and impulses in N s, by the time of each sample, the last to the end."""
    nodes, weights = _LEGENDRE
    begins = np.arange(count) / rate
    lengths = np.append(np.diff(begins), pulse.duration - begins[-1])[:, None]
    times = begins[:, None] + 0.5 * lengths * (nodes + 1.0)
    return times, 0.5 * lengths * weights * pulse.force(times)
