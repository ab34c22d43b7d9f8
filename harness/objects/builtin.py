"""Everything a scene may name with ``builtin:``: household objects, and targets of calibrations."""

from types import MappingProxyType

from harness.basics.mesh import Mesh
from harness.objects import household, targets

MATERIALS: MappingProxyType[str, str] = MappingProxyType({**household.MATERIALS, **targets.MATERIALS})
"""What each is made of unless the scene says otherwise."""


def build(name: str, edge: float = 3e-3) -> Mesh:
    """One of them in metres, standing on z = 0 about the z axis.

    Raises:
        WrongUse: no such object, or an edge out of range.
    """
    if name in targets.MATERIALS:
        return targets.build_target(name, edge)
    return household.build(name, edge)


DESCRIPTION = "object.json"
"""The file that makes a folder an ObjectFile; a scene may name such a folder."""
