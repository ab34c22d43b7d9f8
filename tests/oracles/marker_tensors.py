"""How a gel of any shape gives under a push, from finite elements: one 3x3 tensor per offset.

Taxim's map (Si and Yuan, 2022, section III-D): the displacement at an offset from the push is linear
in the displacement of the pushed spot. Five pushes determine it: straight in, and in with a slide each
way along x and y, of which symmetry gives all but two. The fit is one pseudo-inverse for all nodes.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.interpolate import LinearNDInterpolator

from harness.basics.arrays import FloatArray, read_only
from harness.basics.errors import CalibrationRefused, OutOfDomain


@dataclass(frozen=True, eq=False)
class TensorMap:
    """Displacement around a push, per displacement of the pushed spot."""

    offsets: FloatArray  #: ``(nodes, 2)`` metres from the push, x and y along the surface.
    tensors: FloatArray  #: ``(nodes, 3, 3)``; z points into the gel.

    def at(self, offsets: FloatArray) -> FloatArray:
        """``(..., 3, 3)`` at offsets ``(..., 2)`` metres, linear between nodes, zero beyond them."""
        found: FloatArray = self._between(offsets[..., 0], offsets[..., 1])
        return found.reshape(*offsets.shape[:-1], 3, 3)

    def superposed(self, pushes: FloatArray, loads: FloatArray, at: FloatArray) -> FloatArray:
        """Displacements ``(m, 3)`` metres at ``at`` under many pushes.

        Args:
            pushes: ``(k, 2)`` metres, where.
            loads: ``(k, 3)`` metres.
            at: ``(m, 2)`` metres.
        """
        moved: FloatArray = np.einsum("mkij,kj->mi", self.at(at[:, None] - pushes[None]), loads)
        return moved

    @cached_property
    def _between(self) -> LinearNDInterpolator:
        return LinearNDInterpolator(self.offsets, self.tensors.reshape(-1, 9), fill_value=0.0)


def fit_tensors(loads: FloatArray, responses: FloatArray) -> FloatArray:
    """``(nodes, 3, 3)`` the tensors nearest to what the nodes did, in closed form.

    Args:
        loads: ``(cases, 3)`` metres, of the pushed spot.
        responses: ``(cases, nodes, 3)`` metres.

    Raises:
        CalibrationRefused: loads that do not span all three directions, or numbers not finite.
    """
    if not (np.isfinite(loads).all() and np.isfinite(responses).all()):
        raise CalibrationRefused("loads or displacements are not finite; export the finite elements again")
    if np.linalg.matrix_rank(loads) < 3:
        raise CalibrationRefused(
            f"{len(loads)} loads span fewer than three directions; add a slide along each"
        )
    tensors: FloatArray = np.einsum("cni,jc->nij", responses, np.linalg.pinv(loads))
    return read_only(tensors)


def tensor_map(offsets: FloatArray, press: FloatArray, slide: FloatArray, spot: float) -> TensorMap:
    """The map of a gel that is round about the push, from two of its five loads.

    Args:
        offsets: ``(nodes, 2)`` metres from the push.
        press: ``(nodes, 3)`` metres, under a push straight in.
        slide: ``(nodes, 3)`` metres, under a push in and along +x.
        spot: metres, radius of what is pushed; its mean displacement is the load.

    Raises:
        OutOfDomain: shapes that disagree, or no node within the spot.
    """
    pushed = np.hypot(offsets[:, 0], offsets[:, 1]) <= spot
    if not (press.shape == slide.shape == (len(offsets), 3)) or not pushed.any():
        raise OutOfDomain(
            f"offsets {offsets.shape}, displacements {press.shape} and {slide.shape}, "
            f"{int(pushed.sum())} nodes within {spot} m of the push"
        )
    loads = [press[pushed].mean(axis=0)]
    responses = [press]
    along = slide[pushed].mean(axis=0)
    slid = LinearNDInterpolator(offsets, slide, fill_value=0.0)
    for cosine, sine in ((1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0)):
        turn = np.array([[cosine, -sine, 0.0], [sine, cosine, 0.0], [0.0, 0.0, 1.0]])
        loads.append(turn @ along)
        responses.append(slid(offsets @ turn[:2, :2]) @ turn.T)
    return TensorMap(offsets, fit_tensors(np.array(loads), np.array(responses)))
