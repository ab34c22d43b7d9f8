"""Touch: the gel's surface, as its picture shows it and as a model of the object gives it.

The gel's pose is known to a few tenths of a millimetre and a degree, which moves most of a picture. It is
found anew at each contact, between the reading and its prior (Gauss-Newton, slopes by differences), and
what it is off by counts beside what the surface is off by. For errors that are normal the sum at the best
pose is a chi-square of as many degrees as there are readings.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from harness.agreement.agreement import Residual, SenseResiduals, Source
from harness.agreement.arm import twisted
from harness.agreement.place_noise import PlaceNoise, twist_covariance
from harness.agreement.readings import SEEN, PressedContact
from harness.agreement.subject import Subject
from harness.basics.arrays import BoolArray, FloatArray, block_means
from harness.basics.errors import OutOfDomain, WrongUse
from harness.basics.geometry import inverse

_STEPS = np.repeat([0.15e-3, np.radians(0.4)], 3)
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
            much again of the gel's skirt and the object's small bends.
        length: m over which errors of a surface are alike: so many of them stand side by side in a contact.
        block: m, a side of the blocks of pixels that are averaged.
        core: share of the deepest place above which a surface is compared: below it, it is the gel that
            hangs from the contact, not the object that shapes it.
    """

    rms: float = 0.042e-3
    length: float = 3.0e-3
    block: float = 0.6e-3
    core: float = 0.4


@dataclass(frozen=True, eq=False)
class Surfaces:
    """A reading beside a model, at the likeliest pose.

    Attributes:
        read: ``(rows, columns)`` m of indentation, in blocks.
        modelled: the same.
        compared: ``(rows, columns)`` where they were compared.
        pitch: m, a side of a block.
        twist: ``(6,)`` m and rad from the stated pose, in base.
        prior: chi-square of the twist.
    """

    read: FloatArray
    modelled: FloatArray
    compared: BoolArray
    pitch: float
    twist: FloatArray
    prior: float


def compare_touch(
    subject: Subject,
    source: Source,
    contacts: Sequence[PressedContact],
    places: PlaceNoise | None = None,
    noise: SurfaceNoise | None = None,
) -> SenseResiduals:
    """Every contact's surface of the gel against a model's.

    Args:
        subject: the object, where the scene states it.
        source: the ObjectFile's network, or the reference.
        contacts: of the run.
        places: of the gel's pose; None for the stated one.
        noise: of the surface; None for the stated one.
    """
    places, noise = places or PlaceNoise(), noise or SurfaceNoise()
    residuals, notes = [], []
    for contact in contacts:
        try:
            found, note = _found(subject, source, contact, places, noise)
        except WrongUse as refusal:
            return SenseResiduals("touch", source, (), str(refusal))
        if found.compared.any():
            residuals.append(surface_residual(contact.step, found, noise))
        else:
            note = "neither the picture nor the model shows a contact"
        notes += [f"step {contact.step + 1}: {note}"] if note else []
    why = "; ".join(notes) or ("" if contacts else "no picture of the gel was recorded")
    return SenseResiduals("touch", source, tuple(residuals), why)


def _found(
    subject: Subject, source: Source, contact: PressedContact, places: PlaceNoise, noise: SurfaceNoise
) -> tuple[Surfaces, str]:
    """The likeliest surfaces, by the reference where no network was made for the place; and what to note."""
    try:
        return likeliest(subject, source, contact, places, noise), ""
    except OutOfDomain as refusal:
        if source == "reference":
            raise
        return likeliest(subject, "reference", contact, places, noise), f"by the reference, as {refusal}"


def surface_residual(step: int, found: Surfaces, noise: SurfaceNoise) -> Residual:
    """What a contact's surfaces are off by at the likeliest pose."""
    gaps = (found.read - found.modelled)[found.compared]
    area = len(gaps) * found.pitch**2
    # So many patches of the contact are off independently of each other.
    dof = max(1.0, area / noise.length**2)
    rms = float(np.sqrt(np.mean(gaps**2)))
    numbers = {
        "rms_m": rms,
        "sigma_m": noise.rms,
        "area_m2": area,
        "moved_m": float(np.linalg.norm(found.twist[:3])),
        "turned_rad": float(np.linalg.norm(found.twist[3:])),
        "pose_chi_square": found.prior,
    }
    return Residual(step, "gel surface", dof * (rms / noise.rms) ** 2 + found.prior, dof, numbers)


def likeliest(
    subject: Subject, source: Source, contact: PressedContact, places: PlaceNoise, noise: SurfaceNoise
) -> Surfaces:
    """The pose between reading and prior at which a contact fits best, and both surfaces there.

    Raises:
        OutOfDomain: no network was made for the stated pose.
        WrongUse: the network is of another gel or object.
    """
    return _Search(subject, source, contact, places, noise).best()


class _Search:
    """One contact's likeliest pose."""

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
        anchor = subject.base_from_object[:3, 3]
        self._root = np.linalg.cholesky(twist_covariance(places, self._pose, anchor))

    def best(self) -> Surfaces:
        whitened = np.zeros(6)
        for _ in range(_ROUNDS):
            whitened, gained = self._round(whitened)
            if gained < _SETTLED:
                break
        (modelled,) = self._modelled([whitened])
        compared = self._compared(modelled)
        twist, prior = self._root @ whitened, float(whitened @ whitened)
        return Surfaces(self._read, modelled, compared, self._pitch, twist, prior)

    def _round(self, at: FloatArray) -> tuple[FloatArray, float]:
        """The next whitened twist, and the chi-square gained."""
        steps = np.diag(_STEPS / np.linalg.norm(self._root, axis=1))
        here, *around = self._modelled([at, *(at + step for step in steps)])
        mask = self._compared(here)
        if not mask.any():
            return at, 0.0
        weight = self._weight(mask)
        slopes = np.array([(one - here)[mask] for one in around]).T / np.diag(steps)
        gaps = (self._read - here)[mask]
        matrix = weight * slopes.T @ slopes + np.eye(6)
        full = np.linalg.solve(matrix, weight * slopes.T @ gaps - at)
        tried = [at + share * full for share in _SHORTEN]
        costs = [self._cost(one, w, mask) for one, w in zip(self._modelled(tried), tried, strict=True)]
        best = int(np.argmin(costs))
        gained = self._cost(here, at, mask) - costs[best]
        return (tried[best], gained) if gained > 0.0 else (at, 0.0)

    def _cost(self, modelled: FloatArray, whitened: FloatArray, mask: BoolArray) -> float:
        gaps = (self._read - modelled)[mask]
        return float(self._weight(mask) * gaps @ gaps + whitened @ whitened)

    def _weight(self, mask: BoolArray) -> float:
        """1/m^2 of one block: blocks beside each other are off alike."""
        count = int(mask.sum())
        dof = max(1.0, count * (self._pitch / self._noise.length) ** 2)
        return float(dof / (count * self._noise.rms**2))

    def _modelled(self, whitened: Sequence[FloatArray]) -> list[FloatArray]:
        poses = np.array([twisted(self._pose, self._root @ one) for one in whitened])
        given = {"contact.gel_from_object": inverse(poses) @ self._subject.base_from_object}
        surfaces = self._subject.simulated("touch", self._source, ("touch.gel",), given)["touch.gel"]
        return [self._coarse(surface) for surface in surfaces]

    def _coarse(self, heights: FloatArray) -> FloatArray:
        rows, columns = (size // self._block * self._block for size in heights.shape)
        top, left = (heights.shape[0] - rows) // 2, (heights.shape[1] - columns) // 2
        return block_means(heights[top : top + rows, left : left + columns], self._block)

    def _compared(self, modelled: FloatArray) -> BoolArray:
        """Where the object shapes the gel, by the picture or by the model."""
        return self._core(self._read) | self._core(modelled)

    def _core(self, heights: FloatArray) -> BoolArray:
        return np.asarray(heights > max(SEEN, self._noise.core * float(heights.max())))
