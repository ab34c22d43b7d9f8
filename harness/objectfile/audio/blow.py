"""What strikes an object: an impulse, or a round tip that stays for a while."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import Self

import numpy as np
from numpy.typing import ArrayLike

from harness.basics.arrays import FloatArray, read_only
from harness.basics.errors import WrongUse
from harness.basics.files.named_file import nearest
from harness.basics.materials import Material
from harness.sim.sound.contact_pulse import DURATION, Hammer, HertzPulse, hertz_pulse

HAMMERS: Mapping[str, Hammer] = MappingProxyType({
    "steel": Hammer(radius=3e-3, young=2.07e11, poisson=0.30, mass=5e-3),
    "nylon": Hammer(radius=4e-3, young=2.7e9, poisson=0.39, mass=5e-3),
    "rubber": Hammer(radius=6e-3, young=5e6, poisson=0.49, mass=1e-2),
})  # fmt: skip
"""By what their tips are made of. Moduli: Callister, Materials Science and Engineering, 7th edition, 2007,
appendix B (carbon steel; nylon 6,6 amid 1.6 to 3.8 GPa; styrene-butadiene amid 2 to 10 MPa). Sizes and
masses are judged: those of the small end of modal hammers."""

WEAKEST, HARDEST = 1e-9, 1e9
"""N or N s, of a force that is taken: within it no product of it leaves double precision."""

LONGEST = 0.1
"""s, of a contact: a blow that lasts longer is a push."""

_UNIT_ERROR = 1e-6

_PIECES, _PER_TURN = 64, 16
"""Of a pulse whose spectrum is summed, and more by each turn that the fastest mode makes meanwhile; a
piece's impulse then acts a hundredth of a percent off at worst."""

_BY_PEAK = 1.0 / 1.2
"""A blow's greatest force goes as its speed to the power of 6/5."""

_PEAKED = 1.25 * DURATION
"""Peak times duration over mass times speed: ``K x1^(5/2) = 5/4 m V^2`` and ``T = DURATION x1 / V``."""


@dataclass(frozen=True, eq=False)
class HammerBlow:
    """A force on a place of an object, and how it passes."""

    direction: FloatArray  #: ``(3,)`` of unit length, of the force on the object, in its frame.
    impulse: float  #: N s, all of it.
    pulse: HertzPulse | None = None
    """how the force rises and falls; None where all of it comes in one instant."""

    @classmethod
    def instant(cls, impulse: ArrayLike) -> Self:
        """``(3,)`` N s at once.

        Raises:
            WrongUse: as ``checked_force``.
        """
        vector, size = checked_force(impulse, "N s")
        return cls(read_only(vector / size), size)

    @classmethod
    def lasting(cls, direction: ArrayLike, pulse: HertzPulse) -> Self:
        """A pulse along ``(3,)`` a direction of any length.

        Raises:
            WrongUse: as ``checked_force``.
        """
        vector, size = checked_force(direction, "N")
        return cls(read_only(vector / size), pulse.impulse, pulse)

    def given_to(self, frequencies: FloatArray) -> FloatArray:
        """``(m,)`` N s: what the blow gives to a lightly damped mode of each frequency in Hz.

        The size of the force's spectrum there; no more than the impulse, which a mode slow against the
        contact gets whole.
        """
        if self.pulse is None:
            return np.full(len(frequencies), self.impulse)
        turns = float(frequencies.max(initial=0.0)) * self.pulse.duration
        step = self.pulse.duration / (_PIECES + int(np.ceil(_PER_TURN * turns)))
        times = np.arange(0.5 * step, self.pulse.duration, step)
        impulses = np.diff(self.pulse.delivered(np.append(times - 0.5 * step, times[-1] + 0.5 * step)))
        sizes = [abs(np.exp(-2j * np.pi * frequency * times) @ impulses) for frequency in frequencies]
        return np.array(sizes)


def checked_force(force: ArrayLike, unit: str) -> tuple[FloatArray, float]:
    """``(3,)`` a force as float64, and its size.

    Raises:
        WrongUse: it is not three finite numbers, or is too small or too great to compute with.
    """
    vector = np.array(force, dtype=np.float64)
    if vector.shape != (3,) or not np.isfinite(vector).all():
        shown = ", ".join(f"{value:g}" for value in vector.ravel()[:4])
        raise WrongUse(f"a force ({shown}) is not three finite numbers in {unit}; say x, y and z")
    size = math.hypot(*vector.tolist())
    if size == 0.0:
        raise WrongUse("a force of 0 strikes nothing; say one above 0, or none for the inward normal")
    if not WEAKEST <= size <= HARDEST:
        raise WrongUse(
            f"a force of {size:.3g} {unit} cannot be struck; say one of {WEAKEST:g} to {HARDEST:g} {unit}"
        )
    return vector, size


def hammer(name: str, radius: float | None = None, mass: float | None = None) -> Hammer:
    """The hammer of that name, changed where a tip's radius in m or a mass in kg is given.

    Raises:
        WrongUse: there is none of that name.
    """
    found = HAMMERS.get(name)
    if found is None:
        raise WrongUse(f"no hammer {name!r}; {nearest(name, HAMMERS)}")
    changed = replace(found, radius=found.radius if radius is None else radius)
    return replace(changed, mass=found.mass if mass is None else mass)


def hammered(
    force: ArrayLike,
    of: Hammer,
    struck: Material,
    mass: float = math.inf,
    speed: float | None = None,
    contact: float | None = None,
) -> HammerBlow:
    """The blow of a hammer, by its greatest force or by its speed.

    Args:
        force: ``(3,)`` N, the greatest; where a speed is given, a direction of length 1.
        of: the hammer.
        struck: the object's material.
        mass: kg, of the object, as if struck through its middle; infinite where it is held.
        speed: m/s; None for that at which the force comes to its greatest.
        contact: s, that the hammer stays, its tip just so hard; None for what the tip makes of it.

    Raises:
        WrongUse: as ``checked_force``, ``hertz_pulse`` or ``pulse_lasting``; or both a force and a speed.
    """
    peak = checked_force(force, "N")[1]
    if speed is not None and abs(peak - 1.0) > _UNIT_ERROR:
        raise WrongUse(
            f"a force of {peak:.6g} N and a speed of {speed:g} m/s both say how hard the blow is; give the "
            "force a length of 1 for a direction, or leave the speed out"
        )
    if contact is None:
        if speed is None:
            speed = (peak / hertz_pulse(of, 1.0, struck, mass=mass).peak) ** _BY_PEAK
        pulse = hertz_pulse(of, speed, struck, mass=mass)
    else:
        # That there is a mass to divide by is asked first, at any speed.
        at_unit_speed = pulse_lasting(contact, of.mass, 1.0)
        pulse = pulse_lasting(contact, of.mass, peak / at_unit_speed.peak if speed is None else speed)
    if not WEAKEST <= pulse.peak <= HARDEST:
        raise WrongUse(
            f"the blow's greatest force would be {pulse.peak:.3g} N; say a speed that makes it {WEAKEST:g} "
            f"to {HARDEST:g} N"
        )
    return HammerBlow.lasting(force, pulse)


def pulse_lasting(duration: float, mass: float, speed: float) -> HertzPulse:
    """The blow of a mass whose tip is just so hard that the contact lasts ``duration``.

    Args:
        duration: s, above zero and at most ``LONGEST``.
        mass: kg, that stops and flies back.
        speed: m/s, at the first touch.

    Raises:
        WrongUse: a quantity that is not above zero, or a contact that lasts too long.
    """
    for name, value, unit in (
        ("contact", duration, "s"),
        ("hammer's mass", mass, "kg"),
        ("speed", speed, "m/s"),
    ):
        if not (math.isfinite(value) and value > 0.0):
            raise WrongUse(f"a {name} of {value:g} {unit} makes no blow; say one above 0 {unit}")
    if duration > LONGEST:
        raise WrongUse(f"a contact of {duration:g} s is a push and no blow; say at most {LONGEST:g} s")
    momentum = mass * speed
    return HertzPulse(duration, _PEAKED * momentum / duration, 2.0 * momentum, duration * speed / DURATION)
