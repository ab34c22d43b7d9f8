"""How well it is known where an object stands, and where the gel meets it."""

from dataclasses import dataclass

import numpy as np

from harness.bench.bench_errors import BenchErrors

READING = 0.2e-3
"""M, by which the places of all imprints lie off the object alike, as the gel hangs around what it meets: the
root mean square over ten runs of seeds 40, 60 and 61."""


@dataclass(frozen=True)
class StandErrors:
    """How well it is known where the object stands: standard deviations.

    Attributes:
        place: m, per axis of the plane.
        support: m, of the height.
        tilt: rad, per axis, of the object's own stand.
        depth: m, along its axis, of where the gel is on the arm and how deep it reads: of all contacts alike.
        contact: m, along its axis, of each: the arm's, the object's shape there, and the gel's reading.
    """

    place: float = 0.1
    support: float = 1.0e-3
    tilt: float = float(np.radians(0.5))
    depth: float = 0.54e-3
    contact: float = 0.45e-3

    @classmethod
    def at(cls, bench: BenchErrors, place: float, support: float) -> "StandErrors":
        """On a bench whose errors are stated; place and support in m, as above."""
        depth = float(np.linalg.norm([bench.gel_centre, bench.gel_depth, READING]))
        return cls(place, support, bench.tilt, depth, float(np.hypot(bench.arm, bench.gel_depth)))
