"""The touch of an ObjectFile in a scene: a level of the gel's surface like the rasteriser's.

Sources, beside those of the touch: ``object.file`` (the object's ``ObjectFile``) and ``object.wall`` (m, or
None for a mesh of the material itself); asked for only where the gel's surface comes from the file. Its
networks know the gel, not how deep the object itself reaches: what shadows and printed dots start from,
``touch.height_map``, is the rasteriser's at every level.
"""

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from harness.basics.arrays import FloatArray
from harness.effects.accuracy import Knob, Level
from harness.effects.effect import Effect, Implementation
from harness.effects.sound_effects import NAMED
from harness.sim.solid.walls import walled

if TYPE_CHECKING:
    from harness.objectfile.touch.touch import ObjectTouch
    from harness.sim.gel.presses import Presses

Given = Mapping[str, Any]
Levels = Mapping[str, Level]

SHAPES = Knob(
    "touch.shapes",
    ("network", "reference"),
    "",
    "method",
    "reference",
    "the ObjectFile's network of codes, or the rasteriser on the mesh",
    removed={"perceptron": "network"},
)

_NEEDS = ("object.file", "object.mesh", "object.wall", "sensor", "sensor.calibration")


def _presses(given: Given, _levels: Levels) -> "Presses":
    from harness.sim.gel.presses import presses_of

    return presses_of(given["object.mesh"], given["contact.gel_from_object"])


def _codes(given: Given, _levels: Levels) -> "ObjectTouch":
    # Loaded by those alone who take touch from an ObjectFile.
    from harness.objectfile.touch.level import require_own_touch
    from harness.objectfile.touch.touch import open_touch

    solid = walled(given["object.mesh"], given["object.wall"])
    skirt = given["sensor.calibration"].header.skirt
    require_own_touch(given["object.file"], solid, given["sensor"], skirt)
    return open_touch(given["object.file"])


def _gel(given: Given, _levels: Levels) -> FloatArray:
    surface: FloatArray = given["object.touch_codes"].at(given["contact.presses"])
    return surface


GEL_FROM_CODES = Implementation(("object.touch_codes", "contact.presses"), _gel, when=NAMED)
"""``touch.gel`` from the codes of an ObjectFile."""

FILE_EFFECTS = (
    Effect("contact.presses", ("object.mesh", "contact.gel_from_object"), _presses),
    Effect("object.touch_codes", _NEEDS, _codes, when=NAMED),
)
