"""The one world behind all mocks: it holds the truth, and says what each instrument reads.

Everything is a function of where the controller believes the flange to be, the step and the
sample; the world keeps no clock and no state, so a rerun reads the same values.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from harness.basics.arrays import ByteArray, FloatArray, read_only
from harness.basics.compiled import compiled
from harness.basics.faces.nearest_surface import plane_shares
from harness.basics.geometry import apply, inverse, transform, translation
from harness.basics.mesh import Mesh
from harness.bench.gap import Gap
from harness.bench.sensor import TactileSensor
from harness.bench.station import BARE
from harness.sim.gel.height_map import RasterMesh, depth_image, penetration
from mocks.world.gap_draw import GapDraw, nearest_face, split_long_edges
from mocks.world.touch import GelContact, HousingContact, PictureGrid, WorldGel

_NEAREST = 0.01
_AMBIENT = 0.25
_BACKGROUND = (30, 34, 40)


@dataclass(frozen=True, eq=False)
class Body:
    """One body of the scene."""

    mesh: Mesh  #: in the body's own frame.
    base_from_body: FloatArray  #: ``(4, 4)``.
    colour: tuple[int, int, int]  #: RGB, 0 to 255.


class SceneView:
    """A pinhole camera that looks at bodies which stay and bodies which move.

    Args:
        base_from_camera: ``(4, 4)``; x right, y down, z forward.
        rows: pixels.
        columns: pixels.
        focal_length: pixels; the optical axis passes through the middle of the picture.
        fixed: bodies that stay where they are; drawn once.
    """

    def __init__(
        self, base_from_camera: FloatArray, rows: int, columns: int, focal_length: float, fixed: list[Body]
    ) -> None:
        self._camera_from_base = inverse(base_from_camera)
        self._focal_length = focal_length
        colours = np.empty((rows, columns, 3), dtype=np.uint8)
        colours[:] = _BACKGROUND
        closeness = np.zeros((rows, columns))
        for body in fixed:
            self._draw(body, colours, closeness)
        self._colours, self._closeness = read_only(colours), read_only(closeness)

    def picture(self, moving: list[Body]) -> ByteArray:
        """``(rows, columns, 3)`` uint8, RGB, with the ``moving`` bodies where they are now."""
        colours, closeness = self._colours.copy(), self._closeness.copy()
        for body in moving:
            self._draw(body, colours, closeness)
        return colours

    def _draw(self, body: Body, colours: ByteArray, closeness: FloatArray) -> None:
        camera_from_body = self._camera_from_base @ body.base_from_body
        corners = apply(camera_from_body, body.mesh.vertices)[body.mesh.faces]
        in_front = np.all(corners[..., 2] > _NEAREST, axis=1)
        normals = body.mesh.face_normals @ camera_from_body[:3, :3].T
        towards = corners.mean(axis=1)
        facing = np.abs(np.einsum("ij,ij->i", normals, towards)) / np.linalg.norm(towards, axis=1)
        light = _AMBIENT + (1.0 - _AMBIENT) * facing
        shades = np.round(np.array(body.colour) * light[:, None]).astype(np.uint8)
        _paint(corners[in_front], shades[in_front], self._focal_length, colours, closeness)


LONGEST_EDGE = 5.0e-3
"""Metres, in the world's own tessellation: short beside the length over which shape deviates."""

CUT = 0.9
"""Of the longest edge of a mesh with shorter ones: some are cut always, so that no tessellation is shared."""

SPRING_SPACING = 0.75e-3
REACH = 10.0e-3
"""Metres behind the gel's surface beyond which nothing is felt: deeper than any gel is thick."""

BESIDE = 50.0e-3
"""Metres behind the gel's surface where the sensor's body ends."""


@dataclass(frozen=True, eq=False)
class Camera:
    """The scene camera: ``base_from_camera`` ``(4, 4)``, pixels, and focal length in pixels."""

    base_from_camera: FloatArray
    rows: int
    columns: int
    focal_length: float


@dataclass(frozen=True)
class Furniture:
    """What the scene camera sees beside the object: metres, in base."""

    table_height: float = 0.0
    table_size: tuple[float, float] = (1.6, 1.6)
    pedestal_width: float = 0.06


@dataclass(frozen=True, eq=False)
class NominalBench:
    """The bench as the scene and the station state it."""

    mesh: Mesh  #: of the object, on a tessellation that nobody else uses.
    base_from_object: FloatArray  #: ``(4, 4)``.
    flange_from_gel: FloatArray  #: ``(4, 4)``.
    sensor: TactileSensor  #: the make of the gel.
    calibration: str  #: of the gel that estimators believe in: the name of a shipped one, or a path.
    other_calibration: str | None
    """the same of presses that no estimator has seen; None where there are none, and the world has the
    estimator's."""
    camera: Camera | None = None  #: the scene camera, None where there is none.
    furniture: Furniture = Furniture()  #: around the object.
    made_scale: float | None = None
    """of the object over its drawing, in ``mesh`` already; None where its size is stated."""
    drawing: Mesh | None = None
    """of an object whose size is hidden, as the scene names it; None where ``mesh`` is that."""


@dataclass(frozen=True, eq=False)
class Met:
    """Where something meets the true object."""

    point: FloatArray  #: ``(3,)`` m in the object's frame, on the true surface.
    nominal: FloatArray  #: ``(3,)`` m, the same material point on the nominal surface.


class World:
    """The truth of one run."""

    def __init__(self, bench: NominalBench, gap: Gap, seed: int) -> None:
        if bench.sensor.markers is not None or bench.sensor.casts_shadow:
            raise NotImplementedError("mocks.world.world: printed markers and shadows in the gel")
        self._bench = bench
        self.made_scale = 1.0 if bench.made_scale is None else bench.made_scale
        """of the drawing, over the one that the scene names: other than 1 where its size is hidden."""
        self.drawing = bench.mesh if bench.drawing is None else bench.drawing
        """the object as the scene names it."""
        self._draw = GapDraw(gap, seed)
        self._flange_from_gel: dict[int, FloatArray] = {}
        self._grid = PictureGrid.drawn(bench.sensor, self._draw.run.pitch, self._draw.run.aspect)
        self.sensor = self._grid.sensor  #: the gel as it was made: the make's, but for its pitch.
        edges = bench.mesh.corners - np.roll(bench.mesh.corners, 1, axis=1)
        longest = float(np.linalg.norm(edges, axis=-1).max())
        self.nominal = split_long_edges(bench.mesh, min(LONGEST_EDGE, CUT * longest))
        """the same of the size that it was made, on the world's own tessellation."""
        self._deviation = self._draw.deviation(self.nominal.bounds.mean(axis=0))
        self.scale = self._draw.run.scale  #: of the true object, over that.
        self.mesh = Mesh(self._deviation.applied(self.nominal.vertices), self.nominal.faces)
        """the true object, in its own frame; the same faces."""
        middle = apply(self._bench.base_from_object, self.nominal.bounds.mean(axis=0)[None])[0]
        run = self._draw.run
        moved = translation(middle + run.position) @ transform(run.object_rotation, np.zeros(3))
        placed: FloatArray = moved @ translation(-middle) @ self._bench.base_from_object
        self.base_from_object = read_only(placed)  #: ``(4, 4)`` true pose of the object.
        self._object_from_base = inverse(self.base_from_object)
        self._raster = RasterMesh(self.mesh)
        self._middle = apply(self.base_from_object, self.mesh.bounds.mean(axis=0)[None])[0]
        tool = float(np.linalg.norm(bench.flange_from_gel[:3, 3]))
        self._touching_distance = (
            self.mesh.diagonal / 2 + tool + float(np.hypot(*self.sensor.housing)) + REACH
        )
        steeper = bench.sensor.pitch / self._grid.mean_pitch
        other = bench.other_calibration if gap.gel.calibration == "other presses" else None
        self._believed = other is None
        self._gel = WorldGel(self.sensor, gap.gel, other or bench.calibration, steeper)
        self.background = self._gel.background  #: ``(rows, columns, 3)``, the picture of the untouched gel.
        self._shading = self._draw.shading(self.sensor.rows, self.sensor.columns)
        self._contact = GelContact(self.mesh, self.sensor.window, SPRING_SPACING, REACH)
        self._housing = HousingContact(self.mesh, self.sensor) if gap.sensor.housing == "rigid" else None

    def tactile_image(self, base_from_flange: FloatArray, step: int, sample: int) -> ByteArray:
        """What the gel's camera sees, ``(rows, columns, 3)`` uint8, RGB; without contact, the background."""
        penetration = self._indentation(base_from_flange, step)
        if not penetration.any():
            return self.background.copy()
        offset = self._draw.contact(step).height_offset
        noise = self._draw.pixel_noise(self.sensor.rows, self.sensor.columns, step, sample)
        return self._gel.picture(penetration, self._draw.run.height_gain, offset + self._shading + noise)

    def contact_wrench(self, base_from_flange: FloatArray, step: int) -> FloatArray:
        """``(6,)`` N and N m that the object exerts at the flange, on gel and housing, in base."""
        offset = base_from_flange[:3, 3] - self._middle
        if float(offset @ offset) > self._touching_distance**2:
            return np.zeros(6)
        flange_from_gel = self._true_flange_from_gel(step)
        base_from_gel = self._true_base_from_flange(base_from_flange, step) @ flange_from_gel
        object_from_gel = self._object_from_base @ base_from_gel
        in_gel = self._contact.wrench(object_from_gel)
        if self._housing is not None:
            in_gel += self._housing.wrench(object_from_gel)
        rotation = base_from_gel[:3, :3]
        force = rotation @ in_gel[:3]
        x, y, z = base_from_flange[:3, :3] @ flange_from_gel[:3, 3]
        turning = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])  # np.cross takes 40 us
        return np.concatenate([force, rotation @ in_gel[3:] + turning @ force])

    def penetration(self, base_from_flange: FloatArray, step: int) -> float:
        """Metres that the object reaches into the gel at the deepest pixel; zero without contact."""
        return float(self._indentation(base_from_flange, step).max())

    def true_contact(self, base_from_flange: FloatArray, step: int) -> FloatArray:
        """The point touched, ``(3,)`` metres: a material point, given where it is on the nominal surface.

        It is the point first met by the line through the gel's centre along the gel's z axis; where
        that line meets nothing within the gel's thickness, the surface point nearest to the centre.
        """
        object_from_gel = self._object_from_gel(base_from_flange, step)
        met = self._first_met(object_from_gel, -BESIDE, self.sensor.gel_thickness)
        if met is not None:
            return met.nominal
        face, in_object = nearest_face(self.mesh, object_from_gel[:3, 3])
        return self._nominal_point(face, in_object)

    def met_by(
        self, base_from_flange: FloatArray, flange_from_tip: FloatArray, step: int, stroke: float
    ) -> Met | None:
        """Where a tip that comes out along its z axis by ``stroke`` m meets the object, if it does.

        Args:
            base_from_flange: ``(4, 4)``, as the controller reports it.
            flange_from_tip: ``(4, 4)``, where the tip really is on the flange.
            step: of the run.
            stroke: m.
        """
        return self._first_met(self._object_from_tip(base_from_flange, flange_from_tip, step), 0.0, stroke)

    def direction_in_object(
        self, base_from_flange: FloatArray, flange_from_tip: FloatArray, step: int
    ) -> FloatArray:
        """``(3,)`` unit: the z axis of the tip of ``met_by``, in the object's frame."""
        direction: FloatArray = self._object_from_tip(base_from_flange, flange_from_tip, step)[:3, 2]
        return direction

    def differences(self) -> Mapping[str, Any]:
        """What the world does differently from the nominal bench, for the report."""
        return {
            **self._draw.summary(),
            "calibration": "the estimator's" if self._believed else "other presses",
            **self._hidden(),
            "mesh_vertices": len(self.mesh.vertices),
            "mesh_faces": len(self.mesh.faces),
            "optics_level": "exact",
            "calibration_sha256": self._gel.calibration.sha256,
        }

    def scene_image(self, base_from_flange: FloatArray, step: int = -1, sample: int = -1) -> ByteArray:
        """What the scene camera sees, ``(rows, columns, 3)`` uint8, RGB; at ``BARE`` without the object."""
        camera = self._bench.camera
        if camera is None:
            raise ValueError("this scene has no camera; ask for none of its pictures")
        view = self._bare_view if sample == BARE else self._view
        width, height = self.sensor.housing
        length = float(self._bench.flange_from_gel[2, 3])
        tool = box((width, height, length), (0.0, 0.0, -length / 2))
        seen = view.picture([Body(tool, base_from_flange @ self._bench.flange_from_gel, (70, 90, 200))])
        noise = self._draw.camera_noise(camera.rows, camera.columns, step, sample)
        return np.clip(np.rint(seen + noise), 0, 255).astype(np.uint8) if noise.any() else seen

    def _hidden(self) -> Mapping[str, Any]:
        if self._bench.made_scale is None:
            return {}
        longest = float(np.ptp(self.mesh.bounds, axis=0).max())
        return {"made_scale": self._bench.made_scale, "longest_side_m": longest}

    @cached_property
    def _view(self) -> SceneView:
        return self._looking(with_object=True)

    @cached_property
    def _bare_view(self) -> SceneView:
        return self._looking(with_object=False)

    def _looking(self, with_object: bool) -> SceneView:
        camera = self._bench.camera
        assert camera is not None
        furniture = self._bench.furniture
        vertices = apply(self.base_from_object, self.mesh.vertices)
        low, high = vertices.min(axis=0), vertices.max(axis=0)
        (x, y, _), lowest, top = 0.5 * (low + high), float(low[2]), furniture.table_height
        fixed = [Body(self.mesh, self.base_from_object, (225, 205, 170))] if with_object else []
        table = box((*furniture.table_size, 0.02), (0.0, 0.0, top - 0.01))
        fixed.append(Body(split_long_edges(table, 0.1), np.eye(4), (120, 110, 100)))
        if lowest > top:
            width = furniture.pedestal_width
            foam = box((width, width, lowest - top), (x, y, 0.5 * (lowest + top)))
            fixed.append(Body(foam, np.eye(4), (90, 90, 95)))
        base_from_camera, focal = self._draw.camera(camera.base_from_camera, camera.focal_length)
        return SceneView(base_from_camera, camera.rows, camera.columns, focal, fixed)

    def _true_flange_from_gel(self, step: int) -> FloatArray:
        if step not in self._flange_from_gel:
            tilt = transform(self._draw.contact(step).gel_rotation, np.zeros(3))
            true = self._bench.flange_from_gel @ self._draw.run.gel_from_true_gel @ tilt
            self._flange_from_gel[step] = read_only(true)
        return self._flange_from_gel[step]

    def _true_base_from_flange(self, base_from_flange: FloatArray, step: int) -> FloatArray:
        """Where the flange is; the controller believes it to be at ``base_from_flange``."""
        contact = self._draw.contact(step)
        along_tool = base_from_flange[:3, :3] @ self._bench.flange_from_gel[:3, 2]
        true = base_from_flange.copy()
        true[:3, 3] += contact.arm_error + contact.along_tool * along_tool
        return true

    def _object_from_gel(self, base_from_flange: FloatArray, step: int) -> FloatArray:
        base_from_gel = self._true_base_from_flange(base_from_flange, step) @ self._true_flange_from_gel(step)
        object_from_gel: FloatArray = self._object_from_base @ base_from_gel
        return object_from_gel

    def _object_from_tip(
        self, base_from_flange: FloatArray, flange_from_tip: FloatArray, step: int
    ) -> FloatArray:
        true = self._true_base_from_flange(base_from_flange, step)
        object_from_tip: FloatArray = self._object_from_base @ true @ flange_from_tip
        return object_from_tip

    def _first_met(self, object_from_tool: FloatArray, near: float, far: float) -> Met | None:
        """What the line along a tool's z axis meets first between two depths, in m."""
        met = depth_image(self._raster, inverse(object_from_tool), 1e-6, 1, 1, near=near, far=far)
        face = int(met.face[0, 0])
        if face < 0:
            return None
        point = apply(object_from_tool, np.array([[0.0, 0.0, met.depth[0, 0]]]))[0]
        return Met(point, self._nominal_point(face, point))

    def _nominal_point(self, face: int, point: FloatArray) -> FloatArray:
        nominal: FloatArray = plane_shares(self.mesh.corners[face], point) @ self.nominal.corners[face]
        return nominal

    def _indentation(self, base_from_flange: FloatArray, step: int) -> FloatArray:
        gel_from_object = inverse(self._object_from_gel(base_from_flange, step))
        gaps = self._grid.gaps(self._raster, gel_from_object)
        indentation: FloatArray = penetration(gaps[None], self.sensor)[0]
        return indentation


@compiled
def _paint(
    corners: FloatArray, shades: ByteArray, focal_length: float, colours: ByteArray, closeness: FloatArray
) -> None:
    """Nearest face of each pixel; 1 / z is linear in the picture, so it is what is compared."""
    rows, columns = closeness.shape
    x, y, near = np.empty(3), np.empty(3), np.empty(3)
    for face in range(len(corners)):
        for corner in range(3):
            near[corner] = 1.0 / corners[face, corner, 2]
            x[corner] = focal_length * corners[face, corner, 0] * near[corner] + columns / 2 - 0.5
            y[corner] = focal_length * corners[face, corner, 1] * near[corner] + rows / 2 - 0.5
        area = (x[1] - x[0]) * (y[2] - y[0]) - (x[2] - x[0]) * (y[1] - y[0])
        if area == 0.0:
            continue
        first = max(0, int(np.ceil(min(x[0], x[1], x[2]))))
        last = min(columns - 1, int(np.floor(max(x[0], x[1], x[2]))))
        top = max(0, int(np.ceil(min(y[0], y[1], y[2]))))
        bottom = min(rows - 1, int(np.floor(max(y[0], y[1], y[2]))))
        for row in range(top, bottom + 1):
            for column in range(first, last + 1):
                u = ((x[1] - column) * (y[2] - row) - (x[2] - column) * (y[1] - row)) / area
                v = ((x[2] - column) * (y[0] - row) - (x[0] - column) * (y[2] - row)) / area
                w = 1.0 - u - v
                if u >= -1e-9 and v >= -1e-9 and w >= -1e-9:
                    here = u * near[0] + v * near[1] + w * near[2]
                    if here > closeness[row, column]:
                        closeness[row, column] = here
                        for channel in range(3):
                            colours[row, column, channel] = shades[face, channel]


def box(size: tuple[float, float, float], centre: tuple[float, float, float]) -> Mesh:
    """An axis-aligned box of ``size`` metres about ``centre``."""
    corners = np.array([[x, y, z] for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)])
    quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    faces = [face for a, b, c, d in quads for face in ((a, b, c), (a, c, d))]
    return Mesh(corners * np.array(size) + np.array(centre), np.array(faces))
