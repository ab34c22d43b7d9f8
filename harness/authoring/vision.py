"""From a look to its tiny networks, and what they are worth in pictures that they never saw.

Every network is trained on its own: regressed on what leaves places of the surface, without noise and
without a picture being drawn (``vision_lessons``). Nothing is distilled: the surface itself answers sooner
than any network that would stand for it.
"""

import time
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path

from harness.authoring.training import Report, train
from harness.authoring.vision_cells import CellTraining
from harness.authoring.vision_data import HeldOut, held_out_pictures
from harness.authoring.vision_lessons import draw_lamps, draw_lessons
from harness.authoring.vision_metrics import network_pictures, picture_errors, reference_pictures
from harness.authoring.vision_profiles import CellsSpec, VisionProfile
from harness.linear_image import LinearImage
from harness.objectfile.vision_graph import vision_graph
from harness.objectfile.vision_network import VisionModel
from harness.objectfile.vision_render import VisionRenderer
from harness.objectfile.vision_shell import grid_of, lattice_of, surface_shell
from harness.sim.appearance import Appearance
from harness.sim.direct_image import LitObject

CHECKPOINT = ".vision_training.npz"
"""Beside ``object.json`` until the training is over."""

OPAQUE = 40.0
"""Optical thickness of a voxel as deep behind the surface as a voxel is wide."""

STRICT = "strict_"
"""Before the names of errors and times of networks that are told no more than the paper's."""

STRICT_CHECKPOINT = ".vision_strict_training.npz"

_LAMPS = 1 << 14
"""That are drawn from."""

_LAMPS_OF_A_PLACE = 4
"""Of networks that are not told visibility: a ray for each."""

Settings = dict[str, str | float | int | bool | None]


@dataclass(frozen=True, eq=False)
class AuthoredVision:
    """Networks and their worth.

    Attributes:
        model: in float16, to be written; for the look's mesh.
        errors: of pictures kept back, by a name with its unit (``vision_metrics.picture_errors``); those of
            networks told no more than the paper's begin with ``strict_``.
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
        folder: where a checkpoint is kept; a training that was killed goes on from it, to the same bits.
        report: told of progress.
        threads: None for as many as the process has cores; the networks are the same for any number.

    Raises:
        MeshRefused: a surface without extent.
        OutOfDomain: nothing of the surface can be seen from outside.
        DataRefused: a checkpoint in the folder that cannot be gone on from.
    """
    clock, lit = _Clock(), LitObject(look)
    held_out = held_out_pictures(look.mesh, profile.pictures, profile.side, profile.side, seed)
    made = _Making(lit, held_out, seed, report, threads, clock)
    training = made.trained(profile.networks, folder / CHECKPOINT, "")
    model = training.finish()
    references = reference_pictures(lit, held_out, profile.samples)
    errors = made.judged(model, references, "")
    if profile.strict is not None:
        strict = made.trained(profile.strict, folder / STRICT_CHECKPOINT, STRICT)
        errors |= made.judged(strict.finish(), references, STRICT)
    return AuthoredVision(model, errors, _settings(profile.networks, training), clock.seconds)


def networks_alone(
    lit: LitObject,
    held_out: HeldOut,
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
    return _Making(lit, held_out, seed, report, threads, _Clock()).trained(spec, checkpoint, "").finish()


@dataclass(frozen=True, eq=False)
class _Making:
    """What all networks of an object have in common; names of their times and errors begin with a word."""

    lit: LitObject
    held_out: HeldOut
    seed: int
    report: Report
    threads: int | None
    clock: "_Clock"

    def trained(self, spec: CellsSpec, checkpoint: Path, word: str) -> CellTraining:
        self.report(f"drawing places {word}".rstrip("_ "), 0.0)
        lattice, told = lattice_of(self.lit.appearance.mesh, spec.cells), spec.size.kind == "osf-v"
        shell = surface_shell(self.lit.appearance.mesh, lattice)
        lessons = draw_lessons(
            *(self.lit, spec.places, shell.voxel, self.seed, self.held_out), 0 if told else _LAMPS_OF_A_PLACE
        )
        lamps = draw_lamps(_LAMPS if told else 0, self.seed, self.held_out)
        grid, scale = grid_of(shell, lattice), OPAQUE / shell.voxel
        training = CellTraining(spec, grid, lessons, lamps, scale, self.seed, self.threads)
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


class _Clock:
    """Seconds on the clock of parts that follow each other."""

    def __init__(self) -> None:
        self.seconds: dict[str, float] = {}
        self._since = time.perf_counter()

    def lap(self, part: str) -> None:
        """What passed since the last lap belongs to ``part``."""
        now = time.perf_counter()
        self.seconds[part], self._since = now - self._since, now
