"""What a network of vision learns from: places of a surface, views, lights, and the light that leaves.

All of it is the direct level's, without noise. Places are as dense on the surface as pixels of pictures
taken from everywhere far away would be; nothing is drawn for what no camera outside can see. What is kept
back for judging, ``HeldOutViews``, is never drawn: neither a light within an angle of one kept back, nor a
place seen within that angle of how a camera kept back sees it.
"""

from dataclasses import dataclass

import numpy as np

from harness.authoring.vision.places import sphere, uniform_about
from harness.basics.arrays import BoolArray, FloatArray
from harness.basics.errors import WrongUse
from harness.basics.mesh import Mesh
from harness.picture.pinhole import DirectionalLight, Pinhole

APART = float(np.radians(3.0))
"""rad between anything learned from and anything judged by."""

FACING = 0.85
"""Share of the lights that are drawn on the side that is seen; the others are from anywhere."""

LEAST_YIELD = 1e-3
"""Minimum fraction of sampled points that are visible; below it the surface cannot be seen from outside."""


@dataclass(frozen=True, eq=False)
class HeldOutViews:
    """Cameras and lights that only judge."""

    cameras: tuple[Pinhole, ...]  #: one for each picture.
    lights: tuple[DirectionalLight, ...]  #: one for each picture.
    apart: float = APART  #: rad that everything else keeps from them.

    def __post_init__(self) -> None:
        if len(self.cameras) != len(self.lights):
            raise WrongUse(
                f"{len(self.cameras)} cameras and {len(self.lights)} lights were given; give one light "
                "a picture"
            )
        if not 0.0 <= self.apart < np.pi / 4.0:
            raise WrongUse(f"{np.degrees(self.apart):g} deg apart were asked for; give 0 to below 45 deg")

    def clear_of_views(self, points: FloatArray, views: FloatArray) -> BoolArray:
        """Which of ``(n, 3)`` places with ``(n, 3)`` unit views, from the eye, are seen otherwise."""
        clear = np.ones(len(points), np.bool_)
        for eye in {tuple(camera.eye.tolist()) for camera in self.cameras}:
            away = points - np.array(eye)
            length = np.linalg.norm(away, axis=1)
            clear &= np.einsum("nx,nx->n", away, views) < np.cos(self.apart) * length
        return clear

    def clear_of_lights(self, lights: FloatArray) -> BoolArray:
        """Which of ``(n, 3)`` unit directions are far enough from every light kept back."""
        if not self.lights:
            return np.ones(len(lights), np.bool_)
        kept = np.stack([light.direction for light in self.lights])
        return np.asarray((lights @ kept.T).max(axis=1) < np.cos(self.apart))


def held_out_pictures(
    mesh: Mesh, count: int, width: int, height: int, seed: int, distance: float = 2.0, apart: float = APART
) -> HeldOutViews:
    """Sample one or more cameras around an object, each with its own light; see ``around``.

    Raises:
        WrongUse: no camera, or a camera inside the object's bounding box.
    """
    if count < 1 or not distance > 0.5:
        raise WrongUse(
            f"{count} pictures from {distance:g} diagonals away were asked for; give one or more, from more "
            "than half a diagonal"
        )
    random = np.random.default_rng([seed, 71])
    cameras = tuple(around(mesh, way, width, height, distance) for way in sphere(count, random))
    # Each light is from its camera's side: a place in the dark judges nothing.
    middle = mesh.bounds.mean(axis=0)
    towards = np.stack([camera.eye - middle for camera in cameras])
    lights = tuple(DirectionalLight(way) for way in uniform_about(towards, random))
    return HeldOutViews(cameras, lights, apart)


def around(mesh: Mesh, way: FloatArray, width: int, height: int, distance: float) -> Pinhole:
    """The camera that sees a whole object from a side.

    Args:
        mesh: of the object.
        way: ``(3,)`` unit, from its box's middle to the camera.
        width: columns of pixels.
        height: rows of pixels.
        distance: of the camera, in diagonals of the object's box; more than a half.
    """
    middle = mesh.bounds.mean(axis=0)
    # Straight from above nothing is up: the least of the axes is then far from the view.
    up = np.eye(3)[2] if abs(way[2]) < 0.99 else np.eye(3)[0]
    # The ball around the box touches the shorter side's edges.
    half = np.tan(np.arcsin(0.5 / distance)) * max(1.0, width / height)
    return Pinhole.looking_at(
        middle + distance * mesh.diagonal * way, middle, up, width, height, 2.0 * float(np.arctan(half))
    )
