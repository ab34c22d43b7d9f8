"""The arm of the twin: a MuJoCo model made from the maker's tables and collision bodies."""

from dataclasses import dataclass
from typing import Any, Final

import mujoco
import numpy as np
from scipy.spatial import ConvexHull

from harness.basics.arrays import FloatArray, read_only
from harness.basics.geometry import apply, transform
from harness.bench.ur_tables import LINKS, TWIST_COSINES, TWIST_SINES, ArmTable, arm_table
from harness.twin.link_hulls import link_hulls

ARM_COLOUR: Final = (0.72, 0.74, 0.77, 1.0)
JOINT_COLOUR: Final = (0.35, 0.52, 0.68, 1.0)

NAME: Final = "hammer"
SOLENOID_RADIUS: Final = 0.012  # m
TIP_RADIUS: Final = 0.004  # m
TIP_LENGTH: Final = 0.02  # m, from the tip at rest back to the solenoid


@dataclass(frozen=True, eq=False)
class Part:
    """One convex body that moves with a link."""

    name: str  #: as refusals name it.
    link: int  #: 0 for what stands still, else the joint it moves with.
    vertices: FloatArray  #: ``(n, 3)`` m in the frame of that joint.


def link_from_previous(table: ArmTable, joint: int) -> FloatArray:
    """``previous_from_link``, ``(4, 4)`` at zero angle, of joint 1 to 6.

    The frame of a joint has its z along the axis the joint turns about, and its origin where
    the next link's length starts; the last one is the flange.
    """
    twist_sin = 0.0 if joint == 1 else TWIST_SINES[joint - 2]
    twist_cos = 1.0 if joint == 1 else TWIST_COSINES[joint - 2]
    length = 0.0 if joint == 1 else table.a[joint - 2]
    turn = np.array([[1.0, 0.0, 0.0], [0.0, twist_cos, -twist_sin], [0.0, twist_sin, twist_cos]])
    offset = np.array([length, 0.0, 0.0]) + table.d[joint - 1] * turn[:, 2]
    return transform(turn, offset)


def arm_parts(model: str) -> list[Part]:
    """The base and the six links."""
    return [Part(link, index, hull) for index, (link, hull) in enumerate(link_hulls(model).items())]


def add_arm(spec: Any, model: str) -> Any:
    """Add the arm to a MuJoCo spec; the body of the last link, which is the flange."""
    table = arm_table(model)
    hulls = link_hulls(model)
    body = spec.worldbody.add_body(name="base")
    add_hull(spec, body, "base", hulls["base"], ARM_COLOUR)
    for joint, link in enumerate(LINKS[1:], start=1):
        placement = link_from_previous(table, joint)
        quaternion = np.empty(4)
        mujoco.mju_mat2Quat(quaternion, placement[:3, :3].ravel())
        body = body.add_body(name=link, pos=placement[:3, 3], quat=quaternion)
        body.add_joint(name=f"joint_{joint}", type=mujoco.mjtJoint.mjJNT_HINGE, axis=[0.0, 0.0, 1.0])
        sine, cosine = TWIST_SINES[joint - 1], TWIST_COSINES[joint - 1]
        turn = np.array([[1.0, 0.0, 0.0], [0.0, cosine, -sine], [0.0, sine, cosine]])
        tensor = turn @ table.inertias[joint - 1] @ turn.T
        body.explicitinertial = True
        body.mass = table.masses[joint - 1]
        body.ipos = turn @ table.centres[joint - 1] + np.array([table.a[joint - 1], 0.0, 0.0])
        body.fullinertia = [
            tensor[0, 0],
            tensor[1, 1],
            tensor[2, 2],
            tensor[0, 1],
            tensor[0, 2],
            tensor[1, 2],
        ]
        add_hull(spec, body, link, hulls[link], ARM_COLOUR if joint < 4 else JOINT_COLOUR)
    # MuJoCo leaves out parent and child, but not where the parent stands still.
    spec.add_exclude(bodyname1="base", bodyname2="shoulder")
    return body


def reaches(model: str, parts: list[Part]) -> FloatArray:
    """How far from each joint's axis any point of each part can come, whatever the joints between do.

    Returns:
        ``(6, parts)`` m; 0 where the joint does not move the part. A part moves by no more
        than the sum over joints of this times the angle.
    """
    table = arm_table(model)
    reach = np.zeros((6, len(parts)))
    for p, part in enumerate(parts):
        radius = float(np.linalg.norm(part.vertices[:, :2], axis=1).max())
        low, high = float(part.vertices[:, 2].min()), float(part.vertices[:, 2].max())
        for joint in range(part.link, 0, -1):
            reach[joint - 1, p] = radius
            radius, low, high = _swept(table, joint, radius, low, high)
    return read_only(reach)


def _swept(table: ArmTable, joint: int, radius: float, low: float, high: float) -> tuple[float, float, float]:
    """The cylinder about the joint before that holds a cylinder about this joint, freely turned."""
    placement = link_from_previous(table, joint)
    along = placement[:3, 2]
    if abs(along[2]) > 0.5:  # parallel axes
        moved = placement[2, 3]
        return float(np.hypot(*placement[:2, 3])) + radius, low + moved, high + moved
    # Crossing axes: the offset along the joint's own axis moves the cylinder along itself.
    shift = float(placement[:3, 3] @ along)
    furthest = max(abs(low + shift), abs(high + shift))
    return float(np.hypot(furthest, radius)), -radius, radius


def add_hull(spec: Any, body: Any, name: str, vertices: FloatArray, colour: tuple[float, ...]) -> None:
    """Give a body of a model the convex hull of ``(n, 3)`` points, in metres of its frame, as its shape."""
    spec.add_mesh(name=name, uservert=vertices.ravel(), inertia=mujoco.mjtMeshInertia.mjMESH_INERTIA_CONVEX)
    body.add_geom(name=name, type=mujoco.mjtGeom.mjGEOM_MESH, meshname=name, mass=0.0, rgba=colour)


def striker(flange_from_hammer: FloatArray) -> Part:
    """The hammer at rest in the flange's frame: a slender body from the flange's middle to the tip.

    Args:
        flange_from_hammer: ``(4, 4)``, origin at the tip, z along the strike.
    """
    angles = np.linspace(0.0, 2 * np.pi, 12, endpoint=False)
    ring = np.column_stack([np.cos(angles), np.sin(angles), np.zeros(12)])
    back = np.array([0.0, 0.0, -TIP_LENGTH])
    front = apply(flange_from_hammer, np.concatenate([TIP_RADIUS * ring, SOLENOID_RADIUS * ring + back]))
    root = SOLENOID_RADIUS * ring + np.array([0.0, 0.0, SOLENOID_RADIUS])
    points = np.concatenate([front, root])
    return Part(NAME, 6, points[ConvexHull(points).vertices])
