"""The runs that measure scale estimation."""

from dataclasses import dataclass

from experiments.scale_estimation.section import Scale
from harness.bench.scene import SceneFile, scene_from_json
from harness.experiment.in_process import RunCell

LOOKING = ("yes", "no")
"""Whether the camera looks first; where it does not, the first contacts are made blindly."""

DRAWN = ("known", "unknown")
"""Whether the arm explores an object whose shape it knows. Where it does, the rows of objects never drawn are
answered from the same readings; where not, they are from contacts that nobody could plan on a drawing."""


@dataclass(frozen=True)
class ScaleCell(RunCell):
    """One run."""

    look: str  #: level of ``LOOKING``.
    shape: str = "known"  #: level of ``DRAWN``.

    @property
    def name(self) -> str:
        """Name of the run's file and folder."""
        shape = "" if self.shape == "known" else f"-{self.shape}"
        return f"{self.object}-{self.gap.replace('/', '_')}-{self.look}{shape}-{self.seed}"

    def create_scene(self, scene: SceneFile) -> SceneFile:
        """Create the scene of the run: the size is hidden and every sense is used."""
        tree = scene.model_dump(mode="json", by_alias=True)
        tree["object"]["scale"] = "hidden"
        tree["sensors"].update(camera=self.look == "yes", sound=True, touch=True)
        # The paper's networks answer a run and change nothing of it: recordings do not depend on them.
        tree.setdefault(Scale.table, {}).update(shape=self.shape, paper_networks=None)
        return scene_from_json(tree, self.name)
