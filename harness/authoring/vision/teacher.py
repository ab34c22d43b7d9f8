"""A teacher: one network of an object's whole look, taught by the same answers as the tiny ones.

It is made to be measured beside them, along the same rays and samples, on the same pictures kept back
(``docs/decisions/0007-networks-of-a-look-learn-from-the-surface.md``). Networks are distilled from it where
that is asked for.
"""

import importlib.util
import time
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from harness.authoring.training import Laps, Report, train
from harness.authoring.vision.data import HeldOut
from harness.authoring.vision.finish_profiles import TeacherFinish
from harness.authoring.vision.lessons import OPAQUE, draw_for
from harness.authoring.vision.metrics import network_pictures, picture_errors
from harness.authoring.vision.seen import TeacherRecorder, pictures_to_learn, together
from harness.authoring.vision.teacher_pictures import Answers, TeacherRenderer
from harness.authoring.vision.teacher_profiles import TeacherSpec
from harness.basics.cores import own_cores
from harness.basics.errors import WrongUse
from harness.basics.mesh import Mesh
from harness.objectfile.vision.network.network import VisionGrid
from harness.objectfile.vision.settings import RenderSettings
from harness.objectfile.vision.shell import Lattice, grid_of, lattice_of, surface_shell
from harness.objectfile.vision_tensors import Kind
from harness.picture.linear_image import LinearImage
from harness.sim.light.direct_image import LitObject

if TYPE_CHECKING:
    from harness.authoring.vision.teacher_training import TeacherTraining

_WAYS = {
    "": RenderSettings(),
    "two_rays_": RenderSettings(rays=2),
    "one_sample_": RenderSettings(level="one_sample"),
}
"""Of drawing its pictures, by what its errors' names begin with."""


@dataclass(frozen=True, eq=False)
class MadeTeacher:
    """A network of an object's whole look.

    Attributes:
        spec: of it.
        ask: what it answers.
        grid: cells of the lattice that its renderer walks.
        voxel: m, of the shell.
        last_loss: root mean square of colours' errors, as roots of linear light; of pixels' where it was
            finished on pictures.
        seconds: of the processor that its stages took, in this run.
    """

    spec: TeacherSpec
    ask: Answers
    grid: VisionGrid
    voxel: float
    last_loss: float
    seconds: Mapping[str, float]

    def judged(
        self, lit: LitObject, held_out: HeldOut, references: list[LinearImage], threads: int | None = None
    ) -> dict[str, float]:
        """Errors of its pictures, as of the tiny networks; and by two rays along a pixel, and by one sample.

        Args:
            lit: the object.
            held_out: cameras and lights that nothing was learned from.
            references: exact pictures of them.
            threads: None for as many as the process has cores.
        """
        mesh, scale = lit.appearance.mesh, OPAQUE / self.voxel
        renderer = TeacherRenderer(self.ask, mesh, self.grid, self.spec.kind, scale, threads)
        errors: dict[str, float] = {}
        for word, settings in _WAYS.items():
            found = picture_errors(references, network_pictures(renderer, held_out, settings))
            errors |= {f"{word}{name}": value for name, value in found.items()}
        return errors

    @property
    def settings(self) -> dict[str, str | float | int | bool | None]:
        """How it was made."""
        told = {name: value for name, value in asdict(self.spec).items() if name != "finish"}
        later = {} if self.spec.finish is None else asdict(self.spec.finish)
        finish = {f"finish_{name}": value for name, value in later.items()}
        return told | finish | {"last_loss": self.last_loss}


def teacher_file(folder: Path, kind: Kind) -> Path:
    """Beside an object's folder, whose files are all of the object: the checkpoint, which is the teacher."""
    return folder.with_name(f"{folder.name}.teacher-{kind}.npz")


def require_torch() -> None:
    """Refuse where a teacher cannot be trained.

    Raises:
        WrongUse: torch is not installed.
    """
    if importlib.util.find_spec("torch") is None:
        raise WrongUse(
            "a teacher is trained by torch, which is not installed; install the extra 'author', or leave "
            "--teacher and --distill out: the networks of an object need neither"
        )


def made_teacher(
    lit: LitObject,
    held_out: HeldOut,
    spec: TeacherSpec,
    seed: int,
    checkpoint: Path,
    report: Report,
    threads: int | None = None,
) -> MadeTeacher:
    """Train a teacher, or go on with one that was stopped; on one thread to the same bits.

    Args:
        lit: the object.
        held_out: what nothing is learned from.
        spec: of the network.
        seed: of all that is drawn.
        checkpoint: file that a killed training goes on from; it is left there.
        report: told of progress.
        threads: of torch, where there is no GPU; None for as many as the process has cores.

    Raises:
        WrongUse: torch is not installed.
        DataRefused: a checkpoint that cannot be gone on from.
    """
    require_torch()
    # Heavy, and only here: the tiny networks are made without it.
    import torch

    torch.set_num_threads(threads or own_cores())
    laps, walked = Laps(time.process_time), _Walked.of(lit.appearance.mesh)
    making = _Making(lit, held_out, spec, seed, walked, report, laps)
    training = making.taught(checkpoint)
    loss = training.losses[-1]
    if spec.finish is not None:
        loss = making.finished(training, spec.finish, finished_file(checkpoint))
    return MadeTeacher(spec, training.ask, walked.grid, walked.voxel, loss, laps.seconds)


@dataclass(frozen=True, eq=False)
class _Walked:
    """What its rays go through: a lattice, its cells with some surface, m of a voxel of their shell."""

    lattice: Lattice
    grid: VisionGrid
    voxel: float

    @classmethod
    def of(cls, mesh: Mesh) -> "_Walked":
        lattice = lattice_of(mesh)
        shell = surface_shell(mesh, lattice)
        return cls(lattice, grid_of(shell, lattice), shell.voxel)


@dataclass(frozen=True, eq=False)
class _Making:
    """What both stages of a teacher have in common."""

    lit: LitObject
    held_out: HeldOut
    spec: TeacherSpec
    seed: int
    walked: _Walked
    report: Report
    laps: Laps

    def taught(self, checkpoint: Path) -> "TeacherTraining":
        """By the surface."""
        from harness.authoring.vision.teacher_training import TeacherTraining

        spec, lattice = self.spec, self.walked.lattice
        self.report("drawing places of a teacher", 0.0)
        drawn = draw_for(spec.kind, self.lit, spec.places, self.walked.voxel, self.seed, self.held_out)
        self.laps.lap("places")
        extent = lattice.cell * max(lattice.sides)
        training = TeacherTraining(spec, np.array(lattice.low), extent, *drawn, self.seed)
        train(training, training.epochs, checkpoint, self.report)
        self.laps.lap("training")
        return training

    def finished(self, training: "TeacherTraining", finish: TeacherFinish, checkpoint: Path) -> float:
        """On pictures; the last loss."""
        from harness.authoring.vision.teacher_finish import Finishing

        mesh, scale = self.lit.appearance.mesh, OPAQUE / self.walked.voxel
        pictures = pictures_to_learn(self.lit, finish, self.seed, self.held_out, self.report)
        recorder = TeacherRecorder(training.ask, mesh, self.walked.grid, self.spec.kind, scale)
        rays = together([recorder.seen(*each) for each in pictures])
        self.laps.lap("pictures")
        finishing = Finishing(training, self.spec, finish, rays, scale, self.seed)
        train(finishing, finishing.epochs, checkpoint, self.report)
        self.laps.lap("finishing")
        return finishing.losses[-1]


def finished_file(checkpoint: Path) -> Path:
    """Beside a teacher's checkpoint: of what it learned from pictures then."""
    return checkpoint.with_name(f"{checkpoint.stem}-pictures{checkpoint.suffix}")
