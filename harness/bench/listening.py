"""A strike, with its force and its sound: on one clock, or from two instruments on a clock each."""

from collections.abc import Callable

from harness.bench.acquisition_channels import FORCE, PRESSURE
from harness.bench.device import ImpactHammer, Microphone
from harness.bench.reading import Reading

MARGIN = 0.05
"""s of sound kept beyond either end of the force: more than a sound card's latency."""


def capture(
    hammer: ImpactHammer,
    microphone: Microphone | None,
    fire: Callable[[], None],
    before: float,
    after: float,
    timeout: float,
) -> tuple[Reading, ...]:
    """Call ``fire()`` and return what was read around the strike, by whatever hears it.

    The force triggers; a microphone of its own listens all the time and is asked afterwards for the
    same stretch of the bench clock.

    Args:
        hammer: its box reads the force.
        microphone: on a clock of its own; None where the hammer's box reads it too.
        fire: strikes, or asks a person to.
        before: s kept from before the trigger.
        after: s kept from the trigger on.
        timeout: s from ``fire()``'s return to the trigger.

    Returns:
        The channels of ``ImpactHammer.capture``. From a microphone of its own ``microphone.pressure``
        is that microphone's, with its flags, callback times and clock (``harness.bench.microphone_take``).

    Raises:
        BenchFault: samples of the force were lost, or an instrument went away. Lost sound is flagged.
    """
    read = hammer.capture(fire, before, after, timeout)
    if microphone is None:
        return read
    force = next(reading for reading in read if reading.channel.name == FORCE)
    # Block times are those of the first samples: one block more lies behind the last of them.
    longest = before + after + 2.0 * MARGIN
    start = float(force.times[0]) - MARGIN
    heard = microphone.between(start, start + longest)
    return (*(reading for reading in read if reading.channel.name != PRESSURE), *heard)
