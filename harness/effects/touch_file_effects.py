"""The touch of an ObjectFile in a scene: levels of the gel's surface beside rasteriser and skirt.

Sources, beside those of the touch: ``object.file`` (the object's ``ObjectFile``) and ``object.wall`` (m, or
None for a mesh of the material itself); asked for only where the gel's surface comes from the file. Its
networks know the gel, not how deep the object itself reaches: what shadows and printed dots start from,
``touch.height_map``, is the rasteriser's at every level.
"""

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from harness.basics.arrays import FloatArray
from harness.effects.accuracy import Knob, Level
from harness.effects.effect import Compute, Effect, Implementation
from harness.effects.sound_effects import NAMED
from harness.sim.solid.walls import walled

if TYPE_CHECKING:
    from harness.objectfile.touch.touch import ObjectTouch, TouchLevel
    from harness.sim.gel.presses import Presses

Given = Mapping[str, Any]
Levels = Mapping[str, Level]

SHAPES = Knob(
    "touch.shapes",
    ("perceptron", "network", "reference"),
    "",
    "method",
    "reference",
    "the ObjectFile's perceptron, its network of codes, or the rasteriser on the mesh",
)

_NEEDS = ("object.file", "object.mesh", "object.wall", "sensor", "sensor.calibration")


def _presses(given: Given, _levels: Levels) -> "Presses":
    from harness.sim.gel.presses import presses_of

    return presses_of(given["object.mesh"], given["contact.gel_from_object"])


def _opened(level: "TouchLevel") -> Compute:
    def compute(given: Given, _levels: Levels) -> "ObjectTouch":
        # Loaded by those alone who take touch from an ObjectFile.
        from harness.objectfile.touch.level import touch_from

        solid = walled(given["object.mesh"], given["object.wall"])
        skirt = given["sensor.calibration"].header.skirt
        return touch_from(given["object.file"], level, solid, given["sensor"], skirt)

    return compute


def gel_from(level: "TouchLevel") -> Implementation:
    """How ``touch.gel`` comes from a level of the ObjectFile."""
    opened = f"object.touch_{level}"

    def compute(given: Given, _levels: Levels) -> FloatArray:
        surface: FloatArray = given[opened].at(given["contact.presses"])
        return surface

    return Implementation((opened, "contact.presses"), compute, when=NAMED)


FILE_EFFECTS = (
    Effect("contact.presses", ("object.mesh", "contact.gel_from_object"), _presses),
    Effect("object.touch_codes", _NEEDS, _opened("codes"), when=NAMED),
    Effect("object.touch_perceptron", _NEEDS, _opened("perceptron"), when=NAMED),
)
