"""Where in a pixel its samples are."""

import functools
from math import gcd

from harness.basics.errors import OutOfDomain

MOST_SAMPLES = 64
"""A side of a pixel: four thousand places, and less error than a grey level of 12 bits."""

QUARTERS = 4

Place = tuple[float, float]


def pixel_places(samples: int) -> list[tuple[Place, int]]:
    """(x, y) of ``samples**2`` places in a pixel, and which quarter each is of, 0 to 3.

    A lattice of one generator (Korobov), of all such the one whose two nearest places are farthest apart.
    Each of ``samples**2`` columns and rows has one place in its middle. For edges of any slope the error
    goes with the number of places to the power of -0.77 (measured: docs/explanation/vision.md).

    Args:
        samples: a side of a pixel, 1 to 64.

    Raises:
        OutOfDomain: fewer or more.
    """
    count = _counted(samples)
    rows = _rows(count)
    return [(((k + 0.5) / count, (row + 0.5) / count), k % QUARTERS) for k, row in enumerate(rows)]


def quarter_counts(samples: int) -> tuple[int, ...]:
    """How many places each quarter has; errors as of ``pixel_places``."""
    count = _counted(samples)
    return tuple(len(range(quarter, count, QUARTERS)) for quarter in range(QUARTERS))


def _counted(samples: int) -> int:
    if not 1 <= samples <= MOST_SAMPLES:
        raise OutOfDomain(f"{samples} samples a side of a pixel were asked for; give 1 to {MOST_SAMPLES}")
    return samples**2


@functools.cache
def _rows(count: int) -> tuple[int, ...]:
    """The row of each column's place."""
    if count == 4:
        # A lattice of four has all of them in one line: four queens have not.
        return 2, 0, 3, 1
    steps = [step for step in range(1, max(count, 2)) if gcd(step, count) == 1]
    best = max(steps, key=lambda step: _nearest(count, step))
    return tuple(column * best % count for column in range(count))


def _nearest(count: int, step: int) -> int:
    """Square of the shortest way between two places of a lattice (Gauss's reduction), in rows."""
    short, long = (1, step), (0, count)
    while True:
        if short[0] ** 2 + short[1] ** 2 > long[0] ** 2 + long[1] ** 2:
            short, long = long, short
        size = short[0] ** 2 + short[1] ** 2
        times = round((short[0] * long[0] + short[1] * long[1]) / size)
        if times == 0:
            return size
        long = (long[0] - times * short[0], long[1] - times * short[1])
