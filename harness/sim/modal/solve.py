"""Compute the modes of ten-node tetrahedra, free or clamped at some nodes.

Grimes, Lewis and Simon, A Shifted Block Lanczos Algorithm for Solving Sparse Symmetric
Generalized Eigenproblems, SIAM J. Matrix Analysis 15(1), 1994, with one shift below the
spectrum, every block kept orthogonal to all earlier ones and to the rigid motions, and the
number of modes checked against the inertia of ``K - w^2 M`` at the limit.
"""

import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass

import numpy as np
from scipy.linalg import eigh, solve_triangular
from threadpoolctl import threadpool_limits

from harness.basics.arrays import BoolArray, FloatArray
from harness.basics.errors import MeshRefused, WrongUse
from harness.basics.materials import Material
from harness.basics.mesh import Mesh
from harness.sim.factor.factorisation import Factor, factorised, inertia
from harness.sim.modal.modes import Modes
from harness.sim.modal.system import MassRule, ModalSystem, modal_system
from harness.sim.solid.tetrahedra import QuadraticMesh

_BLOCK = 8
_PER_MODE = 6
"""Vectors of the basis for each mode wanted: mostly four are enough."""

_TOLERANCE = 1e-9
"""Largest residual of a Ritz pair relative to its value."""

_BEYOND = 1e-2
"""The same for the first mode beyond the limit, which only has to be known to be beyond."""

_GROWTH = 1e6
"""Largest growth of the pivots at which their signs count as those of the eigenvalues: the factorized
matrix is then within about 1e-10 of the given matrix."""

DENSE = 600
"""Unknowns up to which every mode of the system is computed at once."""

_SAME = 1e-4
"""Relative distance of squared frequencies below which two modes are taken as a pair."""


@dataclass(frozen=True, eq=False)
class EigenPairs:
    """The modes of a system."""

    values: FloatArray  #: ``(m,)`` (rad/s)^2, ascending.
    vectors: FloatArray  #: ``(u, m)`` 1/sqrt(kg), mass-orthonormal, of the system's unknowns.
    residual: float  #: the worst ``|K x - w^2 M x| / (w^2 |M x|)``.
    certified: bool  #: whether an inertia count confirmed that none is missing.


@dataclass(frozen=True, eq=False)
class _Block:
    """Mass-orthonormal columns."""

    unit: FloatArray  #: ``(u, b)``.
    weighted: FloatArray  #: the mass matrix times them.
    combination: FloatArray  #: ``(b, b)``, by which they give the block that they were made of.


class _Lanczos:
    """One run from one random block."""

    def __init__(self, system: ModalSystem, factor: Factor, seed: int, block: int = _BLOCK) -> None:
        self.system = system
        self.factor = factor
        size = system.rigid.shape[0]
        self.block = min(block, size - system.rigid.shape[1])
        self.most = size - system.rigid.shape[1]
        self.basis = np.empty((size, 0), order="F")
        self.used = 0
        self.projected = np.zeros((0, 0))
        self.random = np.random.default_rng(seed)

    def run(self, ceiling: float, most: int | None) -> tuple[FloatArray, FloatArray, float]:
        """Values and vectors of every mode up to ``ceiling`` (rad/s)^2, or the lowest ``most``.

        Also returns the ceiling below which these are all.
        """
        self._reserve(24 * self.block if most is None else _PER_MODE * most)
        start = self._cleared(self.random.standard_normal((self.basis.shape[0], self.block)))
        current = self._orthonormal(start, self.system.weighted(start))
        check_at = 6 * self.block
        while True:
            self._append(current.unit)
            last = self.used + self.block > self.most
            step, coupling = self._step(current)
            if self.used >= check_at or last:
                found = self._converged(coupling, ceiling, most, last)
                if found is not None:
                    return found
                check_at = int(1.05 * self.used) + 1
            current = step

    def _append(self, current: FloatArray) -> None:
        end = self.used + current.shape[1]
        if end > self.basis.shape[1]:
            self._reserve(2 * self.basis.shape[1])
        self.basis[:, self.used : end] = current
        self.used = end

    def _reserve(self, room: int) -> None:
        """Room for so many vectors; memory is taken only as it is written to."""
        room = min(max(room, 2 * self.block), self.most + self.block)
        basis, projected = np.empty((self.basis.shape[0], room), order="F"), np.zeros((room, room))
        basis[:, : self.used] = self.basis[:, : self.used]
        projected[: self.used, : self.used] = self.projected[: self.used, : self.used]
        self.basis, self.projected = basis, projected

    def _step(self, current: "_Block") -> tuple["_Block", FloatArray]:
        """The next block, and ``(b, b)`` what couples it to this one.

        But for rounding an image holds of the basis only the last two blocks; these are taken out
        first, and what rounding left of all of them once its size is known.
        """
        image = self.factor.solve(current.weighted)
        wide = image.shape[1]
        recent = max(0, self.used - wide - self.block)
        image, known = self._without(image, self.system.weighted(image), recent)
        unit = self._orthonormal(image, self.system.weighted(image))
        image, missed = self._without(unit.unit, unit.weighted)
        again = self._orthonormal(image, self.system.weighted(image))
        coupled = missed @ unit.combination
        coupled[recent:] += known
        span = slice(self.used - wide, self.used)
        self.projected[: self.used, span] = coupled
        self.projected[span, : self.used] = self.projected[: self.used, span].T
        return again, again.combination @ unit.combination

    def _without(
        self, block: FloatArray, weighted: FloatArray, first: int = 0
    ) -> tuple[FloatArray, FloatArray]:
        """Remove rigid motion, and the basis from ``first`` on, from a block.

        Returns:
            That, and ``(used - first, b)`` what was of the basis.
        """
        known = self.basis[:, first : self.used]
        rigid = self.system.rigid.T @ weighted
        share = known.T @ weighted
        return block - known @ share - self.system.rigid @ rigid, share

    def _cleared(self, block: FloatArray) -> FloatArray:
        for _ in range(2):
            block, _ = self._without(block, self.system.weighted(block))
        return block

    def _orthonormal(self, block: FloatArray, weighted: FloatArray) -> "_Block":
        """Mass-orthonormal columns that span a block.

        Columns that the others already span are replaced by random ones.
        """
        gram = block.T @ weighted
        scale = np.sqrt(np.maximum(np.diag(gram), 0.0))
        safe = np.where(scale > 0.0, scale, 1.0)
        values, turned = np.linalg.eigh(gram / np.outer(safe, safe))
        if values[0] > 1e-12:
            upper = np.linalg.cholesky(gram / np.outer(safe, safe)).T * safe
            unit, heavy = (solve_triangular(upper, part.T, trans="T").T for part in (block, weighted))
            return _Block(unit, heavy, upper)
        return self._refilled(block / safe, values, turned, safe)

    def _refilled(
        self, block: FloatArray, values: FloatArray, turned: FloatArray, scale: FloatArray
    ) -> "_Block":
        """As ``_orthonormal`` where the columns depend on each other."""
        kept = values > 1e-12
        roots = np.sqrt(np.where(kept, values, 1.0))
        unit = block @ turned / roots
        unit[:, ~kept] = self._cleared(self.random.standard_normal((len(block), int((~kept).sum()))))
        for _ in range(2):
            fresh, old = unit[:, ~kept], unit[:, kept]
            fresh = fresh - old @ (old.T @ self.system.weighted(fresh))
            upper = np.linalg.cholesky(fresh.T @ self.system.weighted(fresh)).T
            unit[:, ~kept] = solve_triangular(upper, fresh.T, trans="T").T
        combination = np.where(kept, roots, 0.0)[:, None] * turned.T * scale
        return _Block(unit, self.system.weighted(unit), combination)

    def _converged(
        self, coupling: FloatArray, ceiling: float, most: int | None, last: bool
    ) -> tuple[FloatArray, FloatArray, float] | None:
        """The wanted modes if all are known, and the first beyond them well enough."""
        inverse, ritz = eigh(self.projected[: self.used, : self.used])
        inverse, ritz = inverse[::-1], ritz[:, ::-1]
        error = np.linalg.norm(coupling @ ritz[-self.block :], axis=0)
        number = int((inverse >= 1.0 / (ceiling + self.system.shift)).sum())
        if most is not None and number > most:
            number = _whole_group(inverse, most)
            between = 0.5 * (inverse[number - 1] + inverse[number])
            ceiling = 1.0 / between - self.system.shift
        if not last:
            if number == self.used or (error[:number] > _TOLERANCE * inverse[:number]).any():
                return None
            beyond = inverse[number] + error[number] >= 1.0 / (ceiling + self.system.shift)
            if beyond or error[number] > _BEYOND * inverse[number]:
                return None
        vectors = self.basis[:, : self.used] @ ritz[:, :number]
        return 1.0 / inverse[:number] - self.system.shift, vectors, ceiling


CPU = "cpu."
"""Before a stage's name where its seconds are those of the processor, all threads together."""

Begin = Callable[[str], None]
"""Called with the name of a stage, in words, as it begins."""


def ignore_stage(_stage: str) -> None:
    """Report no stage."""


@contextmanager
def timed(seconds: dict[str, float], stage: str) -> Iterator[None]:
    """Add what happens meanwhile to the seconds of a stage, under its name and under ``CPU`` and its name."""
    begun, worked = time.perf_counter(), time.process_time()
    yield
    seconds[stage] = seconds.get(stage, 0.0) + time.perf_counter() - begun
    seconds[CPU + stage] = seconds.get(CPU + stage, 0.0) + time.process_time() - worked


def wall(seconds: Mapping[str, float]) -> dict[str, float]:
    """On the clock, by stage."""
    return {stage: took for stage, took in seconds.items() if not stage.startswith(CPU)}


def cpu(seconds: Mapping[str, float]) -> dict[str, float]:
    """Return the CPU seconds by stage."""
    return {stage.removeprefix(CPU): took for stage, took in seconds.items() if stage.startswith(CPU)}


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
        spent: s that earlier stages took (``timed``), to be listed; more is added to
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


def modes_below(system: ModalSystem, limit: float, most: int | None = None) -> tuple[EigenPairs, float]:
    """Every elastic mode up to ``limit`` Hz, or the lowest ``most`` of them.

    Args:
        system: free or held.
        limit: Hz; infinite for as many as ``most`` says.
        most: modes at most; fewer where that would part modes of one frequency.

    Returns:
        The modes, and up to which frequency in Hz they are all; infinite where the system has no more.

    Raises:
        MeshRefused: the stiffness cannot be factorised, or modes were missed twice.
    """
    if system.rigid.shape[0] <= DENSE:
        return _dense(system, (2 * np.pi * limit) ** 2, most)
    factor = factorised(system.shifted(system.shift), system.plan)
    lowest = float(factor.pivots.values.min())
    if lowest <= 0.0:
        raise MeshRefused(
            f"the stiffness of the object has a pivot of {lowest:.2g}, which must be above 0; its "
            "volume mesh has an inverted element: mesh the object again"
        )
    for seed, block in ((1, _BLOCK), (2, 2 * _BLOCK)):
        values, vectors, ceiling = _Lanczos(system, factor, seed, block).run((2 * np.pi * limit) ** 2, most)
        pivots = inertia(system.shifted(-ceiling), system.plan)
        expected = None
        if pivots is not None and pivots.growth <= _GROWTH:
            expected = pivots.negative - int(system.rigid.shape[1])
        if expected is None or len(values) >= expected:
            pairs = EigenPairs(values, vectors, _residual(system, values, vectors), len(values) == expected)
            return pairs, float(np.sqrt(ceiling) / (2.0 * np.pi))
    raise MeshRefused(
        f"{len(values)} modes were found below {limit:g} Hz where the inertia of the system says "
        f"{expected}; the volume mesh is too poor to be trusted: mesh it with another element size"
    )


def _dense(system: ModalSystem, ceiling: float, most: int | None) -> tuple[EigenPairs, float]:
    """As ``modes_below`` for a small system."""
    values, vectors = eigh(system.stiffness.toarray(), system.inertia().toarray())
    rigid = system.rigid.shape[1]
    values, vectors = values[rigid:], vectors[:, rigid:]
    number = int(np.count_nonzero(values <= ceiling))
    if most is not None and number > most:
        number = _whole_group(1.0 / values, most)
        ceiling = 0.5 * float(values[number - 1] + values[number])
    kept, shapes = values[:number], vectors[:, :number]
    return EigenPairs(kept, shapes, _residual(system, kept, shapes), True), float(
        np.sqrt(ceiling) / (2 * np.pi)
    )


def _residual(system: ModalSystem, values: FloatArray, vectors: FloatArray) -> float:
    if len(values) == 0:
        return 0.0
    inertia = system.weighted(vectors) * values
    gap = np.linalg.norm(system.stiffness @ vectors - inertia, axis=0)
    return float((gap / np.linalg.norm(inertia, axis=0)).max())


def _whole_group(descending: FloatArray, most: int) -> int:
    """At most ``most``, and fewer where that would part modes of one frequency."""
    for number in range(most, 0, -1):
        if descending[number] < (1.0 - _SAME) * descending[number - 1]:
            return number
    return most
