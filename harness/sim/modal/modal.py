"""From a surface and a material to the modes of the object.

Nodes moved from the flat faces of tetrahedra onto the surface that they stand for.

A flat face cuts the corner of a curved surface, and that error, not the element's, decides the
frequencies of round objects.
"""

from collections.abc import Mapping
from typing import Any

import numpy as np
from threadpoolctl import threadpool_limits

from harness.basics.arrays import AnyArray, FloatArray, IntArray
from harness.basics.errors import MeshRefused
from harness.basics.materials import Material
from harness.basics.mesh import Mesh
from harness.basics.store import Store, digest
from harness.sim.modal.modes import Modes
from harness.sim.modal.solve import CPU, Begin, Elasticity, check_limit, ignore_stage, solve_mesh, timed
from harness.sim.solid.filled import FillingSeconds, filled
from harness.sim.solid.modal_kernels import MASS_POINTS, MASS_WEIGHTS, determinants, shape_slopes
from harness.sim.solid.tetrahedra import (
    QuadraticMesh,
    Tetrahedra,
    least_determinant,
    middles_of,
    quadratic_mesh,
)
from harness.sim.solid.walls import enclosed_volume, nearest_on_surface, thin_wall

VERSION = 4
"""Raised with every change of what is computed here, so that stored modes are dropped."""

HEARING = 20e3
"""Hz: the limit where nobody asks for another."""

ELEMENT_SHARE = 0.35
"""Of the shortest wave of the object below the limit, the default edge of an element."""

_VOLUME_GATE = 0.03
"""Relative: frequencies of bending follow the wall, and so the volume."""

_REACH_OF_EDGE = 0.25
"""Of the shortest edge at a node: further away the surface is another part of it."""

_LEAST_COSINE = 0.5

_LEAST_SHARE = 0.2
"""Of a cell's straight volume that has to be left everywhere in it, or its nodes go back."""

_TRIALS = 6


def modes_of(
    mesh: Mesh,
    material: Material,
    limit: float = HEARING,
    edge: float | None = None,
    most: int | None = None,
    store: Store | None = None,
) -> Modes:
    """The modes of an object given by its closed surface.

    Args:
        mesh: closed, outward, in metres.
        material: of all of it.
        limit: Hz, above zero.
        edge: m, longest edge of an element; None for ``default_edge``.
        most: modes at most, the lowest; None for all up to the limit.
        store: where results are kept; None to compute.

    Raises:
        WrongUse: a limit, an edge or a count that cannot be.
        MeshRefused: a surface that cannot be filled, or a volume mesh that cannot be solved.
    """
    return solved_once(mesh, material, limit, edge, most, store)[0]


def solved_once(
    mesh: Mesh,
    material: Material,
    limit: float,
    edge: float | None,
    most: int | None,
    store: Store | None,
    begin: Begin = ignore_stage,
) -> tuple[Modes, bool]:
    """Return ``modes_of``, and whether the modes were in the store; their seconds are then of that time."""
    edge = default_edge(mesh, material, limit, most) if edge is None else edge
    # Damping moves no undamped mode: a material of other alpha and beta has the same ones.
    elastic = [material.density, material.young, material.poisson]
    key = digest(["modes", VERSION, mesh.vertices, mesh.faces, elastic, float(limit), float(edge), most])
    kept = store.get(key) if store is not None else None
    if isinstance(kept, Mapping):
        return from_arrays(kept), True
    took = FillingSeconds()
    begin("filling the mesh with tetrahedra")
    inside, _ = filled(mesh, edge, store, spent=took)
    spent = {"tetrahedra": took.wall, f"{CPU}tetrahedra": took.cpu}
    solved = solve_modes(inside, material, limit, mesh, most=most, spent=spent, begin=begin)
    if store is not None:
        store.put(key, to_arrays(solved))
    return solved, False


def default_edge(
    mesh: Mesh, material: Material, limit: float, most: int | None = None, share: float = ELEMENT_SHARE
) -> float:
    """Metres: an element's edge as a share of the shortest wave in the object below the limit.

    The wave is that of bending in a wall of the object's thickness or, if shorter, of shear.
    With ``most`` modes the limit is no higher than where a plate of that area and wall has as
    many (its modal density is ``sqrt(3) area / (wall speed)``; Cremer, Heckl and Petersson,
    Structure-Borne Sound, 3rd edition, 2005).
    """
    check_limit(limit, most)
    wall = thin_wall(mesh, 0.5)
    if most is not None:
        middle = 0.5 * float(mesh.face_areas.sum())
        limit = min(limit, 1.5 * most * wall * _plate_speed(material) / (np.sqrt(3.0) * middle))
    bending = bending_wave(material, wall, limit)
    shear = np.sqrt(0.5 * material.young / ((1.0 + material.poisson) * material.density)) / limit
    return float(min(share * min(bending, shear), 0.2 * mesh.diagonal))


def bending_wave(material: Material, wall: float, frequency: float) -> float:
    """Metres from crest to crest of a wave that bends a thin wall at a frequency in Hz.

    Args:
        material: of the wall.
        wall: m, its thickness; small against the wave.
        frequency: above zero.
    """
    return float(np.sqrt(np.pi * wall * _plate_speed(material) / (np.sqrt(3.0) * frequency)))


def _plate_speed(material: Material) -> float:
    """Metres in a second, of a wave that stretches a thin wall."""
    return float(np.sqrt(material.young / (material.density * (1.0 - material.poisson**2))))


def solve_modes(
    tetrahedra: Tetrahedra,
    material: Material | Elasticity,
    limit: float = HEARING,
    surface: Mesh | None = None,
    most: int | None = None,
    spent: Mapping[str, float] | None = None,
    undeformed: Tetrahedra | None = None,
    begin: Begin = ignore_stage,
) -> Modes:
    """The modes of a volume mesh.

    Args:
        tetrahedra: of the object.
        material: of all of it, or cell by cell.
        limit: Hz, above zero.
        surface: onto which the nodes of the volume mesh's surface are moved; None for as it is.
        most: modes at most, the lowest; None for all up to the limit.
        spent: s that earlier stages took (``solve.timed``), to be listed.
        undeformed: the same cells where ``surface`` belongs to them, if ``tetrahedra`` were moved
            away from it since; None if they were not.
        begin: called as each stage begins.

    Raises:
        WrongUse: a limit or a count that cannot be, or elasticity that is not one.
        MeshRefused: the system cannot be solved.
    """
    cells = len(tetrahedra.cells)
    elasticity = Elasticity.uniform(material, cells) if isinstance(material, Material) else material
    with threadpool_limits(limits=1, user_api="blas"):
        seconds = {"tetrahedra": 0.0, **(spent or {})}
        with timed(seconds, "assembly"):
            mesh = curved(tetrahedra, surface, undeformed or tetrahedra)
        return solve_mesh(mesh, elasticity, limit, most, spent=seconds, begin=begin).modes


def curved(tetrahedra: Tetrahedra, surface: Mesh | None, undeformed: Tetrahedra) -> QuadraticMesh:
    """Ten-node cells on ``surface``, moved on to where the tetrahedra are now.

    Args:
        tetrahedra: as they are to be solved.
        surface: as in ``solve_modes``.
        undeformed: the cells where ``surface`` belongs to them; ``tetrahedra`` if they never moved.

    Raises:
        MeshRefused: unused nodes, inverted elements, or another volume than the surface encloses.
    """
    unused = len(undeformed.nodes) - len(np.unique(undeformed.cells))
    inverted = int(np.count_nonzero(undeformed.volumes <= 0.0))
    if unused or inverted:
        raise MeshRefused(
            f"the volume mesh has {unused} nodes that no element holds and {inverted} inverted elements; "
            "make it with sim.solid.tetrahedra.tetrahedra, which leaves out the ones and turns the others"
        )
    mesh = quadratic_mesh(undeformed.nodes, undeformed.cells)
    if surface is not None:
        mesh = snapped(mesh, surface)
        got, wanted = held_volume(mesh), enclosed_volume(surface)
        if not abs(got - wanted) <= _VOLUME_GATE * wanted:
            raise MeshRefused(
                f"the elements hold {got * 1e6:.4g} cm^3 where the surface encloses {wanted * 1e6:.4g}, more "
                f"than {_VOLUME_GATE:.0%} apart; repair the surface, or say smaller elements (sim modes "
                "--edge, run --level sound.edge)"
            )
    if undeformed is tetrahedra:
        return mesh
    way = np.zeros_like(mesh.nodes)
    way[: len(tetrahedra.nodes)] = tetrahedra.nodes - undeformed.nodes
    way[len(tetrahedra.nodes) :] = middles_of(way, mesh.cells, len(way))[len(tetrahedra.nodes) :]
    moved = _straighten(QuadraticMesh(mesh.nodes + way, mesh.cells, mesh.faces))
    if least_determinant(moved).min() <= 0.0:
        raise MeshRefused("the deformation turns an element inside out; deform the object less")
    return moved


def held_volume(mesh: QuadraticMesh) -> float:
    """m^3 that curved cells hold, as their mass is integrated."""
    slopes = shape_slopes(MASS_POINTS)
    return float((determinants(mesh.nodes, mesh.cells, slopes) @ MASS_WEIGHTS).sum() / 6.0)


def to_arrays(modes: Modes) -> dict[str, AnyArray]:
    """What a store can keep."""
    numbers = ("limit", "mass", "rigid", "nodes", "elements", "residual")
    arrays = ("frequencies", "points", "normals", "faces", "shapes")
    kept: dict[str, Any] = {name: vars(modes)[name] for name in arrays}
    kept |= {name: np.array(vars(modes)[name]) for name in numbers}
    return kept | {f"seconds.{stage}": np.array(took) for stage, took in modes.seconds.items()}


def from_arrays(kept: Mapping[str, AnyArray]) -> Modes:
    """What ``to_arrays`` made, again."""
    seconds = {
        name.removeprefix("seconds."): float(took)
        for name, took in kept.items()
        if name.startswith("seconds.")
    }
    return Modes(
        frequencies=kept["frequencies"],
        points=kept["points"],
        normals=kept["normals"],
        faces=kept["faces"],
        shapes=kept["shapes"],
        limit=float(kept["limit"]),
        mass=float(kept["mass"]),
        rigid=int(kept["rigid"]),
        nodes=int(kept["nodes"]),
        elements=int(kept["elements"]),
        residual=float(kept["residual"]),
        seconds=seconds,
    )


def snapped(mesh: QuadraticMesh, surface: Mesh) -> QuadraticMesh:
    """The same cells with the nodes of their surface on ``surface`` where that is safe.

    A node stays where no face of ``surface`` near it looks its way. Where a cell would be bent
    too far, its nodes go half as far, then a quarter, and at last nowhere.
    """
    corners = int(mesh.cells[:, :4].max()) + 1
    onto = _moved(mesh, surface, np.unique(mesh.faces[:, :3]))
    share = np.ones(len(mesh.nodes))
    straight = least_determinant(mesh)
    for trial in range(_TRIALS):
        base = mesh.nodes + share[:, None] * onto
        bent = _with_middles(mesh, base, corners)
        middles = np.unique(mesh.faces[:, 3:])
        aside = _moved(bent, surface, middles)
        nodes = bent.nodes + share[:, None] * aside
        trialled = QuadraticMesh(nodes, mesh.cells, mesh.faces)
        bad = least_determinant(trialled) < _LEAST_SHARE * straight
        if not bad.any():
            return trialled
        share[np.unique(mesh.cells[bad])] *= 0.5 if trial < _TRIALS - 2 else 0.0
    return mesh


def _straighten(mesh: QuadraticMesh) -> QuadraticMesh:
    """Straighten inverted cells: corners stay, middle nodes move to the midpoints of their edges."""
    corners = int(mesh.cells[:, :4].max()) + 1
    straight = _with_middles(mesh, mesh.nodes, corners)
    loose = np.zeros(len(mesh.nodes), dtype=np.bool_)
    # A node that goes back bends its other cells, which may have to follow.
    while True:
        nodes = np.where(loose[:, None], straight.nodes, mesh.nodes)
        trialled = QuadraticMesh(nodes, mesh.cells, mesh.faces)
        bad = least_determinant(trialled) <= 0.0
        bad &= ~loose[mesh.cells[:, 4:]].all(axis=1)
        if not bad.any():
            return trialled
        loose[mesh.cells[bad, 4:]] = True


def _with_middles(mesh: QuadraticMesh, nodes: FloatArray, corners: int) -> QuadraticMesh:
    moved = nodes.copy()
    moved[corners:] = middles_of(nodes, mesh.cells, len(nodes))[corners:]
    return QuadraticMesh(moved, mesh.cells, mesh.faces)


def _moved(mesh: QuadraticMesh, surface: Mesh, chosen: IntArray) -> FloatArray:
    """``(n, 3)`` m from each chosen node to the surface; zero for all others."""
    normals = Mesh(mesh.nodes, mesh.triangles).vertex_normals[chosen]
    shortest = np.full(len(mesh.nodes), np.inf)
    for first, middle in ((0, 3), (1, 4), (2, 5)):
        a, b = mesh.faces[:, first], mesh.faces[:, (first + 1) % 3]
        length = np.linalg.norm(mesh.nodes[a] - mesh.nodes[b], axis=1)
        for node in (a, b, mesh.faces[:, middle]):
            np.minimum.at(shortest, node, length)
    reach = _REACH_OF_EDGE * shortest[chosen]
    places, _ = nearest_on_surface(surface, mesh.nodes[chosen], normals, reach, _LEAST_COSINE)
    way = np.zeros_like(mesh.nodes)
    way[chosen] = places - mesh.nodes[chosen]
    return way
