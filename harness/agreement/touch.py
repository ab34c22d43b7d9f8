"""Compare the gel's surface in tactile images with the surface predicted by a model of the object.

The gel's pose is known to a few tenths of a millimetre and a degree, which moves most of a picture: it is
estimated at each contact, and its error is added to the error of the surface.
A network fails at some points, so that no single contact rejects an object; the number of contacts that do
not fit is binomial where the object is right.

``PoseSearch`` finds the pose of the gel at which a contact's image and a model of the object agree best.
Eight numbers of a contact have a prior with a stated sigma: six of the gel's pose, the gain by which its
image shows heights, and the width of the contact border. They are fitted to the reading and their
prior (Gauss-Newton with numerical derivatives). For normal errors, the cost at the best fit,
prior included, has a chi-square distribution with as many degrees as there are independent readings.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.ndimage import gaussian_filter
from scipy.special import chdtrc, chdtri

from harness.agreement.agreement import (
    Residual,
    SenseResiduals,
    SideBySide,
    Source,
    probability_of_at_least,
)
from harness.agreement.arm import twisted
from harness.agreement.place_noise import twist_covariance
from harness.agreement.stated_error import gross_share, map_errors
from harness.agreement.subject import SEEN, PressedContact, Subject, refusal_notes
from harness.basics.arrays import BoolArray, FloatArray, block_means
from harness.basics.errors import OutOfDomain, WrongUse
from harness.basics.geometry import inverse
from harness.bench.gap import BenchErrors
from harness.effects.quantities import Quantities

_IMPROBABLE = 0.01
"""Probability below which a contact counts as one that does not fit."""

_LEAST = 1.0e-300

_STEPS = np.repeat([0.15e-3, np.radians(0.4)], 3)
_STEP = 0.1
"""Of a sigma of gain and skirt, over which slopes are taken."""

_DEEPER = (-0.8e-3, -0.4e-3, 0.0, 0.4e-3, 0.8e-3, 1.2e-3, 1.6e-3, 2.4e-3)
_ASIDE = ((0.0, 0.0), (1.2e-3, 0.0), (-1.2e-3, 0.0), (0.0, 1.2e-3), (0.0, -1.2e-3))
"""m along the gel's axes from the stated pose to those at which a search may start: where the model does not
reach the gel, or an edge lies on the other side of it, no slope leads to the contact."""

_POORLY = 1.5
"""Times the degrees of freedom, from which on a chi-square may be that of a wrong minimum."""

_ROUNDS = 8
_SETTLED = 0.05
"""Of a chi-square: a round that gains less is the last."""

_SHORTEN = (1.0, 0.5, 0.25, 0.1)
"""Of a step, tried at once: where the object bends, a whole one may go too far."""


@dataclass(frozen=True)
class SurfaceNoise:
    """How far a gel's surface by its picture may be from a model's."""

    rms: float = 0.042e-3
    """m, one sigma at the true pose, of the touched surface: the light's shading (0.03 mm), and as much again
    of the object's small bends."""
    aside: float = 0.1e-3
    """m, one sigma of where an edge lies within a contact: times the slope there it adds to ``rms``."""
    gain: float = 0.07
    """one sigma of how much higher or lower the picture shows the gel than it is, of its height."""
    skirt: float = 0.7e-3
    """m, one sigma of the blur by which the gel hangs farther from what it touches than modelled."""
    length: float = 3.0e-3
    """m over which errors of a surface are alike: so many of them stand side by side in a contact."""
    block: float = 0.6e-3  #: m, a side of the blocks of pixels that are averaged.
    core: float = 0.4
    """share of the deepest place above which a surface is compared: below it, it is the gel that hangs from
    the contact, not the object that shapes it."""
    rim: float = 1.2e-3
    """m along the picture's border that are not compared: heights are integrated from slopes, and beyond the
    border there are none."""
    most: float = 3.0
    """sigmas that one block counts as at most, once the pose is found: a crease that the gel does not reach
    is a few blocks far off, another object is all of them off."""


def compare_touch(subject: Subject, source: Source, contacts: Sequence[PressedContact]) -> SenseResiduals:
    """Compare the gel's surface at every contact with a model's, by the network or the reference."""
    errors, noise = subject.run.station.errors, SurfaceNoise()
    residuals, notes = [], refusal_notes(contacts)
    for contact in contacts:
        if contact.refusal:
            continue
        try:
            found = PoseSearch(subject, source, contact, errors, noise).best()
        except WrongUse as refusal:
            return SenseResiduals("touch", source, (), str(refusal))
        except OutOfDomain as refusal:
            notes.append(f"step {contact.step + 1} is outside of what the {source} knows: {refusal}")
            continue
        if found.compared.any():
            residuals.append(surface_residual(contact.step, found, noise, gross_share(source)))
        else:
            notes.append(f"step {contact.step + 1}: neither the picture nor the model shows a contact")
    if gross_share(source) and residuals:
        residuals.append(count_residual(residuals, gross_share(source)))
    why = "; ".join(notes) or ("" if contacts else "no picture of the gel was recorded")
    refused = contacts[0].step if contacts and all(contact.refusal for contact in contacts) else None
    return SenseResiduals("touch", source, tuple(residuals), why, refused_at=refused)


@dataclass(frozen=True, eq=False)
class Surfaces:
    """A reading beside a model, at the likeliest pose."""

    read: FloatArray  #: ``(rows, columns)`` m of indentation, in blocks.
    modelled: FloatArray  #: the same.
    variances: FloatArray
    """``(s, rows, columns)`` m^2 of their difference, for each of ``s`` errors of the source that are as
    probable as each other."""
    compared: BoolArray  #: ``(rows, columns)`` where they were compared.
    pitch: float  #: m, a side of a block.
    twist: FloatArray  #: ``(6,)`` m and rad from the stated pose, in base.
    gain: float  #: of the heights read over the model's.
    prior: float  #: chi-square of twist, gain and skirt.


def surface_residual(
    step: int, found: Surfaces, noise: SurfaceNoise, outlier_probability: float = 0.0
) -> Residual:
    """Compare a contact's surfaces; the model's surface is an outlier with ``outlier_probability``."""
    gaps = (found.read - found.modelled)[found.compared]
    area = len(gaps) * found.pitch**2
    # So many patches of the contact are off independently of each other.
    dof = max(1.0, area / noise.length**2)
    variances = found.variances[:, found.compared]
    numbers = {
        "rms_m": float(np.sqrt(np.mean(gaps**2))),
        "sigma_m": float(np.sqrt(np.mean(variances))),
        "area_m2": area,
        "moved_m": float(np.linalg.norm(found.twist[:3])),
        "turned_rad": float(np.linalg.norm(found.twist[3:])),
        "gain": found.gain,
        "prior_chi_square": found.prior,
    }
    clipped = np.minimum(gaps**2 / variances, noise.most**2)
    chi_square = combine_chi_squares(dof * clipped.mean(axis=1) + found.prior, dof, outlier_probability)
    sides = SideBySide(found.read, found.modelled, "m")
    return Residual(step, "gel surface", chi_square, dof, numbers, sides)


def combine_chi_squares(chi_squares: FloatArray, dof: float, outlier_probability: float = 0.0) -> float:
    """Combine ``(s,)`` chi-squares of equally probable noises into one with their mean p-value.

    ``outlier_probability`` is the probability of an outlier of any size.
    """
    if len(chi_squares) == 1 and outlier_probability == 0.0:
        return float(chi_squares[0])
    probability = outlier_probability + (1.0 - outlier_probability) * float(chdtrc(dof, chi_squares).mean())
    return float(chdtri(dof, max(probability, _LEAST)))


def count_residual(residuals: Sequence[Residual], outlier_probability: float) -> Residual:
    """Test the number of contacts that do not fit, as ``-2 ln p``; ``outlier_probability`` as above."""
    share = outlier_probability + (1.0 - outlier_probability) * _IMPROBABLE
    found = chdtrc([one.dof for one in residuals], [one.chi_square for one in residuals])
    unlike = int(np.count_nonzero(found < share))
    probability = probability_of_at_least(unlike, len(residuals), share)
    numbers = {
        "contacts": float(len(residuals)),
        "unlike": float(unlike),
        "share_expected": share,
        "probability": probability,
    }
    chi_square = -2.0 * float(np.log(max(probability, _LEAST)))
    return Residual(residuals[-1].step, "contacts together", chi_square, 2.0, numbers)


class PoseSearch:
    """A search for the most probable pose, gain and border of one contact, ``(8,)`` in units of sigma."""

    def __init__(
        self,
        subject: Subject,
        source: Source,
        contact: PressedContact,
        errors: BenchErrors,
        noise: SurfaceNoise,
    ) -> None:
        self._subject, self._source, self._noise = subject, source, noise
        self._pose = contact.seen.base_from_gel
        sensor = subject.run.station.gel.sensor
        self._block = max(1, round(noise.block / sensor.pitch))
        self._pitch = self._block * sensor.pitch
        self._read = self._coarse(contact.heights)
        rim = round(noise.rim / self._pitch)
        self._inside = np.zeros(self._read.shape, np.bool_)
        self._inside[rim : -rim or None, rim : -rim or None] = True
        self._errors = map_errors(subject, source)
        self._error = float(np.sqrt(np.mean(self._errors**2)))
        anchor = subject.base_from_object[:3, 3]
        self._root = np.linalg.cholesky(twist_covariance(errors, self._pose, anchor))

    def best(self) -> Surfaces:
        """Find the pose that fits reading and prior best, and both surfaces there.

        Other starts are tried if the first search has a poor fit.

        Raises:
            OutOfDomain: the stated pose, or every pose that would fit, is outside the network's domain.
            WrongUse: the network is of another gel or object.
        """
        found: list[tuple[float, FloatArray, FloatArray]] = []
        for places in (_ASIDE[:1], _ASIDE[1:]):
            at, free = self._settled(self._start(places))
            (modelled,) = self._simulated([at])
            if modelled is None:
                continue
            modelled = self._shown(modelled, at)
            cost = self._whole_cost(modelled, at)
            if cost < _POORLY * self._dof(self._compared(modelled)):
                found = [(cost, at, modelled)]
                break
            if free:
                found.append((cost, at, modelled))
        if not found:
            raise OutOfDomain(
                f"the touch's {self._source} was made neither for the stated pose of the gel nor for those "
                "about it at which it would fit; compare with --reference"
            )
        _, at, modelled = min(found, key=lambda one: one[0])
        compared, twist = self._compared(modelled), self._root @ at[:6]
        gain = 1.0 + self._noise.gain * float(at[6])
        variances = np.array([self._variance(modelled, compared, error) for error in self._errors])
        return Surfaces(self._read, modelled, variances, compared, self._pitch, twist, gain, float(at @ at))

    def _start(self, places: Sequence[tuple[float, float]]) -> FloatArray:
        """The likeliest of poses about the stated one; the stated one where the source knows none of them."""
        moves = np.array([(*across, deeper) for across in places for deeper in _DEEPER])
        twists = np.column_stack([moves @ self._pose[:3, :3].T, np.zeros_like(moves)])
        tried = np.column_stack([np.linalg.solve(self._root, twists.T).T, np.zeros((len(moves), 2))])
        costs = self._costs(tried, self._whole_cost)
        best = int(np.argmin(costs))
        return tried[best] if np.isfinite(costs[best]) else np.zeros(8)

    def _settled(self, at: FloatArray) -> tuple[FloatArray, bool]:
        """The end of a search, and whether it was free to end elsewhere."""
        free = True
        for _ in range(_ROUNDS):
            at, gained, free = self._round(at)
            if gained < _SETTLED:
                break
        return at, free

    def _whole_cost(self, modelled: FloatArray, at: FloatArray) -> float:
        """The chi-square where either of both touches; infinite where neither does."""
        mask = self._compared(modelled)
        return self._cost(modelled, at, mask, self._weights(modelled, mask)) if mask.any() else np.inf

    def _round(self, at: FloatArray) -> tuple[FloatArray, float, bool]:
        """The next unknowns, the chi-square gained, and whether the source knows a whole step from here."""
        steps = np.column_stack([np.diag(_STEPS / np.linalg.norm(self._root, axis=1)), np.zeros((6, 2))])
        surface, *ahead = self._simulated([at, *(at + steps)])
        if surface is None:
            return at, 0.0, False
        here = self._shown(surface, at)
        mask = self._compared(here)
        if not mask.any():
            return at, 0.0, True
        moved = self._slopes_of_pose(here, at, steps, ahead)
        shown = [(self._shown(surface, at + step) - here) / _STEP for step in _STEP * np.eye(8)[6:]]
        slopes = np.array([slope[mask] for slope in (*moved, *shown)]).T
        weights, gaps = self._weights(here, mask), (self._read - here)[mask]
        weighted = weights[:, None] * slopes
        full = np.linalg.solve(weighted.T @ slopes + np.eye(8), weighted.T @ gaps - at)
        tried = np.array([at + share * full for share in _SHORTEN])
        costs = self._costs(tried, lambda one, then: self._cost(one, then, mask, weights))
        best, free = int(np.argmin(costs)), bool(np.isfinite(costs[0]))
        gained = self._cost(here, at, mask, weights) - costs[best]
        return (tried[best], gained, free) if gained > 0.0 else (at, 0.0, free)

    def _slopes_of_pose(
        self, here: FloatArray, at: FloatArray, steps: FloatArray, ahead: Sequence[FloatArray | None]
    ) -> list[FloatArray]:
        """Change of the surface with each unknown of the pose, by a step to a side that the source knows."""
        slopes = []
        for step, one in zip(steps, ahead, strict=True):
            way, moved = (step, one) if one is not None else (-step, self._simulated([at - step])[0])
            known = None if moved is None else self._shown(moved, at) - here
            # Where neither side is known the unknown stays what it is.
            slopes.append(np.zeros_like(here) if known is None else known / way.sum())
        return slopes

    def _costs(self, tried: FloatArray, cost: Callable[[FloatArray, FloatArray], float]) -> FloatArray:
        """``(n,)`` of unknowns ``(n, 8)``; infinite where the source was not made for the pose."""
        surfaces = zip(self._simulated(tried), tried, strict=True)
        return np.array([np.inf if one is None else cost(self._shown(one, at), at) for one, at in surfaces])

    def _cost(self, modelled: FloatArray, at: FloatArray, mask: BoolArray, weights: FloatArray) -> float:
        return float(weights @ (self._read - modelled)[mask] ** 2 + at @ at)

    def _weights(self, modelled: FloatArray, mask: BoolArray) -> FloatArray:
        """1/m^2 of each block: blocks beside each other are off alike."""
        return self._dof(mask) / int(mask.sum()) / self._variance(modelled, mask, self._error)[mask]

    def _variance(self, modelled: FloatArray, mask: BoolArray, error: float) -> FloatArray:
        """m^2 of each block, where ``mask`` is compared and the source's map is off by ``error`` in m."""
        down, across = np.gradient(modelled, self._pitch)
        edges = self._noise.aside**2 * (down**2 + across**2)
        # What a map is off by lies where the object shapes the gel: elsewhere both are flat.
        own = error**2 * mask.size / max(1, int(mask.sum()))
        return np.asarray(self._noise.rms**2 + edges + own)

    def _dof(self, mask: BoolArray) -> float:
        """So many patches of a contact are off independently of each other."""
        return max(1.0, int(mask.sum()) * (self._pitch / self._noise.length) ** 2)

    def _simulated(self, tried: Sequence[FloatArray] | FloatArray) -> list[FloatArray | None]:
        """The gel's surfaces in blocks, by pose alone; None of a pose that the source was not made for."""
        poses = np.array([twisted(self._pose, self._root @ at[:6]) for at in tried])
        given: Quantities = {"contact_gel_from_object": inverse(poses) @ self._subject.base_from_object}
        try:
            found = self._subject.simulated("touch", self._source, ("touch.gel",), given)
        except OutOfDomain:
            if len(tried) == 1:
                return [None]
            half = len(tried) // 2
            return [*self._simulated(tried[:half]), *self._simulated(tried[half:])]
        return [self._coarse(surface) for surface in found.values["touch_gel"]]

    def _shown(self, surface: FloatArray, at: FloatArray) -> FloatArray:
        """A surface as its picture would show it, with its gain and its skirt."""
        hung = gaussian_filter(surface, self._noise.skirt / self._pitch, mode="nearest")
        return np.asarray((1.0 + self._noise.gain * at[6]) * (surface + at[7] * (hung - surface)))

    def _coarse(self, heights: FloatArray) -> FloatArray:
        rows, columns = (size // self._block * self._block for size in heights.shape)
        top, left = (heights.shape[0] - rows) // 2, (heights.shape[1] - columns) // 2
        return block_means(heights[top : top + rows, left : left + columns], self._block)

    def _compared(self, modelled: FloatArray) -> BoolArray:
        """Where the object shapes the gel, by the picture or by the model."""
        return self._core(self._read) | self._core(modelled)

    def _core(self, heights: FloatArray) -> BoolArray:
        return np.asarray(self._inside & (heights > max(SEEN, self._noise.core * float(heights.max()))))
