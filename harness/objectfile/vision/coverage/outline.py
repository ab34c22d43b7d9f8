"""Which pixels a mesh covers and how much of each, and how deep it is there."""

from dataclasses import dataclass
from functools import cache

import numpy as np

from harness.basics.arrays import AnyArray, FloatArray, read_only
from harness.basics.mesh import Mesh, signed_volume
from harness.objectfile.vision.coverage.contour import Contours, covered, crossed
from harness.objectfile.vision.coverage.front import find_front, gathered, nearest_of, projected
from harness.objectfile.vision.coverage.raster import NEAREST, draw, look_through, placed
from harness.objectfile.vision.threads import Crew, Workspace
from harness.picture.pinhole import Pinhole

_LEAST = 512
"""Faces that another thread is asked to draw: fewer are drawn sooner than their pixels are compared."""


@dataclass(frozen=True, eq=False)
class Outline:
    """A picture's pixels, those that show anything.

    Attributes:
        pixels: ``(n,)`` counted row by row.
        cover: ``(n,)`` float32: share of each that is covered.
        places: ``(n, 2)`` float32 x and y, pixels: the covered place that is nearest to its centre.
        depth: ``(n,)`` float32 m, there; empty where it was not asked for.
        faces: ``(n,)`` int32, which face that is; empty where it was not asked for.
    """

    pixels: AnyArray
    cover: AnyArray
    places: AnyArray
    depth: AnyArray
    faces: AnyArray


@cache
def centre_out(side: int) -> AnyArray:
    """``(side * side, 2)`` int64 sub-pixels of a pixel, row and column, from its centre outwards."""
    rows, columns = np.divmod(np.arange(side * side), side)
    away = (rows - side // 2) ** 2 + (columns - side // 2) ** 2
    chosen = np.argsort(away, kind="stable")
    return read_only(np.stack([rows[chosen], columns[chosen]], axis=1))


def is_closed(mesh: Mesh) -> bool:
    """Whether a surface has no border, and its faces look outwards: some face then hides each one's back."""
    begin, end = mesh.faces.reshape(-1), np.roll(mesh.faces, -1, axis=1).reshape(-1)
    # One number for a way along an edge: rows would be sorted ten times as slowly.
    forth, back = (np.sort(one * len(mesh.vertices) + other) for one, other in ((begin, end), (end, begin)))
    matched = np.array_equal(forth, back) and bool((np.diff(forth) > 0).all())
    return matched and signed_volume(mesh) > 0.0


def mesh_outline(
    mesh: Mesh,
    closed: bool,
    camera: Pinhole,
    side: int,
    crew: Crew,
    room: Workspace,
    is_told: bool = False,
    contours: Contours | None = None,
) -> Outline:
    """What a mesh covers of a picture.

    Args:
        mesh: in metres.
        closed: of ``is_closed``.
        camera: that looks.
        side: sub-pixels along a pixel, odd.
        crew: shares the rows.
        room: that arrays are taken from.
        is_told: whether faces are asked for.
        contours: of the mesh; None for such as are made for this picture alone.
    """
    made = contours or Contours.of(mesh)
    seen = room.take("seen", (len(mesh.vertices), 3), np.float64)
    x, y = side * camera.centre_px[0] - 0.5, side * camera.centre_px[1] - 0.5
    least = projected(mesh.vertices, camera.camera_from_object, side * camera.focal_px, x, y, seen)
    hides = closed and bool(((camera.eye < made.bounds[0]) | (camera.eye > made.bounds[1])).any())
    if not least >= NEAREST:
        return drawn_outline(mesh, hides, camera, side, crew, room, is_told)
    rows, columns = camera.height, camera.width
    offsets = centre_out(side)
    sides, some = (room.take(f"faces {kind}", (len(mesh.faces),), kind) for kind in ("int8", "int32"))
    shown = some[: made.turned(camera.eye, hides, sides, some)]
    count, looked = (room.take(name, (rows, columns), np.uint8) for name in ("count", "looked"))
    begins, stretches = crossed(seen, made.edges, sides, rows * side, columns * side)
    most = covered(begins, stretches, side, offsets, count, looked)
    nearness, front = _fronts(seen, made.faces, shown, looked, offsets, side, crew, room)
    found = gathered(count, looked, nearness, front, side, offsets, most)
    return Outline(*found) if is_told else Outline(*found[:-1], np.empty(0, np.int32))


def _fronts(
    seen: FloatArray,
    faces: AnyArray,
    shown: AnyArray,
    looked: AnyArray,
    offsets: AnyArray,
    side: int,
    crew: Crew,
    room: Workspace,
) -> tuple[AnyArray, AnyArray]:
    """Inverse depth and face in front: each thread draws some faces, then the nearer ones are taken."""
    parts = min(crew.threads, max(len(shown) // _LEAST, 1))
    nearness = room.take("nearness", (parts, *looked.shape), np.float32)
    front = room.take("front", (parts, *looked.shape), np.int32)
    ends = np.linspace(0, len(shown), parts + 1).astype(int).tolist()

    def draw_some(first: int, last: int) -> None:
        for k in range(first, last):
            nearness[k] = 0.0
            some = shown[ends[k] : ends[k + 1]]
            find_front(seen, faces, some, looked, offsets, side, nearness[k], front[k])

    crew.share(draw_some, parts, parts)
    nearest_of(nearness, front)
    return nearness[0], front[0]


def drawn_outline(
    mesh: Mesh, hides: bool, camera: Pinhole, side: int, crew: Crew, room: Workspace, is_told: bool
) -> Outline:
    """As ``mesh_outline``, face by face at every sub-pixel: of a mesh that reaches behind the camera."""
    rows, columns = camera.height, camera.width
    focal = side * camera.focal_px
    x, y = side * camera.centre_px[0] - 0.5, side * camera.centre_px[1] - 0.5
    seen = room.take("seen and placed", (len(mesh.vertices), 6), np.float64)
    nearness = room.take("fine nearness", (rows * side, columns * side), np.float32)
    cover, depth = (room.take(name, (rows, columns), np.float32) for name in ("cover", "depth"))
    each = int(is_told)
    front = room.take("fine front", (each * rows * side, each * columns * side), np.int32)
    faces = room.take("outline faces", (each * rows, each * columns), np.int32)
    places, offsets = room.take("at", (rows, columns, 2), np.float32), centre_out(side)

    def project(first: int, last: int) -> None:
        part = mesh.vertices[first:last]
        placed(part, camera.camera_from_object, focal, x, y, seen[first:last])

    def band(first: int, last: int) -> None:
        nearness[first * side : last * side] = 0.0
        draw(seen, mesh.faces, focal, x, y, first * side, last * side, hides, nearness, front)
        look_through(nearness, front, side, offsets, first, last, cover, places, depth, faces)

    crew.share(project, len(mesh.vertices), crew.threads, 4096)
    # Every band looks at every face.
    crew.share(band, rows, crew.threads)
    pixels = np.flatnonzero(cover)
    return Outline(
        *(pixels, cover.ravel()[pixels], places.reshape(-1, 2)[pixels], depth.ravel()[pixels]),
        faces.ravel()[pixels] if is_told else np.empty(0, np.int32),
    )


def whole_picture(camera: Pinhole) -> Outline:
    """Every pixel, through its centre."""
    count = camera.width * camera.height
    rows, columns = np.divmod(np.arange(count), camera.width)
    places = np.stack([columns + 0.5, rows + 0.5], axis=1).astype(np.float32)
    return Outline(
        np.arange(count), np.ones(count, np.float32), places, np.empty(0, np.float32), np.empty(0, np.int32)
    )
