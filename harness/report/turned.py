"""A painted surface that a page's reader turns by dragging: few faces, as base64 of small integers."""

import base64

import numpy as np

from harness.basics.arrays import AnyArray, FloatArray
from harness.basics.mesh import Mesh
from harness.experiment.report_content import TurnedSurface
from harness.report.figures.shape import KnownSurface, scale_of
from harness.report.figures.style import HEAT

MOST_FACES = 14_000
"""Of a surface on a canvas, which paints them one by one."""

_STEPS = 32_000

_FIRST_CELL = 2.0e-3
_WIDER = 1.2


def turned_surface(shown: KnownSurface, most_faces: int = MOST_FACES) -> TurnedSurface:
    """A surface in the colours of its still picture.

    Args:
        shown: the surface, how well it is known, and its contacts.
        most_faces: that are kept; a surface of more is coarsened.
    """
    mesh, deviation = fewer_faces(shown.mesh, shown.deviation, most_faces)
    middle = mesh.bounds.mean(axis=0)
    step = max(float(np.abs(mesh.vertices - middle).max()), 1e-9) / _STEPS
    marks = np.clip((shown.contacts.reshape(-1, 3) - middle) / step, -_STEPS, _STEPS)
    painted = np.asarray(HEAT(scale_of(shown.deviation)(1e3 * deviation)))[:, :3]
    colours = 255.0 * painted
    return TurnedSurface(
        places=_base64(np.rint((mesh.vertices - middle) / step), "<i2"),
        faces=_base64(mesh.faces, "<u2"),
        colours=_base64(np.rint(colours), "u1"),
        marks=_base64(np.rint(marks), "<i2"),
    )


def _base64(values: AnyArray, kind: str) -> str:
    return base64.b64encode(np.ascontiguousarray(values).astype(kind).tobytes()).decode("ascii")


def fewer_faces(mesh: Mesh, values: FloatArray, most: int) -> tuple[Mesh, FloatArray]:
    """A coarser surface to look at, and ``(vertices,)`` values on it: no more than ``most`` faces.

    Vertices of one cell of a grid that face one way become their mean, so that the two sides of a wall stay
    apart. The result need not be closed.

    Args:
        mesh: m.
        values: ``(vertices,)``.
        most: faces, a hundred or more.
    """
    cell = _FIRST_CELL
    found, carried = mesh, values
    while len(found.faces) > most:
        found, carried = _clustered(mesh, values, cell)
        cell *= _WIDER
    return found, carried


def _clustered(mesh: Mesh, values: FloatArray, cell: float) -> tuple[Mesh, FloatArray]:
    rows, normals = np.arange(len(mesh.vertices)), mesh.vertex_normals
    axis = np.abs(normals).argmax(axis=1)
    side = 2 * axis + (normals[rows, axis] > 0.0)
    keys = np.column_stack([np.floor(mesh.vertices / cell).astype(np.int64), side])
    _, cluster = np.unique(keys, axis=0, return_inverse=True)
    cluster = cluster.ravel()
    counts = np.bincount(cluster)
    columns = [np.bincount(cluster, column) / counts for column in (*mesh.vertices.T, values)]
    faces = cluster[mesh.faces]
    a, b, c = faces.T
    return Mesh(np.column_stack(columns[:3]), np.asarray(faces[(a != b) & (b != c) & (c != a)])), np.asarray(
        columns[3]
    )
