"""From a look to its tiny networks, and what they are worth in pictures that they never saw.

Every network is trained on its own: regressed on what leaves places of the surface, without noise and
without a picture being drawn (``vision_lessons``). Nothing is distilled: the surface itself answers exactly.
Pictures come last, where the profile has them (``vision_finish``).
"""

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path

from harness.authoring.training import Laps, Report, train
from harness.authoring.vision.cells import CellTraining
from harness.authoring.vision.data import HeldOutViews, held_out_pictures
from harness.authoring.vision.finish import CellFinishing
from harness.authoring.vision.finish_profiles import CellsFinish
from harness.authoring.vision.lessons import OPAQUE, draw_for
from harness.authoring.vision.metrics import network_pictures, picture_errors, reference_pictures
from harness.authoring.vision.profiles import CellsSpec, VisionProfile
from harness.authoring.vision.seen import Exact, pictures_to_learn
from harness.objectfile.vision.network.graph import vision_graph
from harness.objectfile.vision.network.network import VisionModel
from harness.objectfile.vision.render import VisionRenderer
from harness.objectfile.vision.shell import grid_of, lattice_of, surface_shell
from harness.picture.linear_image import LinearImage
from harness.sim.light.appearance import Appearance
from harness.sim.light.direct_image import LitObject

CHECKPOINT = ".vision_training.npz"
"""Beside ``object.json`` until the training is over."""

STRICT = "strict_"
"""Before the names of errors and times of networks that are told no more than the paper's."""

STRICT_CHECKPOINT = ".vision_strict_training.npz"

UNFINISHED = "unfinished_"
"""Before the names of errors that networks had before they were finished on pictures."""

Settings = dict[str, str | float | int | bool | None]


@dataclass(frozen=True, eq=False)
class AuthoredVision:
    """Networks and their worth.

    Attributes:
        model: in float16, to be written; for the look's mesh.
        errors: of pictures kept back, by a name with its unit (``vision_metrics.picture_errors``); those of
            networks told no more than the paper's begin with ``strict_``, then those that networks had before
            they were finished on pictures with ``unfinished_``.
        settings: how they were made.
        seconds: s on the clock of each stage.
    """

    model: VisionModel
    errors: Mapping[str, float]
    settings: Settings
    seconds: Mapping[str, float]


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
    pictures = [] if profile.finish is None else made.pictures(profile.finish)
    errors: dict[str, float] = {}
    # No teacher: every description says so, and the same build goes on writing the same file.
    settings: Settings = {"teaching": "none"}
    models: list[VisionModel] = []
    for spec, name, word in _asked(profile):
        training = made.trained(spec, folder / name, word)
        if profile.finish is not None:
            errors |= made.judged(training.finish(), references, f"{word}{UNFINISHED}")
            made.finish(training, profile.finish, pictures, finished_file(folder / name), word)
        models.append(training.finish())
        errors |= made.judged(models[-1], references, word)
        settings |= {} if word else _settings(spec, training, profile.finish)
    return AuthoredVision(models[0], errors, settings, clock.seconds)


def checkpoints(folder: Path) -> list[Path]:
    """Files that a stopped training goes on from, there or not."""
    kept = [folder / name for name in (CHECKPOINT, STRICT_CHECKPOINT)]
    return kept + [finished_file(each) for each in kept]


def finished_file(checkpoint: Path) -> Path:
    """Beside a training's checkpoint: of what it learned from pictures then."""
    return checkpoint.with_name(f"{checkpoint.stem}-pictures{checkpoint.suffix}")


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
    lattice = lattice_of(lit.appearance.mesh, spec.cells)
    shell = surface_shell(lit.appearance.mesh, lattice)
    lessons, lamps = draw_for(spec.size.kind, lit, spec.places, shell.voxel, seed, held_out)
    grid, scale = grid_of(shell, lattice), OPAQUE / shell.voxel
    return CellTraining(spec, grid, lessons, lamps, scale, seed, threads)


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

    def pictures(self, finish: CellsFinish) -> list[Exact]:
        found = pictures_to_learn(*(self.lit, finish, self.seed, self.held_out, self.report, self.threads))
        self.clock.lap("pictures")
        return found

    def finish(
        self, training: CellTraining, finish: CellsFinish, pictures: list[Exact], checkpoint: Path, word: str
    ) -> None:
        """The training's networks are changed."""
        finishing = CellFinishing(training, finish, self.lit.appearance.mesh, pictures)
        train(finishing, finishing.epochs, checkpoint, self.report)
        self.clock.lap(f"{word}finish")

    def judged(self, model: VisionModel, references: list[LinearImage], word: str) -> dict[str, float]:
        self.report("measuring", 0.0)
        data = vision_graph(model).SerializeToString()
        renderer = VisionRenderer(data, self.lit.appearance.mesh, self.threads)
        found = network_pictures(renderer, self.held_out)
        self.clock.lap(f"{word}measure")
        errors = dict(picture_errors(references, found)) | {"bytes": float(len(data))}
        return {f"{word}{name}": value for name, value in errors.items()}


def _settings(spec: CellsSpec, training: CellTraining, finish: CellsFinish | None) -> Settings:
    later = {} if finish is None else {f"finish_{key}": value for key, value in asdict(finish).items()}
    told = {key: value for key, value in asdict(spec).items() if key != "size"}
    return asdict(spec.size) | told | later | {"last_loss": sum(training.losses) / len(training.losses)}
