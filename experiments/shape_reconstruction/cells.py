"""The runs that measure shape reconstruction: objects, gaps, and where presses lead."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from experiments.shape_reconstruction.section import ShapeRun
from harness.bench.scene import SceneFile, scene_from_json

CHOICES = ("planned", "random", "farthest", "active")
"""Values of ``[shape] choose``."""

PRESSES = (8, 16, 32)
"""Numbers of presses that a run is answered from; the last is how many it makes."""

MORE_OBJECTS = {
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
"""Real meshes besides those of every experiment: file, unit and material. Banana, drill, hammer and scissors
are of no class of the family."""


@dataclass(frozen=True)
class ShapeCell:
    """One run."""

    object: str
    gap: str
    seed: int
    choose: str

    @property
    def name(self) -> str:
        """Name of the run's file; a gap may be a path."""
        return f"{self.object}-{self.gap.replace('/', '_')}-{self.choose}-{self.seed}"

    @property
    def conditions(self) -> dict[str, str]:
        """Conditions of the run by name."""
        return {"gap": self.gap, "choose": self.choose}


def cells(
    objects: Sequence[str], seeds: Sequence[int], chosen: Mapping[str, Sequence[str]]
) -> list[ShapeCell]:
    """List all runs, those of one seed together."""
    return [
        ShapeCell(name, gap, seed, choose)
        for seed in seeds
        for gap in chosen["gap"]
        for choose in chosen["choose"]
        for name in objects
    ]


def scene_of(scene: SceneFile, cell: ShapeCell) -> SceneFile:
    """Create the scene of a run, with camera and gel.

    It has as many presses as its table ``[shape]`` states, ``PRESSES[-1]`` without one.
    """
    tree = scene.model_dump(mode="json", by_alias=True)
    tree["sensors"].update(camera=True, sound=False, touch=True)
    # Recordings do not depend on the folders that only answers read.
    own = {"choose": cell.choose, "library": None, "pcn": None}
    tree.setdefault(ShapeRun.table, {"presses": PRESSES[-1]}).update(own)
    return scene_from_json(tree, cell.name)
