"""The sound of an ObjectFile: the modes and their shapes, as the reference simulation gives them.

``ObjectAudio`` has the methods of ``harness.sim.modal.modes.Modes``, and makes a ``Modes`` of itself for
whatever needs the whole surface (radiation, a search's table), so that it is a level of the same
quantity. Its shapes come from the network or from the table; which is better at what price is
measured, not decided here.
"""

from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

import numpy as np

from harness.basics.arrays import AnyArray, FloatArray, read_only
from harness.basics.errors import DataRefused, WrongUse
from harness.basics.mesh import Mesh
from harness.objectfile.audio.table import HalfArray, interpolated, table_from
from harness.objectfile.entries import AudioEntry
from harness.objectfile.file import ObjectFile
from harness.objectfile.surface_file import mesh_from_ply
from harness.objectfile.surface_search import SurfaceSearch, checked_points, require_own
from harness.sim.modal.modes import Modes

if TYPE_CHECKING:
    from harness.objectfile.runtime import Network

AudioLevel = Literal["network", "table"]

CHUNK = 256
"""Points to a run: what a layer gives for as many stays in the cache of one core."""

_LIKELY = 1.0 / 16.0
"""Of the farthest a point may be from the surface: most queries are of places on it."""

_UNIT_ERROR = 1e-6


@dataclass(frozen=True, eq=False)
class NetworkShapes:
    """Shapes from ``audio.onnx``."""

    network: "Network"

    def __call__(self, points: FloatArray) -> AnyArray:
        """``(n, m, 3)`` at ``(n, 3)`` points."""
        return self.network({"points": points})["gains"]


@dataclass(frozen=True, eq=False)
class TableShapes:
    """Shapes at the nodes of a surface, linear between the three of the face nearest to a point."""

    table: HalfArray  #: ``(nodes, m, 3)``.
    scales: FloatArray  #: ``(m,)`` 1/sqrt(kg).
    search: SurfaceSearch  #: over the surface of the nodes.
    near: float  #: m, where the surface may well be from a point.

    def __call__(self, points: FloatArray) -> FloatArray:
        """``(n, m, 3)`` at ``(n, 3)`` points."""
        places, faces = self.search.nearest(points, self.near)
        nodes = self.search.mesh.faces[faces]
        return interpolated(self.table, self.scales, nodes, self.search.shares(places, faces))

    def everywhere(self) -> FloatArray:
        """``(nodes, m, 3)``: at the nodes themselves."""
        shapes: FloatArray = self.table * self.scales[:, None]
        return shapes


@dataclass(frozen=True, eq=False)
class ObjectAudio:
    """The modes of one object, and their shapes near its surface."""

    level: AudioLevel  #: where the shapes come from.
    frequencies: FloatArray  #: ``(m,)`` Hz, ascending, undamped.
    dampings: FloatArray  #: ``(m,)`` 1/s: a mode decays as ``exp(-d t)``.
    entry: AudioEntry  #: what ``object.json`` says.
    most: float  #: m, the farthest from the surface that a point may be.
    surface: SurfaceSearch  #: the object's; points are to be near to it.
    shapes: NetworkShapes | TableShapes  #: at points that were looked at.

    def at(self, points: FloatArray) -> FloatArray:
        """``(n, m, 3)`` 1/sqrt(kg): mass-normalised shapes at ``(n, 3)`` points, m in the object's frame.

        That is also the gain of a unit force along x, y and z.

        Raises:
            WrongUse: points that are not finite numbers of that shape.
            OutOfDomain: a point farther than ``most`` from the surface.
            DataRefused: a shape that is not finite.
        """
        points = checked_points(points)
        self.surface.require_within(points, self.most, f"the sound's {self.level}")
        found = np.empty((len(points), len(self.frequencies), 3))
        for first in range(0, len(points), CHUNK):
            found[first : first + CHUNK] = self.shapes(points[first : first + CHUNK])
        if not np.isfinite(found).all():
            bad = int(np.count_nonzero(~np.isfinite(found).all(axis=(1, 2))))
            raise DataRefused(
                f"the sound's {self.level} gives numbers that are not finite at {bad} of {len(points)} "
                "points; train it again, or take its other level"
            )
        return found

    def gains(self, points: FloatArray, directions: FloatArray) -> FloatArray:
        """``(n, m)`` 1/sqrt(kg): the gains at ``(n, 3)`` points along ``(n, 3)`` unit directions.

        Raises:
            WrongUse: as ``at``; or directions that are not of unit length, one for each point.
            OutOfDomain: as ``at``.
        """
        directions = checked_points(directions)
        lengths = np.linalg.norm(directions, axis=1)
        if len(directions) != len(points) or (np.abs(lengths - 1.0) > _UNIT_ERROR).any():
            raise WrongUse(
                f"{len(points)} points with {len(directions)} directions, of lengths "
                f"{lengths.min(initial=1.0):.6g} to {lengths.max(initial=1.0):.6g}; "
                "give one for each point, divided by its length"
            )
        found: FloatArray = np.einsum("nmd,nd->nm", self.at(points), directions)
        return found

    def as_modes(self, surface: Mesh | None = None) -> Modes:
        """The modes with their shapes at a surface's vertices.

        Args:
            surface: near to the object's own; None for the table's nodes or the object's mesh.

        Raises:
            OutOfDomain: as ``at``.
        """
        if surface is None and isinstance(self.shapes, TableShapes):
            nodes, shapes = self.shapes.search.mesh, self.shapes.everywhere()
        else:
            nodes = self.surface.mesh if surface is None else surface
            shapes = self.at(nodes.vertices)
        return Modes(
            frequencies=self.frequencies,
            points=nodes.vertices,
            normals=nodes.vertex_normals,
            faces=nodes.faces,
            shapes=shapes,
            limit=self.entry.complete_up_to_hz,
            mass=self.entry.mass_kg,
            rigid=self.entry.rigid_modes,
            nodes=self.entry.nodes,
            elements=self.entry.elements,
            residual=self.entry.residual,
            seconds={},
        )


def open_audio(of: ObjectFile, level: AudioLevel = "network", threads: int = 1) -> ObjectAudio:
    """Open the sound of an object at a level.

    Raises:
        DataRefused: the object has no sound, or not at that level; or a file of it is damaged.
        WrongUse: an unknown level.
    """
    entry, name = of.description.audio, of.description.name
    if entry is None:
        raise DataRefused(f"{name} has no sound; add it with `touchstone object build --only audio`")
    surface = SurfaceSearch(of.mesh)
    shapes: NetworkShapes | TableShapes
    match level:
        case "network" if entry.network is not None:
            # What runs graphs is heavy, and a table needs none of it.
            from harness.objectfile.self_test import open_network, queries_of

            asked, test = entry.network.inputs[0], entry.network.self_test
            points = np.asarray(queries_of(asked, test.inputs[0], test.rows), np.float64)
            require_own(surface, points, entry.network.file)
            shapes = NetworkShapes(open_network(of.read(entry.network), entry.network, threads))
        case "table" if entry.table is not None:
            nodes = mesh_from_ply(of.read(entry.table.surface), entry.table.surface.file)
            scales = np.array(entry.table.scales)
            table = table_from(of.read(entry.table), entry.table.file, (len(nodes.vertices), len(scales), 3))
            shapes = TableShapes(table, scales, SurfaceSearch(nodes), _LIKELY * entry.near_surface_m)
        case "network" | "table":
            raise DataRefused(f"the sound of {name} has no {level}; take the other level, or build it again")
        case _:
            raise WrongUse(f"no level {level!r} of a sound; there is network, table")
    return ObjectAudio(
        level=level,
        frequencies=read_only(np.array(entry.frequencies_hz)),
        dampings=read_only(np.array(entry.dampings_per_s)),
        entry=entry,
        most=entry.near_surface_m,
        surface=surface,
        shapes=shapes,
    )
