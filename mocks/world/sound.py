"""What the world's hammer does to the true object, and what the microphone hears of it.

A strike is a half sine of force at the place where the hammer really meets the object. Every mode
that it moves there rings, decays, and reaches the microphone by a way of its own: a gain and a
phase that nobody knows, the same in every strike of a run unless the gap says that something moved.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from harness.basics.arrays import FloatArray, read_only
from harness.basics.geometry import rotation_from_vector, transform
from harness.basics.materials import KNOWN
from harness.bench.gap import Gap, SoundGap
from harness.sim.modal.modes import Modes
from harness.sim.sound.modal_sound import ring
from harness.sim.sound.room import reverberated, room_response
from mocks.world.gap_draw import GapDraw
from mocks.world.world import Met, World

ComplexArray = npt.NDArray[np.complex128]

# Streams of numbers; each stays what it is when another is added. 0 to 19 are mocks.world.gap_draw's.
_RUN, _FREQUENCY, _DAMPING, _GAIN, _PHASE, _WALL, _POISSON, _FIELD = range(20, 28)
_BLOW, _STRIKE_GAIN, _STRIKE_PHASE, _NOISE, _IDLE, _CONVERTER = range(28, 34)

IMPULSE = 12.0e-3
"""N s of a strike: 94 N for 0.2 ms, a solenoid with a hard tip."""

HARDER = 10.0
"""Times the impulse of a strike that is out of range."""

THROW = (0.028, 0.032)
"""s from the switching of the output to the blow, uniform: the solenoid's way."""

BOUNCE_AFTER, BOUNCE = (2.0e-3, 4.0e-3), 0.4
"""s to the second hit of a hammer that bounces, uniform, and its share of the impulse."""


@dataclass(frozen=True, eq=False)
class BlowDraw:
    """One strike of the hammer."""

    hammer_from_true_hammer: FloatArray  #: ``(4, 4)``: where the tip really is, and which way it goes.
    throw: float  #: s from the switching of the output to the blow.
    pulse: float  #: s, the length of the half sine.
    impulse: float  #: N s; zero where the striker does not reach the object.
    bounce: float | None  #: s from the blow to a second one, None without.
    bounce_share: float = BOUNCE  #: of the impulse, that the second one has.


class SoundDraw:
    """The draws of one run.

    Args:
        draw: of the same run.
        material: the object's, by name; needed where the gap draws its constants.
    """

    def __init__(self, draw: GapDraw, material: str | None = None) -> None:
        self._draw = draw
        self._gap: SoundGap = draw.gap.sound
        run = draw.random(_RUN)
        stiffness, damping = run.standard_normal(2)
        self.frequency = 1.0 + self._gap.frequency * stiffness
        self.damping = float(np.exp(self._gap.damping * damping))
        if self._gap.material and material is not None:
            known = KNOWN[material].uncertainty
            self.frequency = float(np.exp(known.speed * stiffness))
            # One factor for both terms of the damping, as uncertain as the two are on average.
            self.damping = float(np.exp(0.5 * (known.alpha + known.beta) * damping))
        self.force_gain = 1.0 + self._gap.force_gain * run.standard_normal()
        self.room_seed = int(run.integers(2**31))

    @property
    def wall_change(self) -> float:
        """Of the true object's wall: a share of itself."""
        return float(self._draw.random(_WALL).uniform(*self._gap.wall))

    @property
    def poisson_change(self) -> float:
        """Added to Poisson's ratio of the true object."""
        return float(self._gap.poisson * self._draw.random(_POISSON).uniform(-1.0, 1.0))

    @property
    def elastic_field(self) -> float:
        """Deviation, relative, of Young's modulus and of the density over the true object."""
        return self._gap.elastic_field

    def material_random(self) -> np.random.Generator:
        """The numbers that the fields of the true object's material are made of."""
        return self._draw.random(_FIELD)

    @property
    def nominal_impulse(self) -> float:
        """N s of a strike at which nothing goes wrong."""
        return IMPULSE

    def frequencies(self, nominal: FloatArray) -> FloatArray:
        """``(m,)`` Hz of the true object's modes, from those of its model."""
        own = 1.0 + self._gap.frequency_per_mode * self._draw.random(_FREQUENCY).standard_normal(len(nominal))
        return read_only(nominal * self.frequency * own)

    def dampings(self, nominal: FloatArray) -> FloatArray:
        """``(m,)`` 1/s of the true object's modes, from those of its material."""
        spread = self._gap.damping_per_mode * self._draw.random(_DAMPING).standard_normal(len(nominal))
        return read_only(nominal * self.damping * np.exp(spread) + self._gap.extra_damping)

    def gains(self, count: int) -> ComplexArray:
        """``(m,)``: what the way to the microphone makes of each mode's sound, for the whole run."""
        if self._gap.microphone_gain == 0.0:
            return np.ones(count, np.complex128)
        level = self._gap.microphone_gain * self._draw.random(_GAIN).standard_normal(count)
        phase = self._draw.random(_PHASE).uniform(0.0, 2.0 * np.pi, count)
        return _polar(level, phase)

    def strike_gains(self, count: int, step: int, sample: int) -> ComplexArray:
        """``(m,)``: what one strike's gains are in addition to the run's."""
        level, phase = self._gap.gain_per_strike, self._gap.phase_per_strike
        levels = level * self._draw.random(_STRIKE_GAIN, step, sample).standard_normal(count)
        phases = phase * self._draw.random(_STRIKE_PHASE, step, sample).standard_normal(count)
        return _polar(levels, phases)

    def blow(self, step: int, sample: int) -> BlowDraw:
        """One strike of the hammer."""
        gap, random = self._gap, self._draw.random(_BLOW, step, sample)
        aside = np.array([*(gap.strike_point * random.standard_normal(2)), 0.0])
        about, angle = random.uniform(0.0, 2.0 * np.pi), gap.strike_direction * random.standard_normal()
        turned = rotation_from_vector(angle * np.array([np.cos(about), np.sin(about), 0.0]))
        throw = random.uniform(*THROW)
        pulse = gap.pulse * (1.0 + gap.pulse_spread * random.uniform(-1.0, 1.0))
        bounce = random.uniform(*BOUNCE_AFTER)
        harder = HARDER if step in gap.saturated_strikes else 1.0
        impulse = 0.0 if step in gap.silent_strikes else IMPULSE * harder
        second = bounce if step in gap.double_strikes else None
        return BlowDraw(read_only(transform(turned, aside)), throw, pulse, impulse, second)

    def noise(self, count: int, channels: int, step: int, sample: int) -> FloatArray:
        """``(count, channels)``, of unit deviation, for one strike's record."""
        return self._draw.random(_NOISE, step, sample).standard_normal((count, channels))

    def idle_noise(self, count: int, channels: int) -> FloatArray:
        """``(count, channels)``, of unit deviation, for the time between strikes."""
        return self._draw.random(_IDLE).standard_normal((count, channels))

    def converter_noise(self, step: int, sample: int) -> np.random.Generator:
        """The numbers that a converter's noise is made of, during one strike."""
        return self._draw.random(_CONVERTER, step, sample)

    def summary(self) -> Mapping[str, Any]:
        """The run's draws in SI, for the report."""
        gap = self._gap
        return {
            "wall_change": self.wall_change,
            "poisson_change": self.poisson_change,
            "elastic_field": gap.elastic_field,
            "frequency_factor": self.frequency,
            "damping_factor": self.damping,
            "force_gain": self.force_gain,
            "microphone_gain_db": gap.microphone_gain,
            "gain_per_strike_db": gap.gain_per_strike,
            "phase_per_strike_rad": gap.phase_per_strike,
            "extra_damping_per_s": gap.extra_damping,
            "reverberation_time_s": gap.reverberation_time,
            "signal_to_noise_db": gap.signal_to_noise,
        }


def _polar(levels: FloatArray, phases: FloatArray) -> ComplexArray:
    gains: ComplexArray = 10.0 ** (levels / 20.0) * np.exp(1j * phases)
    return gains


LISTEN = 0.6
"""s of a record behind the blow: ambient noise goes on for ever, an object has rung out by then."""

MIDDLING_OVER = 0.5
"""s over which the level of a strike is taken that the signal-to-noise ratio speaks of."""

STROKE = 20.0e-3
"""m that the striker comes out; what it does not meet by then it does not strike."""

_PLACES = 400


@dataclass(frozen=True, eq=False)
class SoundingObject:
    """The true object as something that sounds."""

    modes: Modes  #: of the true object, by the places of the nominal one.
    dampings: FloatArray  #: ``(m,)`` 1/s, of its material.
    levels: FloatArray
    """``(m,)`` Pa for each unit of a mode's ringing, as ``harness.sim.sound.modal_sound.ring`` makes it of a
    force in N and a gain in 1/sqrt(kg), at the microphone."""
    material: str | None = None  #: of which it is, by name; None where no gap draws its constants.


@dataclass(frozen=True, eq=False)
class Aim:
    """Where a strike goes."""

    blow: BlowDraw  #: as drawn.
    met: Met | None  #: where it meets the object; None where it does not.
    direction_in_object: FloatArray  #: ``(3,)`` unit, the way of the blow.


@dataclass(frozen=True, eq=False)
class StrikeTruth:
    """One strike as it was, before any instrument has read it."""

    rate: float  #: Hz.
    force: FloatArray  #: ``(t,)`` N, from the switching of the striker's output on.
    pressure: FloatArray  #: ``(t,)`` Pa at the microphone, at the same times, ambient noise included.
    aim: Aim  #: where it went.


class WorldSound:
    """The sound of one run.

    Args:
        world: of the same run.
        instrument: the true object's modes.
        gap: distributions; the same as the world's.
        seed: of the run.
        flange_from_hammer: ``(4, 4)``, as the station states it.
        rate: Hz, at which force and pressure are wanted.
    """

    def __init__(
        self,
        world: World,
        instrument: SoundingObject,
        gap: Gap,
        seed: int,
        flange_from_hammer: FloatArray,
        rate: float,
    ) -> None:
        self._world = world
        self._modes = instrument.modes
        self._draw = SoundDraw(GapDraw(gap, seed), instrument.material)
        self._flange_from_hammer = flange_from_hammer
        self._rate = rate
        self._room = self._room_of(gap)
        # Frequencies of a body go with one over its size.
        self.frequencies = self._draw.frequencies(instrument.modes.frequencies / world.scale)
        """``(m,)`` Hz, true."""
        self.dampings = self._draw.dampings(instrument.dampings)  #: ``(m,)`` 1/s, true.
        self._levels = instrument.levels * self._draw.gains(len(instrument.levels))
        # Pa rms of the median over the surface of strikes along the normal, without cross terms of modes.
        modes = self._modes
        chosen = np.linspace(0, len(modes.points) - 1, min(_PLACES, len(modes.points))).astype(np.int64)
        gains = np.einsum("kmd,kd->km", modes.shapes[chosen], modes.normals[chosen])
        # Share of a half sine's impulse at each frequency; at f = 1 / (2 pulse) it tends to pi / 4.
        turns = self.frequencies * gap.sound.pulse
        apart = 1.0 - 4.0 * turns**2
        near = np.abs(apart) < 1e-6
        spectrum = np.where(near, np.pi / 4, np.abs(np.cos(np.pi * turns) / np.where(near, 1.0, apart)))
        first = np.abs(gains * self._levels) * self._draw.nominal_impulse * spectrum
        below = self.frequencies < 0.5 * self._rate
        decays = 2.0 * self.dampings[below] * MIDDLING_OVER
        powers = 0.5 * first[:, below] ** 2 @ (-np.expm1(-decays) / decays)
        room = 1.0
        if self._room is not None:
            room += 10.0 ** (-gap.sound.direct_to_reverberant / 10.0)
        self.noise = float(np.sqrt(room * np.median(powers))) * 10.0 ** (-gap.sound.signal_to_noise / 20.0)
        """Pa, deviation of the ambient noise."""

    @property
    def force_gain(self) -> float:
        """What the force cell reads for each newton, against its calibration."""
        return self._draw.force_gain

    def strike(self, base_from_flange: FloatArray, step: int, sample: int) -> StrikeTruth:
        """Fire the striker with the flange reported at a pose.

        Args:
            base_from_flange: ``(4, 4)``, as the controller believes.
            step: of the run.
            sample: of the step.
        """
        aim = self.aim(base_from_flange, step, sample)
        blow = aim.blow
        times = np.arange(round((blow.throw + LISTEN) * self._rate)) / self._rate
        force, pressure = np.zeros(len(times)), np.zeros(len(times))
        if aim.met is not None:
            force = _half_sine(times - blow.throw, blow.pulse, blow.impulse)
            if blow.bounce is not None:
                later = times - blow.throw - blow.bounce
                force = force + _half_sine(later, blow.pulse, blow.bounce_share * blow.impulse)
            gains = self._modes.gains(aim.met.nominal[None], aim.direction_in_object[None])[0]
            amplitudes = gains * self._levels * self._draw.strike_gains(len(gains), step, sample)
            rung = ring(self.frequencies, self.dampings, amplitudes[None], force[None], self._rate)[0]
            pressure = rung if self._room is None else reverberated(rung[None], self._room)[0]
        ambient = self.noise * self._draw.noise(len(times), 1, step, sample)[:, 0]
        heard = read_only(pressure + ambient)
        return StrikeTruth(self._rate, read_only(force), heard, aim)

    def aim(self, base_from_flange: FloatArray, step: int, sample: int) -> Aim:
        """Where a strike of ``strike`` goes, without its sound."""
        blow = self._draw.blow(step, sample)
        tip = self._flange_from_hammer @ blow.hammer_from_true_hammer
        met = self._world.met_by(base_from_flange, tip, step, STROKE) if blow.impulse > 0.0 else None
        direction = self._world.direction_in_object(base_from_flange, tip, step)
        return Aim(blow, met, read_only(direction))

    def idle(self, seconds: float) -> FloatArray:
        """``(t,)`` Pa of ambient noise."""
        return read_only(self.noise * self._draw.idle_noise(round(seconds * self._rate), 1)[:, 0])

    def converter_noise(self, step: int, sample: int) -> np.random.Generator:
        """The noise of the box's converter during one strike; between strikes step and sample are -1."""
        return self._draw.converter_noise(step, sample)

    def differences(self) -> Mapping[str, Any]:
        """What sounds differently from what is believed, for the report."""
        modes = self._modes
        return {
            **self._draw.summary(),
            "noise_pa": self.noise,
            "modes": len(modes.frequencies),
            "modal_nodes": modes.nodes,
            "modal_elements": modes.elements,
            "frequencies_hz": self.frequencies.tolist(),
        }

    def _room_of(self, gap: Gap) -> FloatArray | None:
        time = gap.sound.reverberation_time
        if time == 0.0:
            return None
        level = gap.sound.direct_to_reverberant
        return room_response(self._rate, time, level, self._draw.room_seed, min(time, LISTEN))


def _half_sine(times: FloatArray, length: float, impulse: float) -> FloatArray:
    inside = (times > 0.0) & (times < length)
    peak = impulse * np.pi / (2.0 * length)
    return np.where(inside, peak * np.sin(np.pi * np.where(inside, times, 0.0) / length), 0.0)
