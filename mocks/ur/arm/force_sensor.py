"""The force sensor in the flange: what the bench exerts, a constant bias, and noise that reruns repeat."""

import math
import random
from collections import deque
from collections.abc import Sequence

from mocks.ur.arm import poses
from mocks.ur.arm.poses import Vector
from mocks.ur.hooks import ControllerConfig, Matrix, Six

RECENT = 64
"""Cycles that ``tool_contact`` looks back."""

NO_WRENCH: Six = (0.0,) * 6


class ForceSensor:
    """Readings of one cycle after another.

    Noise is a function of (seed, step of the run, cycles since the motion began), and of nothing else.
    """

    def __init__(self, config: ControllerConfig) -> None:
        self._config = config
        drawn = random.Random(f"bias {config.seed}")
        spread = config.force_bias
        self._bias = [drawn.gauss(0.0, spread) for _ in range(3)]
        self._bias += [drawn.gauss(0.0, 0.1 * spread) for _ in range(3)]
        self._zero = [0.0] * 6
        self._noise = random.Random()
        self._recent: deque[Vector] = deque(maxlen=RECENT)
        self.broken = False  #: whether ``at_tcp`` reads no numbers.
        self.raw: Six = NO_WRENCH  #: ``(6,)`` N and N m in the flange's frame, bias included.
        self.base: Six = NO_WRENCH
        """``(6,)`` N and N m at the flange, in base, as exerted plus noise: no bias."""
        self.begin_motion(0)

    def begin_motion(self, step: int) -> None:
        """Start the sequence of noise of a step of the run."""
        self._noise.seed(f"noise {self._config.seed} {step}")

    def read(self, wrench: Sequence[float], base_from_flange: Matrix) -> None:
        """One cycle: ``(6,)`` N and N m act on the flange, in base."""
        fx, fy, fz, tx, ty, tz = wrench
        gauss, force, torque = self._noise.gauss, self._config.force_noise, self._config.torque_noise
        f = poses.rotated_back(base_from_flange, (fx, fy, fz))
        t = poses.rotated_back(base_from_flange, (tx, ty, tz))
        felt = (
            *(part + gauss(0.0, force) for part in f),
            *(part + gauss(0.0, torque) for part in t),
        )
        self.base = _turned(base_from_flange, felt)
        self._recent.append(self.base[:3])
        a, b, c, d, e, g = (part + bias for part, bias in zip(felt, self._bias, strict=True))
        self.raw = a, b, c, d, e, g

    def zero(self) -> None:
        """Take the present reading as zero."""
        self._zero = list(self.raw)

    def at_tcp(self, base_from_flange: Matrix, flange_from_tcp: Matrix) -> Six:
        """``actual_TCP_force``: N and N m at the tool centre point, in base."""
        if self.broken:
            return (math.nan,) * 6
        a, b, c, d, e, g = (part - zero for part, zero in zip(self.raw, self._zero, strict=True))
        turned = _turned(base_from_flange, (a, b, c, d, e, g))
        x, y, z = poses.rotated(base_from_flange, poses.translation(flange_from_tcp))
        fx, fy, fz, tx, ty, tz = turned
        return fx, fy, fz, tx - (y * fz - z * fy), ty - (z * fx - x * fz), tz - (x * fy - y * fx)

    def contact_cycles(self, direction: Vector) -> int:
        """Cycles since something first resisted motion along ``direction``; 0 where nothing does.

        All directions count where ``direction`` is zero. Contact is said at the configured force, and
        dated back to where the force left the noise.
        """
        floor = 4.0 * self._config.force_noise
        cycles = 0
        for force in reversed(self._recent):
            resistance = _resistance(force, direction)
            if cycles == 0 and resistance < self._config.contact_force:
                return 0
            if resistance <= floor:
                break
            cycles += 1
        return cycles


def _resistance(force: Vector, direction: Vector) -> float:
    length = math.hypot(*direction)
    if length == 0.0:
        return math.hypot(*force)
    return -sum(f * d for f, d in zip(force, direction, strict=True)) / length


def _turned(frame: Matrix, wrench: Sequence[float]) -> Six:
    """Both vectors of a wrench into the outer frame; its point stays."""
    fx, fy, fz, tx, ty, tz = wrench
    return (*poses.rotated(frame, (fx, fy, fz)), *poses.rotated(frame, (tx, ty, tz)))
