"""Bodies that stand about on a bench, for its picture."""

import numpy as np

from harness.basics.arrays import FloatArray
from harness.basics.geometry import apply, rotation_about, transform, translation
from harness.basics.mesh import Mesh
from harness.basics.mesh_hull import closed_hull
from harness.bench.kinematics import link_frames
from harness.bench.sensor import TactileSensor
from harness.bench.ur_tables import arm_table
from harness.report.data import BenchPart
from harness.twin.link_hulls import link_hulls

ALUMINIUM, BLUE, FOAM = (0.80, 0.82, 0.84), (0.45, 0.60, 0.74), (0.46, 0.48, 0.54)
TABLE, HOUSING, GEL = (0.94, 0.92, 0.88), (0.30, 0.31, 0.34), (0.93, 0.74, 0.38)
MOUNT = (0.55, 0.56, 0.60)
CLAY = (0.93, 0.91, 0.87)

_Z = np.array([0.0, 0.0, 1.0])


def box(low: FloatArray, high: FloatArray) -> Mesh:
    """A box between two corners in metres."""
    corners = [[x, y, z] for x in (low[0], high[0]) for y in (low[1], high[1]) for z in (low[2], high[2])]
    return closed_hull(np.array(corners))


def cylinder(radius: float, low: float, high: float) -> Mesh:
    """An upright cylinder about z, in metres."""
    angle = 2.0 * np.pi * np.arange(64) / 64
    ring = radius * np.column_stack([np.cos(angle), np.sin(angle), np.zeros(64)])
    return closed_hull(np.vstack([ring + low * _Z, ring + high * _Z]))


def object_part(mesh: Mesh, base_from_object: FloatArray) -> BenchPart:
    """The object, in the colour of clay."""
    return BenchPart(mesh, base_from_object, CLAY)


def table_and_pedestal(
    base_from_object: FloatArray, bottom: float, radius: float = 0.03, table: float = 0.0
) -> tuple[BenchPart, BenchPart]:
    """The table about the object, and the foam under it.

    Args:
        base_from_object: ``(4, 4)``.
        bottom: metres, z of the object's lowest point in base.
        radius: metres, of the pedestal.
        table: metres, z of the table's top in base.
    """
    x, y = base_from_object[:2, 3]
    low, high = np.array([x - 0.3, y - 0.4, table - 0.02]), np.array([x + 0.75, y + 0.4, table])
    foot = BenchPart(cylinder(radius, table, bottom), translation(np.array([x, y, 0.0])), FOAM)
    return BenchPart(box(low, high), np.eye(4), TABLE, smooth=False), foot


def sensor_parts(
    sensor: TactileSensor, base_from_gel: FloatArray, gel_from_flange: FloatArray
) -> tuple[BenchPart, BenchPart, BenchPart]:
    """Gel, housing and mount of a tactile camera on a flange."""
    half, window = 0.5 * np.array(sensor.housing), 0.5 * np.array(sensor.window)
    face = -sensor.gel_thickness
    back = face - 0.045
    housing = box(np.array([*-half, back]), np.array([*half, face]))
    gel = box(np.array([*-window, face]), np.array([*window, 0.0]))
    ring = cylinder(0.03, -1e-3, 1e-3).vertices
    mount = np.vstack([apply(gel_from_flange, ring), 0.45 * ring + back * _Z])
    return (
        BenchPart(gel, base_from_gel, GEL, smooth=False),
        BenchPart(housing, base_from_gel, HOUSING, smooth=False),
        BenchPart(closed_hull(mount), base_from_gel, MOUNT),
    )


def arm_parts(model: str, joints: FloatArray) -> tuple[BenchPart, ...]:
    """The base and the six links of a UR arm at ``(6,)`` rad."""
    frames, table = link_frames(model, joints), arm_table(model)
    parts = []
    for index, hull in enumerate(link_hulls(model).values()):
        base_from_link = np.eye(4)
        if index > 0:
            turned = transform(rotation_about(_Z, float(joints[index - 1])), table.d[index - 1] * _Z)
            base_from_link = frames[index - 1] @ turned
        parts.append(BenchPart(closed_hull(hull), base_from_link, BLUE if index in (4, 5) else ALUMINIUM))
    return tuple(parts)
