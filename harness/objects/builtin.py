"""The objects that a scene names with ``builtin:``: household objects, and calibration targets."""

from types import MappingProxyType
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from harness.basics.mesh import Mesh

BUILTIN = "builtin:"
"""Prefix of the name of a built-in object."""

DESCRIPTION = "object.json"
"""The file that makes a folder an ObjectFile; a scene may name such a folder."""

HOUSEHOLD: MappingProxyType[str, str] = MappingProxyType(
    {
        "mug": "ceramic",
        "bowl": "ceramic",
        "plate": "ceramic",
        "pitcher": "polycarbonate",
        "tray": "wood",
        "wrench": "steel",
    }
)
"""Material of each household object unless the scene names another."""

TARGETS: MappingProxyType[str, str] = MappingProxyType({"ball": "steel"})
"""Material of each calibration target."""

MATERIALS: MappingProxyType[str, str] = MappingProxyType({**HOUSEHOLD, **TARGETS})
"""Material of every built-in object."""


def build(name: str, edge: float = 3e-3) -> "Mesh":
    """Build an object in metres, standing on z = 0 about the z axis.

    Args:
        name: a key of ``MATERIALS``.
        edge: distance between neighbouring vertices in m, 0.3 to 10 mm.

    Raises:
        WrongUse: no such object, or an edge out of range.
    """
    # Names are checked before the modelling libraries are imported.
    from harness.objects import household, targets

    if name in TARGETS:
        return targets.BUILDERS[name](edge)
    return household.build(name, edge)
