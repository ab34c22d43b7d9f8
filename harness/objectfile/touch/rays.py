"""Where the rays of a gel's pixels are, and what lies between coarser ones."""

import numpy as np

from harness.basics.arrays import AnyArray
from harness.bench.sensor import TactileSensor


def ray_places(sensor: TactileSensor, coarse: int) -> tuple[AnyArray, AnyArray]:
    """Float32 x and y, m, of rays that are ``coarse`` pixels apart."""
    rows, columns, pitch = sensor.rows // coarse, sensor.columns // coarse, sensor.pitch * coarse
    x = (np.arange(columns) + 0.5 - columns / 2) * pitch
    y = (np.arange(rows) + 0.5 - rows / 2) * pitch
    return x.astype(np.float32), y.astype(np.float32)


def row_terms(sensor: TactileSensor, fine: int) -> AnyArray:
    """``(rows, 2)`` float32: one, and y in m."""
    y = ray_places(sensor, fine)[1]
    return np.stack([np.ones_like(y), y], axis=1)


def between(size: int, coarse: int) -> AnyArray:
    """``(size, size / coarse)`` float32: linear between coarse pixels, constant beyond the outer ones."""
    count = size // coarse
    at = np.clip((np.arange(size) + 0.5) / coarse - 0.5, 0.0, count - 1.0)
    first = np.minimum(at.astype(np.int64), max(count - 2, 0))
    matrix = np.zeros((size, count), np.float32)
    matrix[np.arange(size), first] = 1.0 - (at - first)
    np.add.at(matrix, (np.arange(size), np.minimum(first + 1, count - 1)), at - first)
    return matrix
