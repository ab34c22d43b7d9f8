"""Which runs measure scale estimation: objects, gaps, looks, and whether the shape is known."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from experiments.scale_estimation.section import Scale
from harness.bench.scene import SceneFile, scene_from_json

LOOKING = ("yes", "no")
"""Whether the camera looks first; where it does not, the first contacts are made blindly."""

DRAWN = ("known", "unknown")
"""Whether the arm explores an object whose shape it knows. Where it does, the rows of objects never drawn are
answered from the same readings; where not, they are from contacts that nobody could plan on a drawing."""


@dataclass(frozen=True)
class ScaleCell:
    """Which run."""

    object: str
    gap: str
    seed: int
    look: str
    shape: str = "known"

    @property
    def name(self) -> str:
        """Of the run's file; a gap may be a path."""
        drawn = "" if self.shape == "known" else f"-{self.shape}"
        return f"{self.object}-{self.gap.replace('/', '_')}-{self.look}{drawn}-{self.seed}"

    @property
    def conditions(self) -> dict[str, str]:
        """What was varied."""
        return {"gap": self.gap, "look": self.look, "shape": self.shape}


def cells(
    objects: Sequence[str], seeds: Sequence[int], chosen: Mapping[str, Sequence[str]]
) -> list[ScaleCell]:
    """All of them, an object's after the other's of one seed."""
    return [
        ScaleCell(name, gap, seed, look, shape)
        for seed in seeds
        for gap in chosen["gap"]
        for look in chosen["look"]
        for shape in chosen["shape"]
        for name in objects
    ]


def scene_of(scene: SceneFile, cell: ScaleCell) -> SceneFile:
    """The scene of a table's object, its size hidden and every sense asked for."""
    tree = scene.model_dump(mode="json", by_alias=True)
    tree["object"]["scale"] = "hidden"
    tree["sensors"].update(camera=cell.look == "yes", sound=True, touch=True)
    # The paper's networks answer a run and change nothing of it: recordings do not depend on them.
    tree.setdefault(Scale.table, {}).update(shape=cell.shape, paper_networks=None)
    return scene_from_json(tree, cell.name)
