"""What the perceptron of ObjectFolder 2.0 is asked: nine numbers for each pixel of each press.

``x, y, z, tilt, cos(azimuth), sin(azimuth), depth, row, column``: metres in the object's frame, radians,
metres, pixels counted from 0. There is no yaw among them, so there is none in what it can answer, but
for half turns, which turn the map.
"""

import numpy as np

from harness.basics.arrays import FloatArray
from harness.basics.errors import OutOfDomain
from harness.bench.sensor import TactileSensor
from harness.sim.gel.presses import Presses

INPUTS = 9

_HALF_TURN = 1e-6
"""rad by which a yaw may be off one: the outermost pixel then moves by less than a thousandth of itself."""


def pixel_queries(presses: Presses, sensor: TactileSensor) -> FloatArray:
    """``(n, rows * columns, 9)``.

    Raises:
        OutOfDomain: a yaw other than a multiple of half a turn.
    """
    turns = np.rint(presses.yaws / np.pi)
    off = np.abs(presses.yaws - np.pi * turns)
    if (off > _HALF_TURN).any():
        worst = int(np.argmax(off))
        raise OutOfDomain(
            f"a yaw of {np.degrees(presses.yaws[worst]):.4g} deg was asked of the perceptron, which knows 0 "
            "and 180 deg alone, as the paper's; take the level codes"
        )
    rows, columns = np.divmod(np.arange(sensor.rows * sensor.columns), sensor.columns)
    last_row, last_column = sensor.rows - 1, sensor.columns - 1
    turned = (turns % 2 == 1)[:, None]
    asked = np.empty((len(presses), len(rows), INPUTS))
    asked[:, :, :3] = presses.points[:, None]
    asked[:, :, 3] = presses.tilts[:, None]
    asked[:, :, 4] = np.cos(presses.azimuths)[:, None]
    asked[:, :, 5] = np.sin(presses.azimuths)[:, None]
    asked[:, :, 6] = presses.depths[:, None]
    asked[:, :, 7] = np.where(turned, last_row - rows, rows)
    asked[:, :, 8] = np.where(turned, last_column - columns, columns)
    return asked
