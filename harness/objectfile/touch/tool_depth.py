"""What a tool would meet of an object, everywhere at once, out of the codes of its touch.

A candidate's tactile image begins with how far away the object is under each ray of the gel. With the tool's
attitude known that is a crop of one orthographic depth image along its axis, whatever the place. Here the
image is put together from tiles: at places all over the surface that face the tool the codes say how far the
object is under the rays of one gel, and what is nearest to the tool is kept.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from scipy.ndimage import maximum_filter

from harness.basics.arrays import FloatArray, IntArray, read_only
from harness.basics.errors import WrongUse
from harness.objectfile.file import ObjectFile
from harness.objectfile.runtime import Network
from harness.objectfile.self_test import open_network
from harness.objectfile.touch.graph import MOST_TILT
from harness.objectfile.touch.nodes import NodeSearch, SurfaceNodes
from harness.objectfile.touch.touch import coded, nodes_of, touch_of
from harness.objectfile.touch_entries import GelEntry
from harness.sim.gel.height_map import SEARCH_DEPTH
from harness.sim.solid.surface_samples import random_points, thin

SPREAD = 3e-3
"""m between the places at which a tile may be: what a tile shows of each is so far around it."""

_TRIED = 12.0
"""Random places for each square of ``SPREAD``, from which tiles' places are taken."""

_IN_FRONT = 0.4
"""Of the gel's thickness, by which a place may stand out of a tile's plane and be left to that tile; behind
the plane it is the thickness. Farther off, another part of the object may hide the one and not the other."""

_CHUNK = 32
"""Tiles to a run: more are no faster, and take memory."""

_WHOLE = 1e-6
"""By which a pixel may differ from a whole number of rays."""


@dataclass(frozen=True, eq=False)
class CodedDepth:
    """First surfaces along a tool, by codes."""

    network: Network  #: the graph of codes, for its ``gaps``.
    nodes: NodeSearch  #: where the codes belong.
    gel: GelEntry  #: whose rays they are.
    places: SurfaceNodes  #: of tiles.
    owners: IntArray  #: ``(n,)`` node of each tile.
    rms: float = 0.0
    """m, that the codes' maps are off by as their card states it (``CodesEntry.stated_rms``)."""

    def __call__(self, view_from_object: FloatArray, pitch: float, rows: int, columns: int) -> FloatArray:
        """``(rows, columns)`` m along the view's z axis to the first surface; inf where there is none.

        As ``harness.sim.gel.height_map.first_surface``.

        Raises:
            WrongUse: a pixel that is not a whole number of the codes' rays.
        """
        every = self._rays_a_pixel(pitch)
        depth = np.full((rows, columns), np.inf)
        chosen = self._chosen(view_from_object)
        for tops, lefts, depths in self._tiles(chosen, view_from_object, pitch, depth.shape):
            for top, left, tile in zip(
                tops.tolist(), lefts.tolist(), depths[:, ::every, ::every], strict=True
            ):
                cut = tile[max(0, -top) : max(0, rows - top), max(0, -left) : max(0, columns - left)]
                if cut.size:
                    place = depth[max(0, top) :, max(0, left) :][: cut.shape[0], : cut.shape[1]]
                    np.minimum(place, cut, out=place)
        return read_only(depth)

    def _chosen(self, view_from_object: FloatArray) -> IntArray:
        """Places that face the tool, as few as show what is around each of them."""
        rotation = view_from_object[:3, :3]
        facing = np.flatnonzero(-self.places.normals @ rotation[2] > np.cos(MOST_TILT))
        centres = self.places.points[facing] @ rotation.T
        aside = 0.5 * np.array(self.gel.sensor.window) - SPREAD
        least, most = -_IN_FRONT * self.gel.thickness_m, self.gel.thickness_m
        left, kept = np.arange(len(facing)), []
        while len(left):
            kept.append(left[0])
            off = centres[left] - centres[left[0]]
            beside = (np.abs(off[:, :2]) > aside).any(axis=1)
            left = left[beside | (off[:, 2] < least) | (off[:, 2] > most)]
        return facing[np.array(kept, dtype=np.int64)]

    def _rays_a_pixel(self, pitch: float) -> int:
        ray = self.gel.ray_pixels * self.gel.pitch_m
        every = round(pitch / ray)
        if every < 1 or abs(pitch / ray - every) > _WHOLE * every:
            raise WrongUse(
                f"a view with pixels of {pitch * 1e3:.4g} mm was asked of codes whose rays are "
                f"{ray * 1e3:.4g} mm apart; take a whole number of them, or touch.shapes = reference"
            )
        return every

    def _tiles(
        self, chosen: IntArray, view_from_object: FloatArray, pitch: float, shape: tuple[int, int]
    ) -> Iterator[tuple[IntArray, IntArray, FloatArray]]:
        """Rows and columns of tiles' first rays in the view, and ``(n, rows, columns)`` m of their rays."""
        # What stands out of a tile's plane farther than the gel is thick is left to its own tiles: codes say
        # only that it is in the way, and not how far.
        rotation = view_from_object[:3, :3]
        centres = self.places.points[chosen] @ rotation.T + view_from_object[:3, 3]
        first = -0.5 * (np.array([self.gel.columns, self.gel.rows]) * self.gel.pitch_m)
        first += 0.5 * self.gel.ray_pixels * self.gel.pitch_m
        corner = 0.5 * pitch * (1.0 - np.array(shape[::-1]))
        # A tile is moved, by half a pixel at most, to where its rays are the view's.
        at = np.rint((centres[:, :2] + first - corner) / pitch).astype(np.int64)
        centres[:, :2] = corner + at * pitch - first
        poses = np.tile(np.eye(4), (len(chosen), 1, 1))
        poses[:, :3, :3] = rotation.T
        poses[:, :3, 3] = (centres - view_from_object[:3, 3]) @ rotation
        for start in range(0, len(chosen), _CHUNK):
            part = slice(start, start + _CHUNK)
            gaps = self.network(self.nodes.posed(self.owners[chosen[part]], poses[part]))["gaps"]
            behind = gaps <= -self.gel.thickness_m
            if behind.any():  # and the rays next to those, whose heights lie between two surfaces
                behind = maximum_filter(behind, size=(1, 3, 3), mode="nearest")
            met = np.where((gaps >= np.float32(SEARCH_DEPTH)) | behind, np.inf, gaps)
            yield at[part, 1], at[part, 0], centres[part, 2, None, None] + met


def open_tool_depth(of: ObjectFile, threads: int = 1) -> CodedDepth:
    """Open the codes of an object's touch to compute first hits along a tool axis.

    Raises:
        DataRefused: the object has no codes, or a file of it is damaged.
    """
    touch, entry = touch_of(of), coded(of)
    nodes = NodeSearch(nodes_of(of, entry), entry.most_off_m)
    mesh = of.mesh
    count = max(2000, int(_TRIED * float(mesh.face_areas.sum()) / SPREAD**2))
    points, faces = random_points(mesh, count, np.random.default_rng(0))
    facing = np.ascontiguousarray(mesh.face_normals[faces])
    places = SurfaceNodes(points, facing)[thin(points, facing, SPREAD)]
    owners, gaps = nodes.nearest_to(places)
    reached = gaps <= entry.most_off_m
    network = open_network(of.read(entry.network), entry.network, threads, ("gaps",))
    return CodedDepth(network, nodes, touch.gel, places[reached], owners[reached], entry.stated_rms)
