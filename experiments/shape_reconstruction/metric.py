"""How far an answer is from the true surface: Chamfer-L1, its two halves, and what else is published.

The main number goes from samples to surfaces, each sample to the nearest place of the other's triangles, and
is zero for the truth itself. The published form goes from points to points and is not: two samplings of one
surface are a millimetre or two apart. ``band_held`` tests the stated deviation.
"""

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from experiments.shape_reconstruction.fits import ShapeEstimate
from harness.basics.arrays import FloatArray, IntArray
from harness.basics.errors import MeshRefused, OutOfDomain
from harness.basics.faces.nearest_kernels import shares_on_faces
from harness.basics.faces.nearest_surface import NearestSurface
from harness.basics.mesh import Mesh
from harness.sim.solid.surface_samples import random_points

SAMPLES = 20_000
"""Places on each surface: the mean of distances of 2 mm is then known to some 0.02 mm."""

PUBLISHED_POINTS = 10_000
"""On each side of the published form, as the successor of ObjectFolder 2.0 has it; the paper states none."""

F_SCORE_WITHIN = 5.0e-3
"""M: a place counts as found that is no farther from the other surface."""

_FAR = 0.95


@dataclass(frozen=True)
class ShapeError:
    """How far an answer and the truth are apart."""

    chamfer: float
    """m, half the sum of ``accuracy`` and ``completeness`` (Chamfer-L1, distances not squared)."""
    accuracy: float  #: m, mean distance from the answer to the truth.
    completeness: float  #: m, mean distance from the truth to the answer.
    f_score: float  #: 0 to 1, harmonic mean of the shares that are within ``F_SCORE_WITHIN``.
    hausdorff95: float  #: m, the greater of the two distances that 95 % of each surface are within.

    @classmethod
    def of(cls, towards_truth: FloatArray, towards_answer: FloatArray) -> "ShapeError":
        """Summarise distances from samples of the answer to the truth, and back, m."""
        accuracy, completeness = float(towards_truth.mean()), float(towards_answer.mean())
        precise, found = (float((d <= F_SCORE_WITHIN).mean()) for d in (towards_truth, towards_answer))
        return cls(
            chamfer=0.5 * (accuracy + completeness),
            accuracy=accuracy,
            completeness=completeness,
            f_score=2.0 * precise * found / (precise + found) if precise + found > 0.0 else 0.0,
            hausdorff95=float(max(np.quantile(d, _FAR) for d in (towards_truth, towards_answer))),
        )


@dataclass(frozen=True, eq=False)
class SurfacesApart:
    """Samples of an estimate and of the truth, even by area, each with its nearest point on the other."""

    answer: FloatArray  #: ``(n, 3)`` m, samples of the answer.
    answer_faces: IntArray  #: ``(n,)`` its faces that they are on.
    towards_truth: FloatArray  #: ``(n,)`` m from each of them to the truth.
    nearest: FloatArray  #: ``(n, 3)`` m, the answer's places nearest to samples of the truth.
    nearest_faces: IntArray  #: ``(n,)`` the answer's faces that those are on.
    towards_answer: FloatArray  #: ``(n,)`` m from each of the truth's samples to its place.

    @property
    def error(self) -> ShapeError:
        """How far apart they are."""
        return ShapeError.of(self.towards_truth, self.towards_answer)


@dataclass(frozen=True)
class BandHeld:
    """Shares, 0 to 1 and even by area, that are no farther off than the estimate's 90 % band says."""

    truth: float  #: of the true surface, by the band at the estimate's place nearest to each part of it.
    answer: float  #: of the estimate's own surface, by the band there.


def surfaces_apart(answer: Mesh, truth: Mesh, samples: int = SAMPLES, seed: int = 0) -> SurfacesApart:
    """An answer with a surface, against the truth, sample by sample.

    Args:
        answer: m, in the truth's frame.
        truth: m, its whole surface, the inner walls of a vessel too.
        samples: on each surface.
        seed: of the samples; both surfaces are sampled alike, so that swapping them changes nothing.

    Raises:
        MeshRefused: a surface without area or with vertices that are not finite.
    """
    for mesh, whose in ((answer, "answer"), (truth, "truth")):
        if len(mesh.faces) == 0 or not np.isfinite(mesh.vertices).all():
            bad = np.count_nonzero(~np.isfinite(mesh.vertices).all(axis=1))
            raise MeshRefused(
                f"the {whose} has {len(mesh.faces)} faces and {bad} vertices that are not finite; distances "
                "need one face or more and finite vertices"
            )
    points, faces = random_points(answer, samples, np.random.default_rng(seed))
    true = random_points(truth, samples, np.random.default_rng(seed))[0]
    nearest, nearest_faces = NearestSurface(answer).places(true)
    return SurfacesApart(
        answer=points,
        answer_faces=faces,
        towards_truth=NearestSurface(truth).distances(points),
        nearest=nearest,
        nearest_faces=nearest_faces,
        towards_answer=np.asarray(np.linalg.norm(nearest - true, axis=1)),
    )


def shape_error(answer: Mesh, truth: Mesh, samples: int = SAMPLES, seed: int = 0) -> ShapeError:
    """Measure how far an answer is from the truth; as ``surfaces_apart``."""
    return surfaces_apart(answer, truth, samples, seed).error


def published_chamfer(answer: Mesh, truth: Mesh, count: int = PUBLISHED_POINTS, seed: int = 0) -> float:
    """Measure the Chamfer-L1 distance from points to points, each surface sampled on its own, m."""
    streams = np.random.SeedSequence(seed).spawn(2)
    first, second = (
        random_points(mesh, count, np.random.default_rng(stream))[0]
        for mesh, stream in zip((answer, truth), streams, strict=True)
    )
    return published_points_chamfer(first, second)


def published_points_chamfer(first: FloatArray, second: FloatArray) -> float:
    """M: half the sum of the two mean distances between ``(n, 3)`` and ``(m, 3)`` points.

    Raises:
        OutOfDomain: no point on one side, or one that is not finite.
    """
    for points in (first, second):
        if points.ndim != 2 or points.shape[1] != 3 or len(points) == 0 or not np.isfinite(points).all():
            raise OutOfDomain(
                f"points of shape {points.shape} are no answer; give (n, 3) finite numbers in metres, "
                "one row or more"
            )
    there, back = cKDTree(second).query(first)[0], cKDTree(first).query(second)[0]
    return 0.5 * float(np.mean(there) + np.mean(back))


BAND90 = 1.645
"""Standard deviations on each side that hold 90 % of a normal density."""


def band_held(estimate: ShapeEstimate, apart: SurfacesApart) -> BandHeld:
    """How much of both surfaces the band holds; nine tenths where the deviations are honest.

    Args:
        estimate: states a deviation of each vertex; between them it is interpolated.
        apart: the same estimate's mesh against the truth.
    """
    at_truth = _deviation(estimate, apart.nearest, apart.nearest_faces)
    at_answer = _deviation(estimate, apart.answer, apart.answer_faces)
    return BandHeld(
        truth=float((apart.towards_answer <= BAND90 * at_truth).mean()),
        answer=float((apart.towards_truth <= BAND90 * at_answer).mean()),
    )


def _deviation(estimate: ShapeEstimate, places: FloatArray, faces: IntArray) -> FloatArray:
    shares = shares_on_faces(places, estimate.mesh.corners, faces)
    return np.asarray(np.einsum("ij,ij->i", shares, estimate.deviation[estimate.mesh.faces[faces]]))
