"""The twin of a bench as its scene and station state it, and the way on from wherever its arm is."""

import numpy as np

from harness.basics.arrays import FloatArray
from harness.basics.errors import WrongUse
from harness.basics.mesh import Mesh
from harness.bench.scene import SceneFile
from harness.bench.station_file import Station
from harness.twin.bench import TwinBench
from harness.twin.ways import connect


def twin_of(
    scene: SceneFile,
    station: Station,
    mesh: Mesh,
    base_from_object: FloatArray | None = None,
    has_object: bool = True,
) -> TwinBench:
    """The bench as the scene and the station state it.

    Args:
        scene: the table and what stands on it.
        station: the arm and its tools.
        mesh: of the object, in metres.
        base_from_object: ``(4, 4)``; None for the scene's.
        has_object: see ``TwinBench``.
    """
    safety = station.arm.safety
    return TwinBench(
        station.arm.model,
        station.flange_from_gel,
        station.gel.sensor,
        mesh,
        scene.base_from_object(mesh) if base_from_object is None else base_from_object,
        table_height=scene.table.height,
        pedestal_radius=0.5 * scene.support.width,
        joint_range=np.array([safety.joint_low, safety.joint_high]),
        flange_from_hammer=station.flange_from_hammer,
        workspace=np.array([safety.workspace_low, safety.workspace_high]),
        tool_points=station.tool_points,
        has_object=has_object,
    )


def way_between(bench: TwinBench, here: FloatArray, planned: FloatArray) -> FloatArray:
    """From where the arm is to the end of a planned travel, hitting nothing.

    Straight to its end where there is a natural way; else onto the travel, as late as can be, and
    along it; else by a search.

    Args:
        bench: the twin.
        here: ``(6,)`` rad.
        planned: ``(n, 6)`` rad: the travel, the posture that it starts at first.

    Returns:
        ``(m, 6)`` rad, the last of them the travel's end.

    Raises:
        WrongUse: there is no such way.
    """
    for thorough in (False, True):
        for k in reversed(range(len(planned))):
            way = connect(bench, here, planned[k], thorough=thorough)
            if way is not None:
                return np.concatenate([way, planned[k + 1 :]])
    meeting = " and ".join(f"the {hit.first} is in the {hit.second}" for hit in bench.hits(here))
    raise WrongUse(
        "no way was found from where the arm is to the first contact"
        + (f" (by the twin {meeting} there)" if meeting else "")
        + "; move it by hand to a place above the object, clear of the table, and start again"
    )
