"""The bench as bodies in space: arm, tactile sensor, table, pedestal, object. Nothing moves by itself.

MuJoCo places the bodies and measures the gaps between their convex hulls; where the object's
hull is too near, its triangles decide. Time is never stepped.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Final

import mujoco
import numpy as np
from scipy.spatial import ConvexHull

from harness.basics.arrays import FloatArray, IntArray, read_only
from harness.basics.errors import WrongUse
from harness.basics.geometry import apply, inverse, transform
from harness.basics.mesh import Mesh
from harness.bench.kinematics import LINKS, TWIST_COSINES, TWIST_SINES, ArmTable, arm_table
from harness.bench.sensor import TactileSensor
from harness.twin.link_hulls import link_hulls
from harness.twin.triangles import ConvexBody, Solid

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


PAD_RIM: Final = 1e-3  # m of gel around the window that the camera sees
HOUSING_LENGTH: Final = 0.06  # m along the sensor's axis
MOUNT_RADIUS: Final = 0.022  # m, of what carries the housing on the flange
NO_GAP: Final = 1e-3  # m; an object this near the table stands on it
WORKSPACE_MARGIN: Final = 5e-3  # m; between two samples of a sweep a point bulges less than that

_GREY, _BLACK, _WOOD = (0.55, 0.57, 0.6, 1.0), (0.12, 0.12, 0.14, 1.0), (0.72, 0.6, 0.45, 1.0)
_GEL, _FOAM, _OBJECT = (0.9, 0.75, 0.3, 1.0), (0.3, 0.33, 0.4, 1.0), (0.8, 0.35, 0.25, 1.0)


@dataclass(frozen=True)
class Hit:
    """Two bodies nearer than they may be."""

    first: str  #: name of the body that moves more.
    second: str  #: name of the other.
    gap: float
    """m between them; negative where they overlap. Of convex hulls, so for the object a lower bound."""

    def __str__(self) -> str:
        """In words, with the gap in millimetres."""
        if self.gap < 0:
            return f"the {self.first} would run into the {self.second}".replace("_", " ")
        return f"the {self.first} would come within {1e3 * self.gap:.1f} mm of the {self.second}".replace(
            "_", " "
        )


@dataclass(frozen=True, eq=False)
class Near:
    """Pairs of bodies within sight of each other in one posture."""

    pairs: IntArray  #: ``(n, 2)`` indices of parts, the one nearer the arm's root first.
    gaps: FloatArray  #: ``(n,)`` m.


class TwinBench:
    """Everything that could be hit, and the question whether it is.

    Args:
        model: of the arm: ``"ur3e"``, ``"ur5e"`` or ``"ur10e"``.
        flange_from_gel: ``(4, 4)``, where the flange carries the gel.
        sensor: the tactile camera; its housing is a box behind the gel.
        mesh: the object, m.
        base_from_object: ``(4, 4)``, its nominal pose.
        table_height: m in base.
        pedestal_radius: m, of the foam pedestal between table and object.
        clearance: m that everything keeps from everything, outside a press; at least 1 mm,
            because motions are sampled every 2 mm of surface motion.
        joint_range: ``(2, 6)`` rad, within the maker's, which holds alone where it is None.
        flange_from_hammer: ``(4, 4)``, the tip of the striker at rest, z along the strike; None
            without one.
        workspace: ``(2, 3)`` m in base, the corners of the box that the station keeps the tool in; None
            without one.
        tool_points: ``(n, 3)`` m in the flange's frame, the points that are kept in it.
        has_object: false where nobody knows what stands there: the mesh is then only a mark on the support.

    Raises:
        WrongUse: an unknown arm, or an object that reaches below the table.
    """

    def __init__(
        self,
        model: str,
        flange_from_gel: FloatArray,
        sensor: TactileSensor,
        mesh: Mesh,
        base_from_object: FloatArray,
        table_height: float = 0.0,
        pedestal_radius: float = 0.03,
        clearance: float = 2e-3,
        joint_range: FloatArray | None = None,
        flange_from_hammer: FloatArray | None = None,
        workspace: FloatArray | None = None,
        tool_points: FloatArray | None = None,
        has_object: bool = True,
    ) -> None:
        if clearance < 1e-3:
            raise WrongUse(f"twin: a clearance of {1e3 * clearance:g} mm; it must be at least 1 mm")
        self.model = model
        self.has_object = has_object
        self.flange_from_gel = read_only(np.array(flange_from_gel, dtype=np.float64))
        self.gel_from_flange = read_only(inverse(self.flange_from_gel))
        self.base_from_object = read_only(np.array(base_from_object, dtype=np.float64))
        self.object_from_base = read_only(inverse(self.base_from_object))
        self.sensor = sensor
        self.solid = Solid(mesh)
        self.clearance = clearance
        self.joint_range = arm_table(model).joint_range
        if joint_range is not None:
            low, high = self.joint_range
            low, high = np.maximum(low, joint_range[0]), np.minimum(high, joint_range[1])
            self.joint_range = read_only(np.stack([low, high]))
        self._object_in_base = apply(self.base_from_object, self.solid.hull)
        self.object_top = float(self._object_in_base[:, 2].max())
        # The space before and behind the gel's surface that the object may dent, in the gel's frame.
        half = _half_pad(sensor)
        self.pad = ConvexBody.box(np.array([*-half, -HOUSING_LENGTH]), np.array([*half, HOUSING_LENGTH]))
        tool = [*_tool(sensor, self.flange_from_gel)]
        if flange_from_hammer is not None:
            tool.append(striker(np.asarray(flange_from_hammer, dtype=np.float64)))
        standing = [Part(name, 0, np.zeros((1, 3))) for name in ("table", "pedestal", "object")]
        self.parts = [*arm_parts(model), *tool, *standing]
        self.reach = reaches(model, self.parts)
        self.mujoco_model = self._make_spec(tool, table_height, pedestal_radius).compile()
        # The middle phase's boxes keep the margins they were compiled with.
        self.mujoco_model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_MIDPHASE
        self.data = mujoco.MjData(self.mujoco_model)
        self.links = np.array([part.link for part in self.parts])
        self._bodies = [ConvexBody.of_points(part.vertices) for part in self.parts[: -len(standing)]]
        names = [part.name for part in self.parts]
        geoms = [self.mujoco_model.geom(i).name for i in range(self.mujoco_model.ngeom)]
        self._part_of_geom = np.array([names.index(name) for name in geoms])
        self._gel, self._object = names.index("gel"), names.index("object")
        self._within = -1.0
        self._workspace = None if workspace is None else np.asarray(workspace, dtype=np.float64)
        self._tool_points = np.zeros((1, 3)) if tool_points is None else np.asarray(tool_points)

    def place(self, joints: FloatArray) -> None:
        """Put the bodies where ``(6,)`` rad put them."""
        self.data.qpos[:] = joints
        mujoco.mj_kinematics(self.mujoco_model, self.data)

    def base_from_gel(self, joints: FloatArray) -> FloatArray:
        """``(4, 4)``: the gel's frame in a posture of ``(6,)`` rad."""
        self.place(joints)
        gel: FloatArray = self._base_from_link(6) @ self.flange_from_gel
        return gel

    def near(self, joints: FloatArray, within: float) -> Near:
        """All pairs of bodies that are closer than ``within`` m."""
        if within != self._within:
            # MuJoCo adds the margins of the two; the bodies' own decide in the broad phase.
            self.mujoco_model.geom_margin[:] = 0.5 * within
            self.mujoco_model.body_margin[:] = 0.5 * within
            self._within = within
        self.place(joints)
        mujoco.mj_collision(self.mujoco_model, self.data)
        contact = self.data.contact
        pairs = self._part_of_geom[contact.geom]
        swap = self.links[pairs[:, 0]] > self.links[pairs[:, 1]]
        pairs[swap] = pairs[swap][:, ::-1]
        return Near(pairs, contact.dist.copy())

    def hits(self, joints: FloatArray, press: bool = False) -> tuple[Hit, ...]:
        """What a posture of ``(6,)`` rad hits.

        Args:
            joints: rad.
            press: whether the gel may touch the object, and the rest of the tool come as close
                to it as it likes without touching.
        """
        return self.judge(self.near(joints, self.clearance), press)

    def judge(self, near: Near, press: bool) -> tuple[Hit, ...]:
        """What of the pairs is too near, with the bodies where :meth:`place` last put them."""
        hits = self._outside()
        close = near.gaps < self.clearance
        if not close.any():
            return tuple(hits)
        for first, second in np.unique(near.pairs[close], axis=0).tolist():
            gap = float(near.gaps[(near.pairs == (first, second)).all(axis=1)].min())
            if self._object in (first, second) and not self._object_hit(first + second - self._object, press):
                continue
            hits.append(Hit(self.parts[second].name, self.parts[first].name, gap))
        return tuple(hits)

    def pad_depth(self, base_from_gel: FloatArray) -> float:
        """How deep, in m, the object reaches into the pad; negative: still to go; -inf: nothing ahead."""
        object_from_gel = self.object_from_base @ base_from_gel
        return -self.solid.least_along(self.pad, object_from_gel)

    def tool_hits(self, base_from_gel: FloatArray, press: bool) -> bool:
        """Whether the mount, the housing or the gel is too near the object, whatever the arm does."""
        object_from_flange = self.object_from_base @ base_from_gel @ self.gel_from_flange
        clearance = 0.0 if press else self.clearance
        tool = [p for p, link in enumerate(self.links) if link == 6 and self.parts[p].name != "wrist_3"]
        return any(
            self.solid.meets(self._bodies[part], object_from_flange, clearance)
            for part in tool
            if not (press and part == self._gel)
        )

    def _outside(self) -> list[Hit]:
        """How far the tool has left the station's workspace, with the bodies where they are."""
        if self._workspace is None:
            return []
        points = apply(self._base_from_link(6), self._tool_points)
        low, high = self._workspace
        gap = float(np.minimum(points - low, high - points).min()) - WORKSPACE_MARGIN
        return [] if gap >= 0.0 else [Hit("tool", "limit_of_the_workspace", gap)]

    def _object_hit(self, part: int, press: bool) -> bool:
        """Whether a moving part really is too near the object, by its triangles."""
        if press and part == self._gel:
            return False
        object_from_link = self.object_from_base @ self._base_from_link(self.parts[part].link)
        return self.solid.meets(self._bodies[part], object_from_link, 0.0 if press else self.clearance)

    def _base_from_link(self, link: int) -> FloatArray:
        pose = np.eye(4)
        body = link + 1  # body 0 is MuJoCo's world
        pose[:3, :3] = self.data.xmat[body].reshape(3, 3)
        pose[:3, 3] = self.data.xpos[body]
        return pose

    def _make_spec(self, tool: Sequence[Part], table_height: float, pedestal_radius: float) -> Any:
        spec = mujoco.MjSpec()
        spec.compiler.degree = False
        flange = add_arm(spec, self.model)
        for part, colour in zip(tool, (_GREY, _BLACK, _GEL, _GREY), strict=False):
            add_hull(spec, flange, part.name, part.vertices, colour)
        add_hull(spec, spec.worldbody, "object", self._object_in_base, _OBJECT)
        low = self._object_in_base[:, 2].min()
        if low < table_height - NO_GAP:
            raise WrongUse(
                f"twin: the object reaches {1e3 * (table_height - low):.1f} mm below the table at z = "
                f"{table_height:g} m in base; raise it in the scene, or lower the table in the station"
            )
        spec.worldbody.add_geom(
            name="table",
            type=mujoco.mjtGeom.mjGEOM_PLANE,
            size=[1.0, 1.0, 0.05],
            pos=[0.0, 0.0, table_height],
            rgba=_WOOD,
        )
        if low > table_height + NO_GAP:
            self._add_pedestal(spec, table_height, float(low), pedestal_radius)
        return spec

    def _add_pedestal(self, spec: Any, table_height: float, low: float, radius: float) -> None:
        """Under the middle of what the object stands on."""
        feet = self._object_in_base[self._object_in_base[:, 2] < low + 0.01, :2]
        middle = 0.5 * (feet.min(axis=0) + feet.max(axis=0))
        spec.worldbody.add_geom(
            name="pedestal",
            type=mujoco.mjtGeom.mjGEOM_CYLINDER,
            size=[radius, 0.5 * (low - table_height), 0.0],
            pos=[*middle, 0.5 * (low + table_height)],
            rgba=_FOAM,
        )


def _half_pad(sensor: TactileSensor) -> FloatArray:
    half: FloatArray = np.minimum(0.5 * np.array(sensor.window) + PAD_RIM, 0.5 * np.array(sensor.housing))
    return half


def _tool(sensor: TactileSensor, flange_from_gel: FloatArray) -> tuple[Part, Part, Part]:
    """Mount, housing and gel in the flange's frame; the housing's face lies a gel's thickness back."""
    half, gel_half = 0.5 * np.array(sensor.housing), _half_pad(sensor)
    face = -sensor.gel_thickness
    back = max(face - HOUSING_LENGTH, 0.5 * (face - float(np.linalg.norm(flange_from_gel[:3, 3]))))
    housing = ConvexBody.box(np.array([*-half, back]), np.array([*half, face]))
    gel = ConvexBody.box(np.array([*-gel_half, face]), np.array([*gel_half, 0.0]))
    angles = np.linspace(0.0, 2 * np.pi, 16, endpoint=False)
    ring = MOUNT_RADIUS * np.column_stack([np.cos(angles), np.sin(angles), np.zeros(16)])
    mount = np.concatenate([ring, apply(flange_from_gel, ring * 0.6 + np.array([0.0, 0.0, back]))])
    return (
        Part("mount", 6, mount[ConvexHull(mount).vertices]),
        Part("housing", 6, apply(flange_from_gel, housing.vertices)),
        Part("gel", 6, apply(flange_from_gel, gel.vertices)),
    )


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
    """Bound the distance of any point of each part from each joint's axis, over all joint angles between.

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
