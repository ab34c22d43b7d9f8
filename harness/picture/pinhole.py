"""A camera without lens errors, and a light from far away: what every level of vision is asked with.

Frames: ``camera`` is OpenCV's, x right, y down, z forward; ``object`` is that of what is
pictured, in metres: the mesh file's of an object, the world's of a bench.
A place in the picture is (x, y) in pixels from the upper left corner: the centre of the pixel of row i and
column j is (j + 0.5, i + 0.5).
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from harness.basics.arrays import FloatArray, read_only
from harness.basics.errors import OutOfDomain
from harness.basics.geometry import apply, inverse, transform

Vector = FloatArray | Sequence[float]
"""Three numbers, however they are written."""

_RIGID_TOLERANCE = 1e-6

_PARALLEL = 1e-6
"""Sine of the least angle between the view and what is up: below it nothing says how the picture turns."""


@dataclass(frozen=True, eq=False)
class Pinhole:
    """Where a picture is taken from, and how large."""

    width: int  #: columns of pixels, one or more.
    height: int  #: rows of pixels, one or more.
    focal_px: float  #: focal length in pixels, greater than zero; pixels are square.
    centre_px: tuple[float, float]  #: (x, y) of the optical axis in the picture, pixels.
    object_from_camera: FloatArray  #: ``(4, 4)`` rigid, metres.

    def __post_init__(self) -> None:
        if self.width < 1 or self.height < 1:
            raise OutOfDomain(
                f"a picture of {self.width} x {self.height} pixels cannot be taken; ask for one or more "
                "each way"
            )
        if not (np.isfinite(self.focal_px) and self.focal_px > 0.0):
            raise OutOfDomain(
                f"a focal length of {self.focal_px!r} px was asked for; give one greater than zero"
            )
        if not np.isfinite(self.centre_px).all() or len(self.centre_px) != 2:
            raise OutOfDomain(f"the axis is at {self.centre_px} px of the picture; give two finite numbers")
        pose = np.array(self.object_from_camera, dtype=np.float64)
        _require_rigid(pose)
        object.__setattr__(self, "object_from_camera", read_only(pose))

    @classmethod
    def looking_at(
        cls,
        eye: Vector,
        target: Vector,
        up: Vector,
        width: int,
        height: int,
        field_of_view: float,
    ) -> "Pinhole":
        """A camera that has a place of the object in the middle of its picture.

        Args:
            eye: ``(3,)`` m in the object's frame: where the camera is.
            target: ``(3,)`` m in the object's frame: what is in the middle.
            up: ``(3,)`` of any length: what is up in the picture, as far as the view allows.
            width: columns of pixels.
            height: rows of pixels.
            field_of_view: rad across the picture's width, from its left edge to its right; in (0, pi).

        Raises:
            OutOfDomain: the eye is at the target, up is zero or along the view, or an angle out of range.
        """
        if not 0.0 < field_of_view < np.pi:
            raise OutOfDomain(
                f"a field of view of {np.degrees(field_of_view):g} deg was asked for; "
                "it is between 0 and 180 deg"
            )
        origin, to = _three(eye, "the camera's place"), _three(target, "what the camera looks at")
        forward = unit_vector(to - origin, "the way from the camera to what it looks at")
        upward = unit_vector(up, "what is up in the picture")
        right = np.cross(forward, upward)
        if np.linalg.norm(right) < _PARALLEL:
            raise OutOfDomain(
                f"up is {upward.tolist()}, along the view {forward.tolist()}: the picture could be turned "
                "any way; give another direction for up"
            )
        right /= np.linalg.norm(right)
        # Crossed anew: up and the view need not have been perpendicular.
        rotation = np.column_stack([right, np.cross(forward, right), forward])
        focal = 0.5 * width / float(np.tan(0.5 * field_of_view))
        return cls(width, height, focal, (0.5 * width, 0.5 * height), transform(rotation, origin))

    @property
    def eye(self) -> FloatArray:
        """``(3,)`` m: where the camera is, in the object's frame; every ray begins here."""
        return self.object_from_camera[:3, 3]

    @property
    def forward(self) -> FloatArray:
        """``(3,)`` unit: the optical axis, in the object's frame."""
        return self.object_from_camera[:3, 2]

    @property
    def pixels(self) -> int:
        """How many the picture has."""
        return self.width * self.height

    @property
    def field_of_view(self) -> float:
        """Rad across the picture's width."""
        left, right = self.centre_px[0], self.width - self.centre_px[0]
        return float(np.arctan(left / self.focal_px) + np.arctan(right / self.focal_px))

    @cached_property
    def camera_from_object(self) -> FloatArray:
        """``(4, 4)`` rigid, metres."""
        return read_only(inverse(self.object_from_camera))

    def directions(self, offset: tuple[float, float] = (0.5, 0.5)) -> FloatArray:
        """Where every pixel looks.

        Args:
            offset: (x, y) in the pixel, from its upper left corner: 0 to 1.

        Returns:
            ``(height, width, 3)`` unit, in the object's frame.
        """
        x, y = np.meshgrid(np.arange(self.width) + offset[0], np.arange(self.height) + offset[1])
        return self.directions_at(np.stack([x, y], axis=-1))

    def directions_at(self, places: FloatArray) -> FloatArray:
        """``(..., 3)`` unit, in the object's frame: where ``(..., 2)`` places (x, y) in the picture look."""
        in_camera = np.ones((*places.shape[:-1], 3))
        in_camera[..., :2] = (places - np.array(self.centre_px)) / self.focal_px
        in_camera /= np.linalg.norm(in_camera, axis=-1, keepdims=True)
        turned: FloatArray = in_camera @ self.object_from_camera[:3, :3].T
        return turned

    def project(self, points: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Where points of the object are in the picture; inside it or not.

        Args:
            points: ``(n, 3)`` m in the object's frame.

        Returns:
            ``(n, 2)`` places (x, y) in pixels, and ``(n,)`` depth in m: z in the camera's frame, which is
            not the distance from the eye.

        Raises:
            OutOfDomain: a point that is not in front of the camera, or not finite.
        """
        finite = np.isfinite(points)
        in_camera = apply(self.camera_from_object, np.where(finite, points, 0.0))
        depth = in_camera[:, 2]
        unseen = (depth <= 0.0) | ~np.all(finite, axis=1)
        if unseen.any():
            raise OutOfDomain(
                f"{int(unseen.sum())} of {len(points)} points are not in front of the camera (depth "
                f"{depth[unseen].min():g} m, or not finite); ask for those of positive depth only"
            )
        places: FloatArray = self.focal_px * in_camera[:, :2] / depth[:, None] + np.array(self.centre_px)
        return places, depth

    def resized(self, width: int, height: int) -> "Pinhole":
        """The same view in other pixels; the picture's width keeps its angle, and so does its middle."""
        scale = width / self.width
        centre = (self.centre_px[0] * scale, (self.centre_px[1] - 0.5 * self.height) * scale + 0.5 * height)
        return Pinhole(width, height, self.focal_px * scale, centre, self.object_from_camera)


@dataclass(frozen=True, eq=False)
class DirectionalLight:
    """A lamp so far away that its rays are parallel, of the same white everywhere.

    A white matt surface (albedo 1) that faces it has the radiance ``irradiance / pi``: with pi, the
    default, a picture's value is what a surface reflects of all that falls on it.
    """

    direction: FloatArray
    """``(3,)`` unit, in the object's frame, from the object *towards* the light; a vector of any length but
    zero is made unit."""
    irradiance: float = float(np.pi)
    """on a surface that faces the light, linear, zero or more; pi makes white 1."""

    def __post_init__(self) -> None:
        object.__setattr__(self, "direction", read_only(unit_vector(self.direction, "the way to the light")))
        if not (np.isfinite(self.irradiance) and self.irradiance >= 0.0):
            raise OutOfDomain(
                f"a light of irradiance {self.irradiance!r} was asked for; give zero or more "
                "(pi makes white 1)"
            )


def unit_vector(vector: Vector, meaning: str) -> FloatArray:
    """Divide ``(3,)`` by its length; ``meaning`` names it in messages.

    Raises:
        OutOfDomain: the vector is not three finite numbers, or has no length.
    """
    given = _three(vector, meaning)
    # Divided by the largest first: a square of 1e-200 is zero and one of 1e200 no number.
    most = float(np.abs(given).max())
    if most == 0.0:
        raise OutOfDomain(f"{meaning} is zero and has no direction; give a vector that has a length")
    scaled = given / most
    unit: FloatArray = scaled / np.linalg.norm(scaled)
    return unit


def _three(vector: Vector, meaning: str) -> FloatArray:
    given = np.array(vector, dtype=np.float64)
    if given.shape != (3,) or not np.isfinite(given).all():
        raise OutOfDomain(f"{meaning} is {np.asarray(vector).tolist()}; give three finite numbers")
    return given


def _require_rigid(pose: FloatArray) -> None:
    if pose.shape != (4, 4) or not np.isfinite(pose).all():
        raise OutOfDomain(f"a camera's pose has the shape {pose.shape}; give a finite (4, 4) transform")
    rotation = pose[:3, :3]
    apart = float(np.abs(rotation.T @ rotation - np.eye(3)).max())
    last = np.array_equal(pose[3], [0.0, 0.0, 0.0, 1.0])
    if apart > _RIGID_TOLERANCE or np.linalg.det(rotation) < 0.0 or not last:
        raise OutOfDomain(
            f"a camera's pose is off a rigid transform by {apart:.3g} (or mirrored, or its last row is not "
            f"0 0 0 1); its rotation must be orthonormal and right-handed, to {_RIGID_TOLERANCE:g}"
        )
