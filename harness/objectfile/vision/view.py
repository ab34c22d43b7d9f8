"""From where an object is looked at: a camera and a light where none is said, and what cannot be."""

import numpy as np

from harness.basics.arrays import FloatArray
from harness.basics.errors import OutOfDomain
from harness.basics.faces.ray_mesh import RayMesh
from harness.basics.geometry import rotation_about, transform
from harness.basics.mesh import Mesh
from harness.objectfile.vision.coverage import is_closed
from harness.picture.pinhole import DirectionalLight, Pinhole, Vector

FIELD_OF_VIEW = float(np.radians(40.0))

MOST_SIDE = 8192
"""Pixels along a side of a picture."""

MOST_PIXELS = 2**22
"""Of a picture: 2048 x 2048."""

_FROM = np.array([0.5, -0.75, 0.45])
"""Towards the eye, where nobody says from where: in front, a little to the right, from above."""

_MARGIN = 1.08
"""Of the ball around the object's box, that a picture shows."""

_LOOKS = 15
"""Rays that tell whether an eye is within a closed surface: odd, and more than one that grazes an edge."""


def require_size(width: int, height: int, rays: int = 1) -> None:
    """Refuse pictures that are none, or larger than is drawn.

    Args:
        width: columns of pixels.
        height: rows of pixels.
        rays: along a pixel; each counts as a pixel.

    Raises:
        OutOfDomain: naming the limit.
    """
    across, down = rays * width, rays * height
    if not (1 <= across <= MOST_SIDE and 1 <= down <= MOST_SIDE) or across * down > MOST_PIXELS:
        each = f" with {rays} x {rays} rays in each" if rays > 1 else ""
        raise OutOfDomain(
            f"a picture of {width} x {height} pixels{each} was asked for; each side has 1 to {MOST_SIDE} and "
            f"all together at most {MOST_PIXELS}, as 2048 x 2048 has: ask for fewer"
        )


def camera_for(
    mesh: Mesh,
    width: int,
    height: int,
    eye: Vector | None = None,
    target: Vector | None = None,
    up: Vector | None = None,
    field_of_view: float = FIELD_OF_VIEW,
) -> Pinhole:
    """A camera on an object, with what is not said chosen by the object's size.

    Args:
        mesh: of the object, in metres.
        width: columns of pixels.
        height: rows of pixels.
        eye: ``(3,)`` m, object frame; None for so far from the target that the object fills the picture.
        target: ``(3,)`` m, what is in the picture's middle; None for the middle of the object's box.
        up: ``(3,)`` what is up in the picture; None for z, or y where the camera looks along z.
        field_of_view: rad across the picture's width.

    Raises:
        OutOfDomain: no such picture, or a camera without a direction.
    """
    require_size(width, height)
    middle = mesh.bounds.mean(axis=0) if target is None else np.asarray(target, np.float64)
    if eye is None:
        # The ball around the object's box fills the shorter side of the picture.
        half = np.arctan(np.tan(0.5 * field_of_view) * min(1.0, height / width))
        with np.errstate(divide="ignore"):  # an angle of none is refused where the camera is made
            distance = float(0.5 * _MARGIN * mesh.diagonal / np.sin(half))
        eye = middle + distance * _FROM / np.linalg.norm(_FROM)
    if up is None:
        away = np.asarray(eye, np.float64) - middle
        # Along z nothing of z is up; beside it the picture would turn with the least change of the eye.
        is_steep = np.hypot(*away[:2]) < 1e-3 * np.abs(away[2])
        up = (0.0, 1.0, 0.0) if is_steep else (0.0, 0.0, 1.0)
    return Pinhole.looking_at(eye, middle, up, width, height, field_of_view)


def light_for(camera: Pinhole) -> DirectionalLight:
    """A lamp over the photographer's left shoulder."""
    right, down, forward = camera.object_from_camera[:3, :3].T
    return DirectionalLight(-forward - 0.7 * down - 0.5 * right)


def turned(
    camera: Pinhole, light: DirectionalLight, about: FloatArray, angle: float
) -> tuple[Pinhole, DirectionalLight]:
    """Camera and light carried about the object's z axis, as if the object were turned the other way.

    Args:
        camera: before.
        light: before.
        about: ``(3,)`` m, a place of the axis.
        angle: rad, counterclockwise seen from above.
    """
    rotation = rotation_about(np.array([0.0, 0.0, 1.0]), angle)
    pose = transform(rotation, about - rotation @ about) @ camera.object_from_camera
    moved = Pinhole(camera.width, camera.height, camera.focal_px, camera.centre_px, pose)
    return moved, DirectionalLight(rotation @ light.direction, light.irradiance)


def require_outside(mesh: Mesh, eye: FloatArray) -> None:
    """Refuse an eye within the material of a closed surface; an open one has no inside.

    Args:
        mesh: in metres, outward.
        eye: ``(3,)`` m, object frame.

    Raises:
        OutOfDomain: where it is, and how large the object is.
    """
    low, high = mesh.bounds
    if (eye < low).any() or (eye > high).any() or not is_closed(mesh):
        return
    ways = np.random.default_rng(0).standard_normal((_LOOKS, 3))
    hits = RayMesh(mesh).first_hits(eye, ways)
    met = hits.face >= 0
    leaving = np.einsum("nx,nx->n", mesh.face_normals[hits.face[met]], ways[met]) > 0.0
    if 2 * np.count_nonzero(leaving) > _LOOKS:
        x, y, z = 1e3 * eye
        sides = " x ".join(f"{side * 1e3:.4g}" for side in high - low)
        raise OutOfDomain(
            f"the camera is at ({x:.4g}, {y:.4g}, {z:.4g}) mm, within the object, whose box of {sides} mm "
            f"has its middle at {', '.join(f'{each * 1e3:.4g}' for each in 0.5 * (low + high))} mm; "
            "say a place outside of it, in metres"
        )
