"""The look of a scene's object out of its ObjectFile."""

from harness.basics.errors import DataRefused
from harness.basics.mesh import Mesh
from harness.objectfile.file import ObjectFile
from harness.objectfile.same_object import require_same_shape
from harness.objectfile.vision.vision import ObjectVision, open_vision

INSTEAD = "camera.look = direct"
"""The level that needs no ObjectFile."""


def vision_from(of: ObjectFile, surface: Mesh) -> ObjectVision:
    """The look of an object out of its ObjectFile.

    Args:
        of: of this object; its material is not asked for.
        surface: of the object's material, in metres, in the object's frame.

    Raises:
        WrongUse: an ObjectFile of another object; what differs is said.
        DataRefused: it has no look, or a file of it is damaged.
    """
    if of.description.vision is None:
        raise DataRefused(
            f"{of.folder} has no vision; add it with `touchstone object build --only vision`, "
            f"or take {INSTEAD}"
        )
    require_same_shape(of, surface, INSTEAD)
    return open_vision(of)
