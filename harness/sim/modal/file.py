"""The modes of a mesh: a surface that is filled, or a file's tetrahedra on their own nodes."""

import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from harness.basics.arrays import BoolArray, FloatArray, IntArray
from harness.basics.errors import WrongUse
from harness.basics.files.named_file import nearest
from harness.basics.materials import Material
from harness.basics.result import HIDDEN, Result
from harness.basics.store import Store
from harness.objects.builtin import BUILTIN
from harness.sim.modal.element_edge import finely_filled
from harness.sim.modal.modal import HEARING, curved
from harness.sim.modal.modes import dampings
from harness.sim.modal.solve import (
    Begin,
    Elasticity,
    Solution,
    check_elasticity,
    check_limit,
    ignore_stage,
    solve_mesh,
)
from harness.sim.solid.filled import filled
from harness.sim.solid.intake import surface_of
from harness.sim.solid.tetrahedra import QuadraticMesh, check_closed
from harness.sim.solid.volume_mesh import read_volume

_UNLIMITED = 1e12
"""Hz: beyond the modes of anything; where only their number is asked for, that decides the edge."""

_KEPT = "its tetrahedra were kept from an earlier filling of the same surface with the same edge"

_ON_SIDE = 1e-4
"""Of the diagonal, how near to its bounding box a node is on a side of the object."""

_SIDES = {f"{axis}-{end}": (number, end) for number, axis in enumerate("xyz") for end in ("min", "max")}


@dataclass(frozen=True, eq=False)
class FileModes(Result):
    """The modes of a mesh: frequencies and dampings, lowest first, and the model that they were solved on."""

    mesh: str  #: name of the file, or ``builtin:`` and a name.
    material: Material  #: of the whole object.
    units: str  #: unit of the file's coordinates; metres for a built-in object.
    volume_mesh: bool  #: whether the file held tetrahedra.
    frequencies_hz: FloatArray  #: ``(n,)`` of the undamped object.
    dampings_per_s: FloatArray  #: ``(n,)`` decay rates d: each mode decays as exp(-d t).
    rigid_modes: int  #: motions without deformation, which are left out.
    unknowns: int  #: degrees of freedom of the linear system.
    nodes: int  #: of the tetrahedra.
    elements: int  #: tetrahedra of ten nodes.
    bodies: int  #: separate bodies.
    held_nodes: int  #: nodes with a displacement that is fixed.
    edge_m: float | None  #: longest edge of an element aimed at; None for a volume mesh.
    mass_kg: float
    complete_below_hz: (
        float | None
    )  #: every mode below is in ``solution``; None where only a number was given.
    modes_below: int  #: modes of ``solution``.
    certified: bool  #: whether the inertia of the system proves that none is missing.
    residual: float  #: largest relative residual of a mode.
    seconds: Mapping[str, float]  #: of ``"intake"``, ``"mesh"``, ``"assemble"`` and ``"solve"``.
    notes: tuple[str, ...]  #: changes made to the mesh and warnings, a sentence each.
    solution: Solution = field(metadata=HIDDEN)  #: all modes, with their shapes.

    def summary(self) -> tuple[str, ...]:
        """State how many modes there are and whether that is certain."""
        below = "in all" if self.complete_below_hz is None else f"below {self.complete_below_hz:.6g} Hz"
        number = f"{self.modes_below} modes {below}"
        if self.certified:
            return (f"certified: exactly {number}, counted by the inertia of the system",)
        return (f"not certified: {number} were found, but the factors do not show whether any is missing",)


@dataclass(frozen=True)
class _Asked:
    """What is asked of a mesh; as in ``modes_of_file``, but for ``highest``, Hz, which is never None."""

    mesh: str
    material: Material
    units: str | None
    wall: float | None
    highest: float
    count: int | None
    edge: float | None
    envelope: float | None
    up_axis: str | None


@dataclass(frozen=True, eq=False)
class _Taken:
    """A mesh that can be solved."""

    mesh: QuadraticMesh
    sets: Mapping[str, IntArray]
    units: str
    bodies: int
    edge: float | None
    said: tuple[str, ...]


def modes_of_file(
    mesh: str | Path,
    material: Material,
    units: str | None = None,
    wall: float | None = None,
    limit: float | None = None,
    count: int | None = None,
    edge: float | None = None,
    fixed: Sequence[str] = (),
    store: Store | None = None,
    envelope: float | None = None,
    begin: Begin = ignore_stage,
    up_axis: str | None = None,
) -> FileModes:
    """The modes of an object given by a file, or of one of our own.

    Args:
        mesh: a file of a surface or of tetrahedra, or ``builtin:`` and a name.
        material: of all of it.
        units: "m", "cm", "mm" or "in"; None to take the only one that makes sense.
        wall: m, of a hollow thing of which the file has the outside; not for tetrahedra.
        limit: Hz, up to which all modes are found; None for ``HEARING``, or none if a count is given.
        count: modes wanted, the lowest; a few more may come with them.
        edge: m, longest edge of an element; None for a share of the shortest wave; not for tetrahedra.
        fixed: sides of the object ("x-min", ..., "z-max") or sets of nodes that the file names,
            held in all axes or, as "z-min:z", in those after the colon.
        store: where the tetrahedra of a surface are kept; None to fill it.
        envelope: m, how far cells may leave the surface; None for ``tetrahedralize``'s own; not for
            tetrahedra.
        begin: called as each stage begins.
        up_axis: axis of the file that points up, "x", "y" or "z"; None for the one that it declares, else z.

    Raises:
        WrongUse: options that cannot be, or that do not go together.
        MeshRefused: the file holds nothing that can be solved.
    """
    check_limit(HEARING if limit is None else limit, count)
    check_elasticity(Elasticity.uniform(material, 1), 1)
    seconds = dict.fromkeys(("intake", "mesh"), 0.0)
    highest = limit if limit is not None else HEARING if count is None else _UNLIMITED
    asked = _Asked(str(mesh), material, units, wall, highest, count, edge, envelope, up_axis)
    taken = _volume(asked, seconds)
    volume = taken is not None
    if taken is None:
        taken = _surface(asked, seconds, store)
    held = _held(taken, fixed)
    below = np.inf if limit is None and count is not None else highest
    solution = solve_mesh(taken.mesh, material, below, least=count, held=held, begin=begin)
    modes = solution.modes
    # More than the modes that were asked for may come with the last ones.
    frequencies = modes.frequencies[:count]
    return FileModes(
        mesh=asked.mesh if asked.mesh.startswith(BUILTIN) else Path(asked.mesh).name,
        material=material,
        units=taken.units,
        volume_mesh=volume,
        frequencies_hz=frequencies,
        dampings_per_s=dampings(frequencies, material),
        rigid_modes=modes.rigid,
        unknowns=solution.unknowns,
        nodes=modes.nodes,
        elements=modes.elements,
        bodies=taken.bodies,
        held_nodes=int(held.any(axis=1).sum()),
        edge_m=taken.edge,
        mass_kg=modes.mass,
        complete_below_hz=modes.limit if np.isfinite(modes.limit) else None,
        modes_below=len(modes.frequencies),
        certified=solution.certified,
        residual=modes.residual,
        seconds={**seconds, "assemble": modes.seconds["assembly"], "solve": modes.seconds["solve"]},
        notes=taken.said,
        solution=solution,
    )


def _volume(asked: _Asked, seconds: dict[str, float]) -> _Taken | None:
    """The tetrahedra of a file; None if what is asked for is a surface."""
    if asked.mesh.startswith(BUILTIN):
        return None
    path = Path(asked.mesh)
    with _timed(seconds, "intake"):
        found = read_volume(path, asked.units, asked.up_axis)
    if found is None:
        return None
    for name, value in (("--wall", asked.wall), ("--edge", asked.edge), ("--envelope", asked.envelope)):
        if value is not None:
            raise WrongUse(f"{path.name} holds tetrahedra, which are solved as they are; leave {name} out")
    return _Taken(found.mesh, found.sets, found.units, found.bodies, None, found.said)


def _surface(asked: _Asked, seconds: dict[str, float], store: Store | None) -> _Taken:
    with _timed(seconds, "intake"):
        given = surface_of(asked.mesh, asked.units, asked.wall, asked.up_axis)
        surface = given.mesh
        check_closed(surface)
    with _timed(seconds, "mesh"):
        edge = asked.edge
        if edge is None:
            inside, edge, kept = finely_filled(
                surface, asked.material, asked.highest, asked.count, store, asked.envelope
            )
        else:
            inside, kept = filled(surface, edge, store, asked.envelope)
        snapped = curved(inside, surface, inside)
    said = (*given.said, *((_KEPT,) if kept else ()))
    return _Taken(snapped, {}, given.units, inside.bodies, edge, said)


def _held(taken: _Taken, fixed: Sequence[str]) -> BoolArray:
    """``(n, 3)``: which displacement of which node is held."""
    nodes = taken.mesh.nodes
    held = np.zeros(nodes.shape, dtype=np.bool_)
    low, high = nodes.min(axis=0), nodes.max(axis=0)
    near = _ON_SIDE * float(np.linalg.norm(high - low))
    for text in fixed:
        name, _, axes = text.partition(":")
        if not set(axes or "xyz") <= set("xyz"):
            raise WrongUse(f"what is held of {name!r} is {axes!r}; say some of x, y and z, as {name}:xy")
        if name in _SIDES:
            axis, end = _SIDES[name]
            side = low if end == "min" else high
            there = np.abs(nodes[:, axis] - side[axis]) <= near
        elif name in taken.sets and len(taken.sets[name]):
            there = np.isin(np.arange(len(nodes)), taken.sets[name])
        else:
            known = [*_SIDES, *(of for of, nodes_of in taken.sets.items() if len(nodes_of))]
            raise WrongUse(f"no side or set of nodes {name!r} to hold; {nearest(name, known)}")
        held[np.ix_(there, ["xyz".index(axis) for axis in axes or "xyz"])] = True
    return held


@contextmanager
def _timed(seconds: dict[str, float], stage: str) -> Iterator[None]:
    begun = time.perf_counter()
    yield
    seconds[stage] += time.perf_counter() - begun
