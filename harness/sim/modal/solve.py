"""From ten-node tetrahedra to modes: free, or held at some of their nodes."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from threadpoolctl import threadpool_limits

from harness.basics.arrays import BoolArray, FloatArray
from harness.basics.errors import WrongUse
from harness.basics.materials import Material
from harness.basics.mesh import Mesh
from harness.sim.modal.lanczos import DENSE, EigenPairs, modes_below
from harness.sim.modal.modes import Modes
from harness.sim.modal.stage_seconds import Begin, ignore_stage, timed
from harness.sim.modal.system import MassRule, ModalSystem, modal_system
from harness.sim.solid.modal_mesh import QuadraticMesh

_SHARE_OF_UNKNOWNS = 0.1
"""Above it, the modes of a mesh are those of its elements and not of the object."""

_SPARE = 6
"""Modes beyond the last one asked for: enough that a group of one frequency seldom ends beyond them."""


@dataclass(frozen=True, eq=False)
class Elasticity:
    """What each cell is made of."""

    young: FloatArray  #: ``(c,)`` Pa.
    poisson: FloatArray  #: ``(c,)``.
    density: FloatArray  #: ``(c,)`` kg/m^3.

    @classmethod
    def uniform(cls, material: Material, cells: int) -> "Elasticity":
        """The same everywhere."""
        one = np.ones(cells)
        return cls(material.young * one, material.poisson * one, material.density * one)

    @property
    def lame(self) -> FloatArray:
        """``(c, 2)`` Pa: Lame's lambda and mu."""
        young, poisson = self.young, self.poisson
        first = young * poisson / ((1.0 + poisson) * (1.0 - 2.0 * poisson))
        return np.stack([first, young / (2.0 * (1.0 + poisson))], axis=1)


@dataclass(frozen=True, eq=False)
class Solution:
    """The modes of a mesh, and how sure it is that they are all."""

    modes: Modes  #: up to their ``limit``.
    certified: bool  #: whether the inertia of ``K - w^2 M`` at the limit confirmed their number.
    unknowns: int  #: displacements that were solved for.


def solve_mesh(
    mesh: QuadraticMesh,
    material: Material | Elasticity,
    limit: float,
    most: int | None = None,
    least: int | None = None,
    held: BoolArray | None = None,
    rule: MassRule = "consistent",
    spent: Mapping[str, float] | None = None,
    begin: Begin = ignore_stage,
) -> Solution:
    """The modes of ten-node tetrahedra, on their own nodes.

    Args:
        mesh: positively oriented.
        material: of all of it, or cell by cell.
        limit: Hz, above zero; infinite where ``most`` or ``least`` says how many.
        most: modes at most, the lowest; fewer where that would part modes of one frequency.
        least: modes at least, if there are as many below the limit; a few more come with them.
        held: ``(n, 3)``, which displacement of which node is held at zero; None for a free object.
        rule: how mass is integrated.
        spent: s that earlier stages took (``stage_seconds.timed``), to be listed; more is added to
            ``"assembly"`` and ``"solve"``.
        begin: called as each stage begins.

    Raises:
        WrongUse: a limit or a count that cannot be, elasticity that is not one, or nothing left free.
        MeshRefused: the system cannot be solved.
    """
    check_limit(limit if most is None and least is None else min(limit, 1.0), most)
    check_limit(1.0, least)
    elasticity = Elasticity.uniform(material, len(mesh.cells)) if isinstance(material, Material) else material
    check_elasticity(elasticity, len(mesh.cells))
    seconds = dict(spent or {})
    with threadpool_limits(limits=1, user_api="blas"):
        begin("assembling stiffness and mass")
        with timed(seconds, "assembly"):
            system = modal_system(mesh, elasticity.lame, elasticity.density, rule)
            if held is not None and held.any():
                if held.shape != mesh.nodes.shape:
                    raise WrongUse(
                        f"what is held has shape {held.shape}; it must be {mesh.nodes.shape}, an axis of a "
                        "node each"
                    )
                if held.all():
                    raise WrongUse(
                        "every displacement is held, so that nothing can vibrate; leave some nodes free"
                    )
                system = system.held(held)
        begin(f"solving for the modes of {system.stiffness.shape[0]} unknowns")
        with timed(seconds, "solve"):
            pairs, reached = _found(system, limit, most, least)
    modes = _modes(mesh, system, pairs, reached, seconds)
    return Solution(modes, pairs.certified, system.stiffness.shape[0])


def _found(
    system: ModalSystem, limit: float, most: int | None, least: int | None
) -> tuple[EigenPairs, float]:
    """As many as asked for; ``modes_below`` gives fewer where a group of one frequency is at the end."""
    if least is None:
        return modes_below(system, limit, most)
    unknowns = system.rigid.shape[0]
    if unknowns > DENSE and least > _SHARE_OF_UNKNOWNS * unknowns:
        raise WrongUse(
            f"{least} modes are too many for a mesh of {unknowns} unknowns, of which only "
            f"{_SHARE_OF_UNKNOWNS:.0%} or so mean anything; ask for fewer, or refine the mesh"
        )
    asked = least + _SPARE
    while True:
        pairs, reached = modes_below(system, limit, asked if most is None else min(asked, most))
        if len(pairs.values) >= least or asked >= (most or np.inf) or reached >= limit:
            return pairs, reached
        asked += 2 * _SPARE


def _modes(
    mesh: QuadraticMesh, system: ModalSystem, pairs: EigenPairs, limit: float, seconds: Mapping[str, float]
) -> Modes:
    used, triangles = np.unique(mesh.triangles, return_inverse=True)
    outer = Mesh(mesh.nodes[used], triangles.reshape(-1, 3))
    vectors = system.whole(pairs.vectors).reshape(len(mesh.nodes), 3, -1)[used]
    return Modes(
        # What hangs by an edge only turns without stiffness, but for rounding.
        frequencies=np.sqrt(np.maximum(pairs.values, 0.0)) / (2.0 * np.pi),
        points=outer.vertices,
        normals=outer.vertex_normals,
        faces=outer.faces,
        shapes=np.ascontiguousarray(vectors.transpose(0, 2, 1)),
        limit=limit,
        mass=system.total,
        rigid=system.rigid.shape[1],
        nodes=len(mesh.nodes),
        elements=len(mesh.cells),
        residual=pairs.residual,
        seconds=dict(seconds),
    )


def check_limit(limit: float, most: int | None) -> None:
    """Refuse a limit or a number of modes that cannot be.

    Raises:
        WrongUse: the limit is not finite and above 0, or the number is below 1.
    """
    if not (np.isfinite(limit) and limit > 0.0):
        raise WrongUse(f"modes up to {limit:g} Hz cannot be found; say a frequency above 0")
    if most is not None and most < 1:
        raise WrongUse(f"{most} modes are none; say 1 or more, or leave the number out")


def check_elasticity(elasticity: Elasticity, cells: int) -> None:
    """Refuse elasticity that no solid has.

    Raises:
        WrongUse: not one number for each of ``cells``, or moduli outside what is stable.
    """
    for name, field in vars(elasticity).items():
        if field.shape != (cells,) or not np.isfinite(field).all():
            raise WrongUse(
                f"{name} of shape {field.shape} must be one finite number for each of {cells} cells"
            )
    if elasticity.young.min() <= 0.0 or elasticity.density.min() <= 0.0:
        raise WrongUse("Young's modulus and density must be above 0 in every cell")
    if elasticity.poisson.max() >= 0.5 or elasticity.poisson.min() <= -1.0:
        worst = elasticity.poisson[np.argmax(np.abs(elasticity.poisson))]
        raise WrongUse(
            f"a Poisson's ratio of {worst:g} is outside -1 to 0.5; an incompressible solid is 0.49"
        )
