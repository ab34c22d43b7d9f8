"""Contacts at one place count once: repeating a reading averages its noise and no error that repeats with it.

A second touch of the same point in the same attitude has the same error of the object's shape, of the gel's
mounting and of the surface model. An estimator that takes both for independent becomes too certain.
"""

from dataclasses import dataclass

import numpy as np

from harness.basics.arrays import FloatArray, IntArray, read_only
from harness.basics.errors import OutOfDomain
from harness.bench.gap import BenchErrors

SIGMAS = 3.0
"""Standard deviations of a difference between two contacts within which they agree."""


@dataclass(frozen=True)
class PlaceTolerance:
    """Largest differences between two contacts at one place."""

    lateral: float  #: distance across the press axis in m.
    axial: float  #: distance along the press axis in m.
    tilt: float  #: angle between the press axes in rad.

    @classmethod
    def from_errors(cls, errors: BenchErrors, gel_thickness: float) -> "PlaceTolerance":
        """Derive the tolerance from the stated errors of the arm and the gel.

        Args:
            errors: standard deviations of the bench.
            gel_thickness: thickness of the gel in m; presses of one place differ by no more in depth.
        """
        difference = SIGMAS * np.sqrt(2.0)
        lateral = float(difference * errors.arm)
        tilt = float(difference * np.hypot(errors.arm_tilt, errors.gel_tilt))
        return cls(lateral, lateral + gel_thickness, tilt)


def group_by_place(points: FloatArray, axes: FloatArray, tolerance: PlaceTolerance) -> IntArray:
    """Assign each contact to the place of the first earlier contact that agrees with it.

    The first contact of a group decides, so a row of close contacts does not merge into one place. A rotation
    of the gel about its own axis does not make a new place.

    Args:
        points: ``(n, 3)`` centre of the gel at each contact in m.
        axes: ``(n, 3)`` unit press axis of each contact, out of the gel.
        tolerance: largest differences within one place.

    Returns:
        ``(n,)`` index of each contact's place, from 0 in order of first appearance.

    Raises:
        OutOfDomain: the arrays differ in shape or hold numbers that are not finite.
    """
    centres, directions = np.asarray(points, np.float64), np.asarray(axes, np.float64)
    shaped = centres.ndim == 2 and centres.shape[1] == 3 and centres.shape == directions.shape
    if not shaped or not (np.isfinite(centres).all() and np.isfinite(directions).all()):
        raise OutOfDomain(
            f"contacts have points of shape {centres.shape} and axes of shape {directions.shape}; give one "
            "finite point and one finite unit axis of three coordinates each for every contact"
        )
    first: list[int] = []
    places = np.zeros(len(centres), np.int64)
    for k, (centre, direction) in enumerate(zip(centres, directions, strict=True)):
        offsets = centre - centres[first]
        axial = offsets @ direction
        lateral = np.linalg.norm(offsets - axial[:, None] * direction, axis=1)
        sine = np.linalg.norm(np.cross(directions[first], direction), axis=1)
        angle = np.arctan2(sine, directions[first] @ direction)
        agrees = (
            (lateral <= tolerance.lateral) & (np.abs(axial) <= tolerance.axial) & (angle <= tolerance.tilt)
        )
        if agrees.any():
            places[k] = int(agrees.argmax())
        else:
            places[k] = len(first)
            first.append(k)
    return places


def weigh_repeated(places: IntArray) -> FloatArray:
    """Give the contacts of each place a total weight of one.

    Args:
        places: ``(n,)`` index of each contact's place, as ``group_by_place`` returns it.

    Returns:
        ``(n,)`` factor on each contact's log-likelihood: one over the number of contacts at its place.
    """
    return read_only(1.0 / np.bincount(places)[places]) if len(places) else read_only(np.zeros(0))
