"""What differs from nominal in one run's strikes and in what carries their sound.

As in ``mocks.world.gap_draw`` every number is keyed by what it belongs to, so that a rerun draws the
same ones whatever its timing.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from harness.basics.arrays import FloatArray, read_only
from harness.basics.geometry import rotation_from_vector, transform
from harness.basics.materials import KNOWN
from harness.bench.gap import SoundGap
from mocks.world.gap_draw import GapDraw

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
    """One strike of the hammer.

    Attributes:
        hammer_from_true_hammer: ``(4, 4)``: where the tip really is, and which way it goes.
        throw: s from the switching of the output to the blow.
        pulse: s, the length of the half sine.
        impulse: N s; zero where the striker does not reach the object.
        bounce: s from the blow to a second one, None without.
        bounce_share: of the impulse, that the second one has.
    """

    hammer_from_true_hammer: FloatArray
    throw: float
    pulse: float
    impulse: float
    bounce: float | None
    bounce_share: float = BOUNCE


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
    """Complex gains of levels in dB and phases in rad."""
    gains: ComplexArray = 10.0 ** (levels / 20.0) * np.exp(1j * phases)
    return gains
