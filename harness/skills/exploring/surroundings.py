"""What the arm moves in while a contact is planned, and whether a planned motion may be made there."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from harness.basics.arrays import FloatArray
from harness.basics.mesh import Mesh
from harness.basics.mesh_hull import closed_hull
from harness.bench.scene import SceneFile
from harness.bench.station_file import Station
from harness.skills.strike import StrikeMotion
from harness.twin.bench import TwinBench
from harness.twin.rehearsal import rehearse
from harness.twin.strike_motion import PlannedStrike


@dataclass(frozen=True, eq=False)
class Surroundings:
    """The bench around an object of which too little is known."""

    scene: SceneFile  #: of the run.
    station: Station  #: whose arm it is.
    travels: TwinBench  #: the bench with all the space that the object may take in its place.
    nothing: TwinBench  #: the bench without an object.
    joints: FloatArray  #: ``(6,)`` rad, where the arm is.


def nowhere(place: FloatArray) -> Mesh:
    """A mark of 2 mm on the support, in base: stands for an object of which nothing is known.

    Args:
        place: ``(3,)`` m in base: where the object nominally stands.
    """
    low = np.array([-1.0e-3, -1.0e-3, 0.0])
    ends = np.array([low, low + 2.0e-3]) + place
    corners = np.array([[ends[i, 0], ends[j, 1], ends[k, 2]] for i in (0, 1) for j in (0, 1) for k in (0, 1)])
    return closed_hull(corners)


def rehearsed_strike(strike: PlannedStrike, travels: TwinBench, lines: TwinBench) -> StrikeMotion:
    """A planned strike, gone through in the twin.

    Raises:
        MotionRefused: it must not be made.
    """
    rehearse(travels, strike.travels(0)).require()
    rehearse(lines, strike.lines(0)).require()
    return StrikeMotion.planned(strike)


def end_of(parameters: Any) -> FloatArray:
    """``(6,)`` rad: where a contact or a strike of these parameters leaves the arm."""
    travel = np.asarray(parameters["travel_rad"], dtype=np.float64).reshape(-1, 6)
    return travel[-1] if len(travel) else np.asarray(parameters["start_rad"], dtype=np.float64)
