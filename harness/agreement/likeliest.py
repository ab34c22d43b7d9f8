"""The pose of the gel at which a contact's picture and a model of the object agree best.

Eight numbers of a contact are known to a stated sigma only: six of the gel's pose, the gain by which its
picture shows heights, and how far it hangs from what it touches. They are found between the reading and their
prior (Gauss-Newton, slopes by differences). For errors that are normal, what is left at the best of them,
with what they are off by, is a chi-square of as many degrees as there are independent readings.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.ndimage import gaussian_filter

from harness.agreement.agreement import Source
from harness.agreement.arm import twisted
from harness.agreement.place_noise import PlaceNoise, twist_covariance
from harness.agreement.readings import SEEN, PressedContact
from harness.agreement.subject import Subject
from harness.basics.arrays import BoolArray, FloatArray, block_means
from harness.basics.errors import OutOfDomain
from harness.basics.geometry import inverse

_STEPS = np.repeat([0.15e-3, np.radians(0.4)], 3)
_STEP = 0.1
"""Of a sigma of gain and skirt, over which slopes are taken."""

_DEEPER = (-0.8e-3, -0.4e-3, 0.0, 0.4e-3, 0.8e-3, 1.2e-3, 1.6e-3, 2.4e-3)
_ASIDE = ((0.0, 0.0), (1.2e-3, 0.0), (-1.2e-3, 0.0), (0.0, 1.2e-3), (0.0, -1.2e-3))
"""m along the gel's axes from the stated pose to those at which a search may start: where the model does not
reach the gel, or an edge lies on the other side of it, no slope leads to the contact."""

_STARTS = 2
_POORLY = 1.5
"""Times the degrees of freedom, from which on a chi-square may be that of a wrong minimum."""

_ROUNDS = 8
_SETTLED = 0.05
"""Of a chi-square: a round that gains less is the last."""

_SHORTEN = (1.0, 0.5, 0.25, 0.1)
"""Of a step, tried at once: where the object bends, a whole one may go too far."""


@dataclass(frozen=True)
class SurfaceNoise:
    """How far a gel's surface by its picture may be from a model's.

    Attributes:
        rms: m, one sigma at the true pose, of the touched surface: the light's shading (0.03 mm), and as
            much again of the object's small bends.
        aside: m, one sigma of where an edge lies within a contact: times the slope there it adds to ``rms``.
        gain: one sigma of how much higher or lower the picture shows the gel than it is, of its height.
        skirt: m, one sigma of the blur by which the gel hangs farther from what it touches than modelled.
        length: m over which errors of a surface are alike: so many of them stand side by side in a contact.
        block: m, a side of the blocks of pixels that are averaged.
        core: share of the deepest place above which a surface is compared: below it, it is the gel that
            hangs from the contact, not the object that shapes it.
        rim: m along the picture's border that are not compared: heights are integrated from slopes, and
            beyond the border there are none.
        most: sigmas that one block counts as at most, once the pose is found: a crease that the gel does not
            reach is a few blocks far off, another object is all of them off.
    """

    rms: float = 0.042e-3
    aside: float = 0.1e-3
    gain: float = 0.07
    skirt: float = 0.7e-3
    length: float = 3.0e-3
    block: float = 0.6e-3
    core: float = 0.4
    rim: float = 1.2e-3
    most: float = 3.0


@dataclass(frozen=True, eq=False)
class Surfaces:
    """A reading beside a model, at the likeliest pose.

    Attributes:
        read: ``(rows, columns)`` m of indentation, in blocks.
        modelled: the same.
        variance: ``(rows, columns)`` m^2 of their difference.
        compared: ``(rows, columns)`` where they were compared.
        pitch: m, a side of a block.
        twist: ``(6,)`` m and rad from the stated pose, in base.
        gain: of the heights read over the model's.
        prior: chi-square of twist, gain and skirt.
    """

    read: FloatArray
    modelled: FloatArray
    variance: FloatArray
    compared: BoolArray
    pitch: float
    twist: FloatArray
    gain: float
    prior: float


def likeliest(
    subject: Subject, source: Source, contact: PressedContact, places: PlaceNoise, noise: SurfaceNoise
) -> Surfaces:
    """The pose between reading and prior at which a contact fits best, and both surfaces there.

    Args:
        subject: the object, where the scene states it.
        source: the ObjectFile's network, or the reference.
        contact: of the run.
        places: of the gel's pose.
        noise: of the surface.

    Raises:
        OutOfDomain: no network was made for the stated pose.
        WrongUse: the network is of another gel or object.
    """
    return _Search(subject, source, contact, places, noise).best()


class _Search:
    """One contact's likeliest pose, gain and skirt, each over its sigma: ``(8,)``."""

    def __init__(
        self,
        subject: Subject,
        source: Source,
        contact: PressedContact,
        places: PlaceNoise,
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
        anchor = subject.base_from_object[:3, 3]
        self._root = np.linalg.cholesky(twist_covariance(places, self._pose, anchor))

    def best(self) -> Surfaces:
        at, modelled = self._best()
        compared, twist = self._compared(modelled), self._root @ at[:6]
        gain = 1.0 + self._noise.gain * float(at[6])
        variance = self._variance(modelled)
        return Surfaces(self._read, modelled, variance, compared, self._pitch, twist, gain, float(at @ at))

    def _best(self) -> tuple[FloatArray, FloatArray]:
        """The unknowns and the surface of the best search; a second one only where the first fits badly."""
        found: list[tuple[float, FloatArray, FloatArray]] = []
        for start in self._starts():
            at = self._settled(start)
            (modelled,) = self._modelled([at])
            found.append((self._whole_cost(modelled, at), at, modelled))
            if found[-1][0] < _POORLY * self._dof(self._compared(modelled)):
                break
        return min(found, key=lambda one: one[0])[1:]

    def _starts(self) -> list[FloatArray]:
        """The likeliest of poses about the stated one."""
        # A network was made for presses about one place, and takes longer than a rasteriser.
        places = _ASIDE[:1] if self._source == "network" else _ASIDE
        moves = np.array([(*across, deeper) for across in places for deeper in _DEEPER])
        twists = np.column_stack([moves @ self._pose[:3, :3].T, np.zeros_like(moves)])
        tried = np.column_stack([np.linalg.solve(self._root, twists.T).T, np.zeros((len(moves), 2))])
        try:
            surfaces = self._modelled(tried)
        except OutOfDomain:  # some of them are outside of what a network was made for
            return [np.zeros(8)]
        costs = [self._whole_cost(one, at) for one, at in zip(surfaces, tried, strict=True)]
        return [tried[k] for k in np.argsort(costs)[:_STARTS]]

    def _settled(self, at: FloatArray) -> FloatArray:
        for _ in range(_ROUNDS):
            try:
                at, gained = self._round(at)
            except OutOfDomain:  # a network ends here; a start outside of it is refused by ``_best``
                break
            if gained < _SETTLED:
                break
        return at

    def _whole_cost(self, modelled: FloatArray, at: FloatArray) -> float:
        """The chi-square where either of both touches; infinite where neither does."""
        mask = self._compared(modelled)
        return self._cost(modelled, at, mask, self._weights(modelled, mask)) if mask.any() else np.inf

    def _round(self, at: FloatArray) -> tuple[FloatArray, float]:
        """The next unknowns, and the chi-square gained."""
        steps = _STEPS / np.linalg.norm(self._root, axis=1)
        surfaces = self._simulated([at, *(at + step for step in np.eye(8)[:6] * steps[:, None])])
        here, *around = (self._shown(surface, at) for surface in surfaces)
        mask = self._compared(here)
        if not mask.any():
            return at, 0.0
        around += [self._shown(surfaces[0], at + step) for step in _STEP * np.eye(8)[6:]]
        slopes = np.array([(one - here)[mask] for one in around]).T / np.append(steps, [_STEP, _STEP])
        weights, gaps = self._weights(here, mask), (self._read - here)[mask]
        weighted = weights[:, None] * slopes
        full = np.linalg.solve(weighted.T @ slopes + np.eye(8), weighted.T @ gaps - at)
        tried = [at + share * full for share in _SHORTEN]
        surfaces = self._modelled(tried)
        costs = [self._cost(one, w, mask, weights) for one, w in zip(surfaces, tried, strict=True)]
        best = int(np.argmin(costs))
        gained = self._cost(here, at, mask, weights) - costs[best]
        return (tried[best], gained) if gained > 0.0 else (at, 0.0)

    def _cost(self, modelled: FloatArray, at: FloatArray, mask: BoolArray, weights: FloatArray) -> float:
        return float(weights @ (self._read - modelled)[mask] ** 2 + at @ at)

    def _weights(self, modelled: FloatArray, mask: BoolArray) -> FloatArray:
        """1/m^2 of each block: blocks beside each other are off alike."""
        return self._dof(mask) / int(mask.sum()) / self._variance(modelled)[mask]

    def _variance(self, modelled: FloatArray) -> FloatArray:
        down, across = np.gradient(modelled, self._pitch)
        return np.asarray(self._noise.rms**2 + self._noise.aside**2 * (down**2 + across**2))

    def _dof(self, mask: BoolArray) -> float:
        """So many patches of a contact are off independently of each other."""
        return max(1.0, int(mask.sum()) * (self._pitch / self._noise.length) ** 2)

    def _modelled(self, tried: Sequence[FloatArray] | FloatArray) -> list[FloatArray]:
        return [self._shown(one, at) for one, at in zip(self._simulated(tried), tried, strict=True)]

    def _simulated(self, tried: Sequence[FloatArray] | FloatArray) -> list[FloatArray]:
        """The gel's surfaces in blocks, by pose alone."""
        poses = np.array([twisted(self._pose, self._root @ at[:6]) for at in tried])
        given = {"contact.gel_from_object": inverse(poses) @ self._subject.base_from_object}
        surfaces = self._subject.simulated("touch", self._source, ("touch.gel",), given)["touch.gel"]
        return [self._coarse(surface) for surface in surfaces]

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
