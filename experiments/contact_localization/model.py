"""What an estimator is given beside the readings: the object, the sensor and what is believed of the pose."""

from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from typing import Literal

import numpy as np

from experiments.contact_localization.sound.gains import GainTable, gain_table
from harness.basics.arrays import FloatArray, IntArray, read_only
from harness.basics.errors import WrongUse
from harness.basics.materials import Material
from harness.basics.mesh import Mesh
from harness.basics.symmetry import find_symmetries
from harness.bench.gap import USUAL, BenchErrors
from harness.bench.sensor import TactileSensor
from harness.sim.gel.height_map import RasterMesh, first_surface
from harness.sim.gel.view import FirstSurface
from harness.sim.modal.modes import Modes
from harness.sim.optics.tactile_calibration import TactileCalibration
from harness.sim.solid.surface_samples import Surface, sample_surface

_UPRIGHT = np.radians(1.0)


_UNFELT = 0.3e-3
"""Metres, root mean square, by which a turn may move the surface and still not be felt."""


_GOLDEN = 0.6180339887498949


@dataclass(frozen=True, eq=False)
class Turning:
    """The turns about one vertical line that leave the object as it was."""

    centre: FloatArray  #: ``(3,)`` metres, a point of the line, in the object's frame.
    up: FloatArray  #: ``(3,)`` unit, the vertical in the object's frame.
    fold: int  #: how many steps make a turn; 1 for none, 0 for any angle.

    @property
    def period(self) -> float:
        """rad; 0 where any angle serves."""
        return 0.0 if self.fold == 0 else 2.0 * np.pi / self.fold

    def spread(self, count: int) -> FloatArray:
        """``(count,)`` rad: turns of the group, evenly used, in no rhythm that an order could share."""
        parts = np.mod((np.arange(count) + 0.5) * _GOLDEN, 1.0)
        if self.fold == 0:
            return np.asarray(2.0 * np.pi * parts)
        return np.asarray(np.floor(self.fold * parts) * self.period)

    def copies(self, weights: FloatArray, most: int) -> tuple[IntArray, FloatArray, FloatArray]:
        """Hypotheses repeated under turns of the group, the heavier the more often.

        The few hypotheses that sound leaves would otherwise stand for as few turns.

        Args:
            weights: ``(n,)``, summing to 1.
            most: no copy weighs more than one part in so many.

        Returns:
            ``(c,)`` whose copy each is, rising; ``(c,)`` rad of its turn; ``(c,)`` weights, summing to 1.
        """
        if self.fold == 1:
            return np.arange(len(weights)), np.zeros(len(weights)), weights
        each = np.ceil(weights * most).clip(min=1.0).astype(np.int64)
        owners = np.repeat(np.arange(len(each)), each)
        return owners, self.spread(len(owners)), (weights / each)[owners]

    def turned(self, points: FloatArray, angles: FloatArray) -> FloatArray:
        """``(n, 3)`` points in the object's frame, each turned by its own of ``(n,)`` rad."""
        if self.fold == 1:
            return points
        away = points - self.centre
        along = np.outer(away @ self.up, self.up)
        cosines, sines = np.cos(angles)[:, None], np.sin(angles)[:, None]
        turned = along + cosines * (away - along) + sines * np.cross(self.up, away)
        return np.asarray(self.centre + turned)


def turning_of(mesh: Mesh, up: FloatArray) -> Turning:
    """The turns about ``(3,)`` ``up`` that cannot be felt; none where the object shows every one.

    Args:
        mesh: of the object, in metres.
        up: unit vector, the vertical in the object's frame.
    """
    group = find_symmetries(mesh)
    upright = abs(float(group.axis @ up)) > np.cos(_UPRIGHT)
    if group.fold == 1 or not upright or group.rms > _UNFELT:
        return Turning(np.asarray(group.centre), up, 1)
    axis = group.axis if float(group.axis @ up) > 0.0 else -group.axis
    return Turning(np.asarray(group.centre), np.asarray(axis), group.fold)


@dataclass(frozen=True, eq=False)
class Prior:
    """What is believed of the object's orientation. Its position is never given."""

    base_from_object: FloatArray  #: ``(3, 3)`` nominal rotation.
    yaw: Literal["known", "unknown"] = "known"
    """``"known"`` to ``yaw_sigma``, or ``"unknown"``: upright, turned by any angle."""
    yaw_sigma: float = USUAL.yaw  #: rad, about the vertical of the base, where the yaw is known.

    def __post_init__(self) -> None:
        rotation = np.asarray(self.base_from_object, dtype=np.float64)
        orthonormal = rotation.shape == (3, 3) and np.allclose(rotation @ rotation.T, np.eye(3), atol=1e-6)
        if not orthonormal or np.linalg.det(rotation) < 0.0:
            raise WrongUse(
                "the prior's base_from_object must be a right-handed (3, 3) rotation; pass pose[:3, :3]"
            )
        object.__setattr__(self, "base_from_object", read_only(rotation.copy()))

    def times(self, factor: float) -> "Prior":
        """The same, its yaw believed so many times less surely."""
        return replace(self, yaw_sigma=factor * self.yaw_sigma)

    @property
    def up(self) -> FloatArray:
        """``(3,)`` unit, the vertical of the base in the object's frame; the same under any yaw."""
        return np.asarray(self.base_from_object[2])

    def object_from_base(self, yaws: FloatArray) -> FloatArray:
        """``(n, 3, 3)`` rotations for ``(n,)`` yaws in rad away from the nominal one."""
        turned = np.zeros((len(yaws), 3, 3))
        cosines, sines = np.cos(yaws), np.sin(yaws)
        turned[:, 0, 0] = turned[:, 1, 1] = cosines
        turned[:, 0, 1], turned[:, 1, 0] = sines, -sines
        turned[:, 2, 2] = 1.0
        return np.asarray(self.base_from_object.T @ turned)


@dataclass(frozen=True, eq=False)
class Model:
    """The object and the sensor as the estimator knows them."""

    mesh: Mesh  #: of the object, in metres.
    sensor: TactileSensor  #: its geometry.
    calibration: TactileCalibration  #: of its colours, fitted to presses of this sensor.
    modes: Modes | None = None  #: of the object; None where no sound is compared.
    material: Material | None = None  #: of the object; None where no sound is compared.
    seen: FirstSurface | None = None
    """the object along the tool, which candidates' tactile images are crops of; None for the mesh's."""
    errors: BenchErrors = field(default_factory=BenchErrors)
    """of the bench that the readings are from, as its station states them."""
    sound_refusal: str = ""  #: why no sound can be compared that the scene calls for; empty where one can.
    seen_rms: float = 0.0  #: m, root mean square over a whole image, that ``seen`` is itself off by.
    _surfaces: dict[float, Surface] = field(init=False, default_factory=dict, repr=False)

    _gains: dict[float, GainTable] = field(init=False, default_factory=dict, repr=False)
    _turnings: dict[tuple[float, ...], Turning] = field(init=False, default_factory=dict, repr=False)

    @cached_property
    def raster(self) -> RasterMesh:
        """The mesh, prepared for drawing."""
        return RasterMesh(self.mesh)

    @property
    def first_surface(self) -> FirstSurface:
        """The object along a tool."""
        return self.seen or partial(first_surface, self.raster)

    def surface(self, spacing: float) -> Surface:
        """The object's samples ``spacing`` metres apart, made on first use."""
        if spacing not in self._surfaces:
            self._surfaces[spacing] = sample_surface(self.mesh, spacing)
        return self._surfaces[spacing]

    def gains(self, spacing: float) -> GainTable:
        """The modes at the samples ``spacing`` metres apart, tabulated on first use.

        Raises:
            WrongUse: the model has no modes.
        """
        if self.modes is None:
            raise WrongUse("this model of the object has no modes; give it some to compare sounds with")
        if spacing not in self._gains:
            self._gains[spacing] = gain_table(self.modes, self.surface(spacing))
        return self._gains[spacing]

    def turning(self, up: FloatArray) -> Turning:
        """The turns about ``(3,)`` ``up`` that the object does not show, found on first use."""
        key = tuple(up.tolist())
        if key not in self._turnings:
            self._turnings[key] = turning_of(self.mesh, up)
        return self._turnings[key]
