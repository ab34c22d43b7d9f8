"""From a look to its tiny networks, and what they are worth in pictures that they never saw.

Every network is trained on its own: regressed on what leaves places of the surface, without noise and
without a picture being drawn (``vision_lessons``). Nothing is distilled: the surface itself answers exactly.
"""

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path

from harness.authoring.training import Laps, Report, train
from harness.authoring.vision.cells import CellTraining
from harness.authoring.vision.data import HeldOutViews, held_out_pictures
from harness.authoring.vision.lessons import OPAQUE, draw_for
from harness.authoring.vision.metrics import network_pictures, picture_errors, reference_pictures
from harness.authoring.vision.profiles import CellsSpec, VisionProfile
from harness.authoring.vision.surface_cells import surface_cells
from harness.objectfile.vision.graph import vision_graph
from harness.objectfile.vision.network import PER_CELL, VisionModel
from harness.objectfile.vision.render import VisionRenderer
from harness.picture.linear_image import LinearImage
from harness.sim.light.appearance import Appearance
from harness.sim.light.direct_image import LitObject

CHECKPOINT = ".vision_training.npz"
"""Beside ``object.json`` until the training is over."""

STRICT = "strict_"
"""Before the names of errors and times of networks that are told no more than the paper's."""

STRICT_CHECKPOINT = ".vision_strict_training.npz"

Settings = dict[str, str | float | int | bool | None]


@dataclass(frozen=True, eq=False)
class AuthoredVision:
    """Networks and their worth."""

    model: VisionModel  #: in float16, to be written; for the look's mesh.
    errors: Mapping[str, float]
    """of pictures kept back, by a name with its unit (``vision_metrics.picture_errors``); those of networks
    told no more than the paper's begin with ``strict_``."""
    settings: Settings  #: how they were made.
    seconds: Mapping[str, float]  #: s on the clock of each stage.


def author_vision(
    look: Appearance,
    profile: VisionProfile,
    seed: int,
    folder: Path,
    report: Report,
    threads: int | None = None,
) -> AuthoredVision:
    """Make and measure the networks of one object's look.

    Args:
        look: of the object.
        profile: which networks.
        seed: of all that is drawn: pictures kept back, places, lamps, first weights.
        folder: where checkpoints are kept; a training that was killed goes on from them, to the same bits.
        report: told of progress.
        threads: None for as many as the process has cores; the networks are the same for any number.

    Raises:
        MeshRefused: a surface without extent.
        OutOfDomain: nothing of the surface can be seen from outside.
        DataRefused: a checkpoint in the folder that cannot be gone on from.
    """
    clock, lit = Laps(), LitObject(look)
    held_out = held_out_pictures(look.mesh, profile.pictures, profile.side, profile.side, seed)
    references = reference_pictures(lit, held_out, profile.samples)
    clock.lap("references")
    made = _Making(lit, held_out, seed, report, threads, clock)
    errors: dict[str, float] = {}
    # No teacher: every description says so, and the same build goes on writing the same file.
    settings: Settings = {"teaching": "none"}
    models: list[VisionModel] = []
    for spec, name, word in _asked(profile):
        training = made.trained(spec, folder / name, word)
        models.append(training.finish())
        errors |= made.judged(models[-1], references, word)
        settings |= {} if word else _settings(spec, training)
    return AuthoredVision(models[0], errors, settings, clock.seconds)


def checkpoints(folder: Path) -> list[Path]:
    """Files that a stopped training goes on from, there or not."""
    return [folder / name for name in (CHECKPOINT, STRICT_CHECKPOINT)]


def _asked(profile: VisionProfile) -> list[tuple[CellsSpec, str, str]]:
    """Networks, their checkpoints, and the words before their errors."""
    strict = [] if profile.strict is None else [(profile.strict, STRICT_CHECKPOINT, STRICT)]
    return [(profile.networks, CHECKPOINT, ""), *strict]


def networks_alone(
    lit: LitObject,
    held_out: HeldOutViews,
    spec: CellsSpec,
    seed: int,
    checkpoint: Path,
    report: Report,
    threads: int | None = None,
) -> VisionModel:
    """Networks as ``author_vision`` makes them, not judged; arguments and errors as there.

    Args:
        lit: the object.
        held_out: what nothing is learned from.
        spec: of the networks.
        seed: of all that is drawn.
        checkpoint: file that a killed training goes on from; it is left there.
        report: told of progress.
        threads: None for as many as the process has cores.
    """
    return _Making(lit, held_out, seed, report, threads, Laps()).trained(spec, checkpoint, "").finish()


def cells_to_train(
    lit: LitObject, held_out: HeldOutViews, spec: CellsSpec, seed: int, threads: int | None = None
) -> CellTraining:
    """An object's networks with what they are to learn, not trained yet.

    Args:
        lit: the object.
        held_out: what nothing is learned from.
        spec: of the networks.
        seed: of all that is drawn.
        threads: None for as many as the process has cores.
    """
    grid = surface_cells(lit.appearance.mesh, spec.cells)
    voxel = grid.cell / PER_CELL
    lessons, lamps = draw_for(spec.size.kind, lit, spec.places, voxel, seed, held_out)
    return CellTraining(spec, grid, lessons, lamps, OPAQUE / voxel, seed, threads)


@dataclass(frozen=True, eq=False)
class _Making:
    """What all networks of an object have in common; names of their times and errors begin with a word."""

    lit: LitObject
    held_out: HeldOutViews
    seed: int
    report: Report
    threads: int | None
    clock: Laps

    def trained(self, spec: CellsSpec, checkpoint: Path, word: str) -> CellTraining:
        self.report(f"drawing places {word}".rstrip("_ "), 0.0)
        training = cells_to_train(self.lit, self.held_out, spec, self.seed, self.threads)
        self.clock.lap(f"{word}places")
        train(training, training.epochs, checkpoint, self.report)
        self.clock.lap(f"{word}networks")
        return training

    def judged(self, model: VisionModel, references: list[LinearImage], word: str) -> dict[str, float]:
        self.report("measuring", 0.0)
        data = vision_graph(model).SerializeToString()
        renderer = VisionRenderer(data, self.lit.appearance.mesh, self.threads)
        found = network_pictures(renderer, self.held_out)
        self.clock.lap(f"{word}measure")
        errors = dict(picture_errors(references, found)) | {"bytes": float(len(data))}
        return {f"{word}{name}": value for name, value in errors.items()}


def _settings(spec: CellsSpec, training: CellTraining) -> Settings:
    told = {key: value for key, value in asdict(spec).items() if key != "size"}
    return asdict(spec.size) | told | {"last_loss": sum(training.losses) / len(training.losses)}
