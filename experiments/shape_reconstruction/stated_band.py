"""Whether a deviation holds that an estimate states: the share of a surface within its 90 % band."""

from dataclasses import dataclass

import numpy as np

from experiments.shape_reconstruction.metric import SurfacesApart
from experiments.shape_reconstruction.surface import ShapeEstimate
from harness.basics.arrays import FloatArray, IntArray
from harness.basics.faces.nearest_kernels import shares_on_faces

BAND90 = 1.645
"""Standard deviations on each side that hold 90 % of a normal density."""


@dataclass(frozen=True)
class BandHeld:
    """Shares, 0 to 1 and even by area, that are no farther off than the estimate's 90 % band says.

    Attributes:
        truth: of the true surface, by the band at the estimate's place nearest to each part of it.
        answer: of the estimate's own surface, by the band there.
    """

    truth: float
    answer: float


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
    """``(n,)`` m at ``(n, 3)`` places on faces."""
    shares = shares_on_faces(places, estimate.mesh.corners, faces)
    return np.asarray(np.einsum("ij,ij->i", shares, estimate.deviation[estimate.mesh.faces[faces]]))
