"""The places of a surface that codes belong to, and which of them a press is nearest to."""

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from harness.basics.arrays import AnyArray, FloatArray, IntArray
from harness.basics.errors import DataRefused, OutOfDomain
from harness.basics.geometry import inverse
from harness.objectfile.npy_file import npy_array, npy_bytes
from harness.sim.gel.press_pose import Presses, frames_facing

BEND = 20e-3
"""m: the distance that counts as much as a turn of the normal by one radian."""


@dataclass(frozen=True, eq=False)
class SurfaceNodes:
    """Places of a surface, no two alike."""

    points: FloatArray  #: ``(n, 3)`` m, in the object's frame.
    normals: FloatArray  #: ``(n, 3)`` unit, outward, of the face.

    def __len__(self) -> int:
        return len(self.points)

    def __getitem__(self, which: AnyArray) -> "SurfaceNodes":
        return SurfaceNodes(self.points[which], self.normals[which])

    @property
    def object_from_node(self) -> FloatArray:
        """``(n, 4, 4)``: frames whose z axes point straight into the surface."""
        poses = np.zeros((len(self), 4, 4))
        poses[:, :3, :3], poses[:, :3, 3], poses[:, 3, 3] = frames_facing(-self.normals), self.points, 1.0
        return poses


def signatures(points: FloatArray, normals: FloatArray) -> FloatArray:
    """``(n, 6)`` m: places and their normals as one kind of distance."""
    return np.hstack([points, BEND * normals])


class NodeSearch:
    """Finds the node of a press.

    Args:
        nodes: at least one.
        most: m, of ``signatures``: the farthest that a press may be from its node.
    """

    def __init__(self, nodes: SurfaceNodes, most: float) -> None:
        self._tree = cKDTree(signatures(nodes.points, nodes.normals))
        self._node_from_object = inverse(nodes.object_from_node)
        self.most = most

    def nearest(self, presses: Presses) -> tuple[IntArray, FloatArray]:
        """``(n,)`` nodes, and ``(n,)`` m how far each press is from its own."""
        return self.nearest_to(SurfaceNodes(presses.points, presses.normals))

    def nearest_to(self, places: SurfaceNodes) -> tuple[IntArray, FloatArray]:
        """``(n,)`` nodes, and ``(n,)`` m how far each place is from its own."""
        gaps, nodes = self._tree.query(signatures(places.points, places.normals))
        return np.asarray(nodes, np.int64), np.asarray(gaps, np.float64)

    def posed(self, nodes: IntArray, object_from_gel: FloatArray) -> dict[str, AnyArray]:
        """What ``touch_graph.codes_graph`` takes, of ``(n,)`` nodes and ``(n, 4, 4)`` poses of the gel."""
        node_from_gel = self._node_from_object[nodes] @ object_from_gel
        return {"node": nodes[:, None], "node_from_gel": np.ascontiguousarray(node_from_gel[:, :3])}

    def queries(self, presses: Presses) -> dict[str, AnyArray]:
        """What ``touch_graph.codes_graph`` takes.

        Raises:
            OutOfDomain: a press that no node is near: a gel cannot come to it straight from outside.
        """
        nodes, gaps = self.nearest(presses)
        if (gaps > self.most).any():
            worst = int(np.argmax(gaps))
            x, y, z = presses.points[worst]
            raise OutOfDomain(
                f"{int(np.count_nonzero(gaps > self.most))} of {len(presses)} presses are at places that no "
                f"gel comes to straight from outside, or with another normal than theirs, the first at "
                f"({x:.4f}, {y:.4f}, {z:.4f}) m: nearest code {gaps[worst] * 1e3:.3g} mm away, the limit is "
                f"{self.most * 1e3:.3g} mm; take the place and the normal of press_pose.contact_place"
            )
        return self.posed(nodes, presses.object_from_gel)


def nodes_bytes(nodes: SurfaceNodes) -> bytes:
    """Write ``.npy``: float64 ``(n, 6)``, points in metres and normals."""
    return npy_bytes(np.hstack([nodes.points, nodes.normals]), "<f8")


def nodes_from(data: bytes, name: str) -> SurfaceNodes:
    """Read nodes from a ``.npy`` file of float64 ``(n, 6)``, points in metres and normals.

    Raises:
        DataRefused: the file has other contents.
    """
    rows = npy_array(data, name, "<f8", (None, 6), "nodes of float64 (n, 6)")
    lengths = np.linalg.norm(rows[:, 3:], axis=1)
    if not np.isfinite(rows).all() or (np.abs(lengths - 1.0) > 1e-9).any():
        raise DataRefused(
            f"{name} has places that are not finite, or normals that are not of length 1; build it again"
        )
    return SurfaceNodes(np.ascontiguousarray(rows[:, :3]), np.ascontiguousarray(rows[:, 3:]))
