"""ObjectFolder 1.0's look: one network for the whole object, and samples spread evenly along every ray.

The layout is the published one (``harness.authoring.published.modules.Osf``): place, view and light to
a raw colour and density, in a frame in which the ball around the object has the radius 1. Every ray of the
picture is sampled from where it may meet that ball to where it leaves it; no sample is left out, be it empty
or hidden.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from harness.basics.arrays import ByteArray, FloatArray
from harness.basics.mesh import Mesh
from harness.objectfile.published.look import OsfNetwork, osf_tensors
from harness.objectfile.published.volume_render import render_rays, stretched_sigmoid
from harness.objectfile.runtime import Network
from harness.picture.pinhole import DirectionalLight, Pinhole

FIELD_FILE = "vision_field.onnx"
REACH = 4.0
"""Radii of the ball, that samples lie within."""

RawField = Callable[[FloatArray, FloatArray, FloatArray], FloatArray]
"""``(n, 3)`` points and views and a ``(3,)`` light to ``(n, 4)`` raw red, green, blue and density."""


@dataclass(frozen=True, eq=False)
class UniformField:
    """The trained network, ready for pictures.

    Attributes:
        field: of places in the frame of the ball.
        middle: ``(3,)`` m, of the ball.
        radius: m.
        samples: of a ray.
    """

    field: RawField
    middle: FloatArray
    radius: float
    samples: int

    def picture(self, camera: Pinhole, light: DirectionalLight) -> ByteArray:
        """``(rows, columns, 3)`` before white."""
        directions = camera.directions().reshape(-1, 3)
        eye = (camera.eye - self.middle) / self.radius
        away = float(np.linalg.norm(eye))

        def shown(points: FloatArray, views: FloatArray) -> tuple[FloatArray, FloatArray]:
            raw = self.field(points, views, light.direction)
            # Nothing was learned outside of the ball, and the object lies within it.
            density = np.where(np.linalg.norm(points, axis=-1) <= 1.0, raw[:, 3], 0.0)
            return density, stretched_sigmoid(raw[:, :3])

        depths = np.linspace(away - 1.0, away + 1.0, self.samples)
        colour, cover = render_rays(shown, eye, directions, depths)
        white = colour + (1.0 - cover)[:, None]
        grey = np.rint(255.0 * np.clip(white, 0.0, 1.0)).astype(np.uint8)
        return grey.reshape(camera.height, camera.width, 3)


def ball_of(mesh: Mesh) -> tuple[FloatArray, float]:
    """``(3,)`` m and m: middle and radius of the ball around an object's box."""
    return mesh.bounds.mean(axis=0), 0.5 * mesh.diagonal


def opened_field(data: bytes, mesh: Mesh, samples: int) -> UniformField:
    """The network of a graph, ready for pictures of an object."""
    inputs, outputs = osf_tensors(REACH)
    return UniformField(OsfNetwork(Network(data, FIELD_FILE, inputs, outputs)).raw, *ball_of(mesh), samples)
