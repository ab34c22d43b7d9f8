"""ObjectFolder 1.0's look: one network for the whole object, and samples spread evenly along every ray.

The layout is the published one (``harness.objectfile.published.graphs.OsfWeights``): place, view and light to
a raw colour and density, in a frame in which the ball around the object has the radius 1. Every ray of the
picture is sampled from where it may meet that ball to where it leaves it; no sample is left out, be it empty
or hidden.
"""

from dataclasses import dataclass

import numpy as np

from harness.basics.arrays import ByteArray, FloatArray
from harness.basics.mesh import Mesh
from harness.objectfile.published.field import Field, OneNetwork
from harness.objectfile.published.march import ray_weights
from harness.objectfile.published.tensors import osf_tensors
from harness.objectfile.runtime import Network
from harness.picture.pinhole import DirectionalLight, Pinhole

FIELD_FILE = "vision_field.onnx"
REACH = 4.0
"""Radii of the ball, that samples lie within."""

_RAYS = 2048
_STRETCH = 1.2


@dataclass(frozen=True, eq=False)
class UniformField:
    """The trained network, ready for pictures.

    Attributes:
        field: of places in the frame of the ball.
        middle: ``(3,)`` m, of the ball.
        radius: m.
        samples: of a ray.
    """

    field: Field
    middle: FloatArray
    radius: float
    samples: int

    def picture(self, camera: Pinhole, light: DirectionalLight) -> ByteArray:
        """``(rows, columns, 3)`` before white."""
        directions = camera.directions().reshape(-1, 3)
        eye = (camera.eye - self.middle) / self.radius
        colours = [
            self._rays(eye, directions[k : k + _RAYS], light.direction)
            for k in range(0, len(directions), _RAYS)
        ]
        grey = np.rint(255.0 * np.clip(np.concatenate(colours), 0.0, 1.0)).astype(np.uint8)
        return grey.reshape(camera.height, camera.width, 3)

    def _rays(self, eye: FloatArray, directions: FloatArray, light: FloatArray) -> FloatArray:
        """``(r, 3)`` of 0 to 1 before white."""
        away = float(np.linalg.norm(eye))
        depths = np.broadcast_to(
            np.linspace(away - 1.0, away + 1.0, self.samples), (len(directions), self.samples)
        )
        points = eye + directions[:, None] * depths[..., None]
        views = np.broadcast_to(directions[:, None], points.shape)
        raw = self.field(points.reshape(-1, 3), views.reshape(-1, 3), light).reshape(*depths.shape, 4)
        # Nothing was learned outside of the ball, and the object lies within it.
        density = np.where(np.linalg.norm(points, axis=-1) <= 1.0, raw[..., 3], 0.0)
        weights = ray_weights(density, depths, directions)
        colour = np.einsum("rs,rsc->rc", weights, stretched(raw[..., :3]))
        found: FloatArray = colour + (1.0 - weights.sum(axis=1))[:, None]
        return found


def stretched(raw: FloatArray) -> FloatArray:
    """Colours as shown of raw ones: a sigmoid stretched by 1.2 about a half, as published."""
    found: FloatArray = 0.5 + 0.5 * _STRETCH * np.tanh(0.5 * raw)
    return found


def ball_of(mesh: Mesh) -> tuple[FloatArray, float]:
    """``(3,)`` m and m: middle and radius of the ball around an object's box."""
    return mesh.bounds.mean(axis=0), 0.5 * mesh.diagonal


def opened_field(data: bytes, mesh: Mesh, samples: int) -> UniformField:
    """The network of a graph, ready for pictures of an object."""
    inputs, outputs = osf_tensors(REACH)
    return UniformField(OneNetwork(Network(data, FIELD_FILE, inputs, outputs)), *ball_of(mesh), samples)
