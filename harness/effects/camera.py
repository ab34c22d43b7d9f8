"""The effects of the scene camera's picture: exact visibility, its light, its own shadow, or networks.

Another light computes no ray of the camera again, and without the shadow no ray towards a light is followed.
"""

from collections.abc import Sequence
from typing import TYPE_CHECKING

from harness.basics.arrays import FloatArray
from harness.basics.errors import DataRefused
from harness.basics.mesh import Mesh
from harness.effects.accuracy import Knob
from harness.objectfile.file import ObjectFile
from harness.picture.pinhole import DirectionalLight, Pinhole
from harness.sim.light.appearance import Appearance
from harness.sim.light.direct_image import DirectImage, LitObject, VisibleSurface, gathered
from harness.sim.solid.walls import walled

if TYPE_CHECKING:
    from harness.objectfile.vision.render import ObjectVision, Rendered

SAMPLES = Knob(
    "camera.samples", (1, 2, 4, 8, 16), "rays a side", "number", 4, "rays a pixel of the camera, each way"
)
LOOK = Knob(
    "camera.look",
    ("network", "direct"),
    "",
    "method",
    "direct",
    "the ObjectFile's networks, one sample a ray; or rays on the mesh",
    removed={"one_sample": "network", "onnx": "network"},
)


def prepare_object(object_appearance: Appearance) -> LitObject:
    """Sort the faces of the object for rays."""
    return LitObject(object_appearance)


def trace_camera(object_lit: LitObject, camera: Pinhole, *, camera_samples: int) -> VisibleSurface:
    """Follow the camera's rays to the surface."""
    return object_lit.seen(camera, camera_samples)


def illuminate(
    object_lit: LitObject, camera_seen: VisibleSurface, camera_lights: Sequence[DirectionalLight]
) -> FloatArray:
    """Compute the light on the visible surface with nothing in its way."""
    return object_lit.falling(camera_seen, camera_lights)


def cast_shadow(
    camera_falling: FloatArray,
    object_lit: LitObject,
    camera_seen: VisibleSurface,
    camera_lights: Sequence[DirectionalLight],
) -> FloatArray:
    """Remove the light that the object itself is in the way of."""
    return object_lit.shadowed(camera_seen, camera_lights, camera_falling)


def gather_image(camera_seen: VisibleSurface, camera_shadow: FloatArray) -> "DirectImage | Rendered":
    """Gather the samples into pixels."""
    return gathered(camera_seen, camera_shadow)


def open_object_vision(
    object_file: ObjectFile, object_mesh: Mesh, object_wall: float | None
) -> "ObjectVision":
    """Open the vision of an ObjectFile.

    Raises:
        WrongUse: an ObjectFile of another object; the message names the difference.
        DataRefused: it has no vision, or a file of it is damaged.
    """
    # Loaded only where pictures come from an ObjectFile.
    from harness.objectfile.same_object import require_same_shape
    from harness.objectfile.vision.render import open_vision

    instead = f"{LOOK.name} = direct"
    if object_file.description.vision is None:
        raise DataRefused(
            f"{object_file.folder} has no vision; add it with `touchstone object build --only vision`, or "
            f"take {instead}"
        )
    require_same_shape(object_file, walled(object_mesh, object_wall), instead)
    return open_vision(object_file)


def render_network(
    object_vision: "ObjectVision", camera: Pinhole, camera_lights: Sequence[DirectionalLight]
) -> "DirectImage | Rendered":
    """Render the picture with the networks of an ObjectFile."""
    return object_vision.lit(camera, camera_lights)
