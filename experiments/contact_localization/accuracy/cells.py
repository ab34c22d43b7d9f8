"""Runs of a table: which object, seed and conditions, and the scene of each."""

import itertools
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from harness.bench.scene import SceneFile, scene_from_json


@dataclass(frozen=True)
class Cell:
    """Which run.

    Attributes:
        object: its name in the table.
        spacing: ``"close"`` or ``"spread"``.
        gap: ``"default"`` or ``"none"``.
        yaw: ``"known"`` to the estimator or ``"unknown"``.
        seed: of the sites, the world and the draws.
        sound: whether every place is struck too.
        choose: ``"planned"`` contacts, or ``"active"`` ones, chosen one by one.
    """

    object: str
    spacing: str
    gap: str
    yaw: str
    seed: int
    sound: bool = False
    choose: str = "planned"

    @property
    def conditions(self) -> dict[str, str]:
        """What was varied."""
        return {"spacing": self.spacing, "gap": self.gap, "yaw": self.yaw, "choose": self.choose}

    @property
    def name(self) -> str:
        """Of the cell's file; a gap may be a path."""
        gap = self.gap.replace("/", "_")
        plain = f"{self.object}-{self.spacing}-{gap}-{self.yaw}-{self.seed}"
        heard = f"{plain}-sound" if self.sound else plain
        return heard if self.choose == "planned" else f"{heard}-{self.choose}"


def scene_of(cell: Cell, scene: SceneFile) -> SceneFile:
    """The scene of a run: the object turned by an angle of the run's own."""
    turned = np.random.default_rng((cell.seed, 7)).uniform(0.0, 360.0)
    tree = scene.model_dump(mode="json", by_alias=True)
    tree.setdefault("localization", {}).update(spacing=cell.spacing, choose=cell.choose)
    tree["object"]["pose"]["yaw"] = f"{turned:.3f} deg"
    tree["sensors"]["sound"] = cell.sound
    return scene_from_json(tree, "the table")


def cells(
    objects: Sequence[str],
    seeds: Sequence[int],
    spacings: Sequence[str],
    gaps: Sequence[str],
    yaws: Sequence[str],
    sound: bool = False,
    choices: Sequence[str] = ("planned",),
) -> list[Cell]:
    """Every run of a table, one seed of every object before the next: a table that is stopped is even."""
    varied = itertools.product(yaws, gaps, spacings, choices, objects)
    first = [Cell(o, spacing, gap, yaw, 0, sound, choose) for yaw, gap, spacing, choose, o in varied]
    return [replace(cell, seed=seed) for seed in seeds for cell in first]
