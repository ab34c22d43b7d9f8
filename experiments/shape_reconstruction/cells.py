"""The runs that measure shape reconstruction: objects, gaps, and where presses lead."""

from dataclasses import dataclass

from experiments.shape_reconstruction.section import ShapeRun
from harness.bench.scene import SceneFile, scene_from_json
from harness.experiment.in_process import RunCell
from harness.experiment.subjects import REAL

CHOICES = ("planned", "random", "farthest", "active")
"""Values of ``[shape] choose``."""

PRESSES = (8, 16, 32)
"""Numbers of presses that a run is answered from; the last is how many it makes."""

MESHES = {
    **REAL,
    "mustard": ("meshes/ycb_sim/006_mustard_bottle/006_mustard_bottle.obj", "m", "plastic"),
    "bleach": ("meshes/ycb_ocrtoc/bleach_cleanser/textured.obj", "m", "plastic"),
    "coffeemug": ("meshes/contactdb_objects/coffeemug.stl", "m", "ceramic"),
    "banana": ("meshes/ycb_isaac/011_banana/textured.obj", "cm", "plastic"),
    "drill": ("meshes/ycb_sim/035_power_drill/035_power_drill.obj", "m", "plastic"),
    "hammer": ("meshes/contactdb_objects/hammer.stl", "m", "steel"),
    "lightbulb": ("meshes/contactdb_objects/lightbulb.stl", "m", "glass"),
    "fryingpan": ("meshes/contactdb_objects/fryingpan.stl", "m", "steel"),
    "scissors": ("meshes/ycb_ocrtoc/scissors/textured.obj", "m", "steel"),
}
"""Real meshes of a table: file, unit and material. Banana, drill, hammer and scissors
are of no class of the family."""


@dataclass(frozen=True)
class ShapeCell(RunCell):
    """One run."""

    choose: str  #: level of ``CHOICES``.

    def create_scene(self, scene: SceneFile) -> SceneFile:
        """Create the scene of the run, with camera and gel.

        The number of presses is that of its table ``[shape]``, or ``PRESSES[-1]`` without one.
        """
        tree = scene.model_dump(mode="json", by_alias=True)
        tree["sensors"].update(camera=True, sound=False, touch=True)
        # Recordings do not depend on the folders that only answers read.
        own = {"choose": self.choose, "library": None, "pcn": None}
        tree.setdefault(ShapeRun.table, {"presses": PRESSES[-1]}).update(own)
        return scene_from_json(tree, self.name)
