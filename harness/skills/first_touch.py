"""Where on its way the gel first touched, from the arm's own packets.

Where the arm stops tells little: the stop comes some packets late, the threshold is met by the
noise of one packet, and zeroing takes one packet's noise as its zero. On a soft contact these
move the stop by tenths of a millimetre from one press to the next. The mean force of the free way
gives the zero, and a short mean over packets the moment at which the force left it.
"""

from collections.abc import Sequence

import numpy as np

from harness.basics.arrays import FloatArray
from harness.basics.errors import BenchFault
from harness.bench.reading import Reading

AVERAGED = 0.02
"""s over which the force is averaged: the noise of ten packets at 500 Hz, and 0.2 mm of the way."""

FREE = 3.0e-3
"""m before the stop up to which the way counts as free: a touch at the search's speed is noticed sooner."""

ZEROED_BY = 10
"""Packets of free way that give a better zero than zeroing did."""


def first_touch(history: Sequence[Reading], axis: FloatArray, force: float) -> float:
    """Metres along ``axis`` from the base's origin to where the flange was when the gel touched.

    Args:
        history: packets of the search, from its start to its stop.
        axis: ``(3,)`` unit in base: the way of the search.
        force: N of mean resistance that is a touch; half of what stopped the search.

    Raises:
        BenchFault: the arm's packets have no poses or no forces.
    """
    named = {reading.channel.name: reading for reading in history}
    try:
        poses, wrenches = named["arm.base_from_flange"], named["arm.wrench"]
    except KeyError as missing:
        raise BenchFault(f"arm: its packets have no {missing}; check the recipe of its stream") from missing
    along = poses.values[:, :3] @ axis
    resistance = -(wrenches.values[:, :3] @ axis)
    free = along < along[-1] - FREE
    if np.count_nonzero(free) >= ZEROED_BY:
        resistance = resistance - resistance[free].mean()
    seconds = float(poses.times[-1] - poses.times[0])
    count = max(1, round(AVERAGED * (len(along) - 1) / seconds)) if seconds > AVERAGED else 1
    window = np.full(count, 1.0 / count)
    way, mean = (np.convolve(values, window, mode="valid") for values in (along, resistance))
    met = np.flatnonzero(mean >= force)
    if len(met) == 0 or met[0] == 0:
        return float(along[-1])
    after = int(met[0])
    share = (force - mean[after - 1]) / (mean[after] - mean[after - 1])
    return float(way[after - 1] + share * (way[after] - way[after - 1]))
