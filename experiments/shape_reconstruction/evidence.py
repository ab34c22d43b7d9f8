"""Readings of an object of unknown shape: contacts, free space, silhouette and support.

Frame ``stand``: base, shifted to where the scene nominally puts the object on its support: z up, z = 0 at the
support, axes as base has them. Everything here and every estimate is in it, in metres.
"""

from collections.abc import Collection
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from harness.basics.arrays import BoolArray, FloatArray, read_only
from harness.basics.errors import OutOfDomain
from harness.bench.gap import USUAL, BenchErrors
from harness.experiment.repeated_readings import PlaceTolerance, group_by_place


@dataclass(frozen=True, eq=False)
class GuardedTouch:
    """One straight, guarded way of the gel, which ended at the object or met nothing."""

    stand_from_gel: FloatArray
    """``(4, 4)`` at its end; the origin is the middle of the unpressed gel's face, z points into the
    object."""
    way: float  #: m of it, straight along z: the sensor came from ``way`` farther back.
    points: FloatArray
    """``(n, 3)`` m, of the object's surface where the gel was pressed; none where it met nothing."""
    normals: FloatArray  #: ``(n, 3)`` unit, out of the object, at each point.
    sigma: float  #: m, one standard deviation of the points along the normals, of each on its own.
    normal_sigma: float  #: rad, one standard deviation of the normals.
    index: int  #: the step of the run that it is.
    clear: FloatArray = field(default_factory=lambda: read_only(np.zeros((0, 3))))
    """``(k, 3)`` m, places of the unpressed gel's face that touched nothing where others did."""
    stopped: bool = False  #: whether something ended its way before the line was at its end.

    @property
    def by_housing(self) -> bool:
        """True if the housing touched the object: something stopped the press, and the gel shows nothing."""
        return self.stopped and not self.met

    @property
    def met(self) -> bool:
        """True if the gel touched anything."""
        return len(self.points) > 0

    @property
    def mean_normal(self) -> FloatArray:
        """``(3,)`` unit, the mean of its normals; where they cancel each other, against the gel."""
        total = self.normals.sum(axis=0)
        length = float(np.linalg.norm(total))
        return np.asarray(total / length if length > 0.0 else -self.stand_from_gel[:3, 2])

    @property
    def normal_spread(self) -> float:
        """Root mean square angle between its normals and their mean, rad; zero for a plane."""
        apart = self.normals - self.mean_normal
        return float(np.sqrt(np.mean(np.sum(apart**2, axis=1)))) if self.met else 0.0


@dataclass(frozen=True, eq=False)
class SeenMask:
    """The object's silhouette in the picture of a camera whose pose is known but for small errors."""

    mask: BoolArray
    """``(rows, columns)`` bool, the object's pixels; holes through which the bench is seen are filled."""
    hidden: BoolArray
    """``(rows, columns)`` bool, pixels of which nothing is known: something may stand before them."""
    stand_from_camera: FloatArray  #: ``(4, 4)``, OpenCV's axes: x right, y down, z forward.
    focal_length: float  #: pixels; the optical axis is in the middle of the picture.
    position_error: float  #: m, one standard deviation per axis of where the camera is.
    rotation_error: float  #: rad, likewise, of how it is turned.
    focal_length_error: float  #: relative.


@dataclass(frozen=True, eq=False)
class ShapeEvidence:
    """All readings of an object's shape."""

    touches: tuple[GuardedTouch, ...]  #: every guarded way, those that met nothing too.
    look: SeenMask | None  #: the silhouette; None where no camera looked, or it saw nothing.
    housing: tuple[float, float]
    """``(x, y)`` m, sides of the sensor's flat housing, whose face lies ``gel_thickness`` behind the gel's;
    what is behind that face for ``housing_depth`` is the sensor's, and free of the object."""
    gel_thickness: float  #: m.
    housing_depth: float  #: m.
    place_error: float  #: m, one standard deviation per axis of where on the support the object was put.
    support_error: float  #: m, one standard deviation of the support's height.
    largest: float  #: m, no side of the object is longer.
    prior_points: FloatArray = field(default_factory=lambda: read_only(np.zeros((0, 3))))
    """``(n, 3)`` points of the surface that the single-view prior predicts, m; no reading."""
    errors: BenchErrors = USUAL
    """standard deviations of the bench; contacts whose poses agree within them are one reading."""

    def __post_init__(self) -> None:
        for touch in self.touches:
            finite = np.isfinite(touch.stand_from_gel).all() and np.isfinite(touch.points).all()
            if not finite or touch.points.shape != touch.normals.shape:
                raise OutOfDomain(
                    f"touch {touch.index} has points of shape {touch.points.shape}, normals of shape "
                    f"{touch.normals.shape}, not all finite; give one finite unit normal a point"
                )

    @property
    def distinct(self) -> tuple[GuardedTouch, ...]:
        """The touches without repetitions: of those at one place that ended alike, the first."""
        return tuple(alike[0] for alike in self._by_place)

    @property
    def repeated(self) -> int:
        """Number of touches that repeat an earlier one at its place: no new evidence."""
        return len(self.touches) - len(self._by_place)

    @property
    def contacts(self) -> tuple[GuardedTouch, ...]:
        """Those distinct touches that met the object."""
        return tuple(touch for touch in self.distinct if touch.met)

    def without(self, contacts: Collection[int]) -> "ShapeEvidence":
        """Leave out some contacts, and every touch that repeats them.

        Args:
            contacts: indices into ``contacts``.
        """
        met = [alike for alike in self._by_place if alike[0].met]
        gone = {id(touch) for k in contacts for touch in met[k]}
        return replace(self, touches=tuple(one for one in self.touches if id(one) not in gone))

    @cached_property
    def _by_place(self) -> tuple[tuple[GuardedTouch, ...], ...]:
        """The touches at each place that ended alike, in order of the first of each."""
        tolerance = PlaceTolerance.from_errors(self.errors, self.gel_thickness)
        found: list[tuple[GuardedTouch, ...]] = []
        for met, housing in ((True, False), (False, True), (False, False)):
            alike = [one for one in self.touches if (one.met, one.by_housing) == (met, housing)]
            poses = np.array([touch.stand_from_gel for touch in alike]).reshape(-1, 4, 4)
            places = group_by_place(poses[:, :3, 3], poses[:, :3, 2], tolerance)
            groups: dict[int, list[GuardedTouch]] = {}
            for place, touch in zip(places, alike, strict=True):
                groups.setdefault(int(place), []).append(touch)
            found += [tuple(group) for group in groups.values()]
        order = {id(touch): k for k, touch in enumerate(self.touches)}
        return tuple(sorted(found, key=lambda group: order[id(group[0])]))

    @property
    def ended_by_housing(self) -> tuple[GuardedTouch, ...]:
        """Those distinct touches that the sensor's housing ended, with nothing in the gel."""
        return tuple(touch for touch in self.distinct if touch.by_housing)

    @property
    def sighted(self) -> bool:
        """True if a camera saw something of the object."""
        return self.look is not None and bool(self.look.mask.any())
