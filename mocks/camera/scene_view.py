"""What the scene camera sees: the bench's bodies, shaded by a lamp beside the lens."""

from dataclasses import dataclass

import numpy as np

from harness.basics.arrays import ByteArray, FloatArray, read_only
from harness.basics.compiled import compiled
from harness.basics.geometry import apply, inverse
from harness.basics.mesh import Mesh

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
