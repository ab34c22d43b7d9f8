"""The runs that measure contact localization."""

from dataclasses import dataclass

import numpy as np

from experiments.contact_localization.section import Localization
from harness.bench.scene import SceneFile, scene_from_json
from harness.experiment.in_process import RunCell


@dataclass(frozen=True)
class ContactCell(RunCell):
    """One run."""

    spacing: str  #: ``"close"`` or ``"spread"``.
    yaw: str = "known"  #: ``"known"`` to the estimator or ``"unknown"``.
    sound: bool = False  #: whether every contact is struck too.
    choose: str = "planned"  #: ``"planned"`` contacts, or ``"active"`` ones, chosen one by one.

    @property
    def conditions(self) -> dict[str, str]:
        """Conditions of the run by name."""
        return {"spacing": self.spacing, "gap": self.gap, "yaw": self.yaw, "choose": self.choose}

    @property
    def name(self) -> str:
        """Name of the run's file and folder."""
        gap = self.gap.replace("/", "_")
        sound = "-sound" if self.sound else ""
        choose = "" if self.choose == "planned" else f"-{self.choose}"
        return f"{self.object}-{self.spacing}-{gap}-{self.yaw}-{self.seed}{sound}{choose}"

    def create_scene(self, scene: SceneFile) -> SceneFile:
        """Create the scene of the run: the object is rotated by an angle of its seed."""
        yaw = np.random.default_rng((self.seed, 7)).uniform(0.0, 360.0)
        tree = scene.model_dump(mode="json", by_alias=True)
        tree.setdefault(Localization.table, {}).update(spacing=self.spacing, choose=self.choose)
        tree["object"]["pose"]["yaw"] = f"{yaw:.3f} deg"
        tree["sensors"]["sound"] = self.sound
        return scene_from_json(tree, self.name)
