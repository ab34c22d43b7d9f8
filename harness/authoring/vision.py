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
from harness.authoring.vision_metrics import judge, picture_errors
from harness.authoring.vision_profiles import CellsSpec, VisionProfile
from harness.errors import WrongUse
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

_LAMPS = 1 << 14

Settings = dict[str, str | float | int | bool | None]


@dataclass(frozen=True, eq=False)
class AuthoredVision:
    """Networks and their worth.

    Attributes:
        model: in float16, to be written; for the look's mesh.
        errors: of pictures kept back, by a name with its unit (``vision_metrics.picture_errors``).
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
        WrongUse: networks of a kind that this does not train.
        MeshRefused: a surface without extent.
        OutOfDomain: nothing of the surface can be seen from outside.
        DataRefused: a checkpoint in the folder that cannot be gone on from.
    """
    clock = _Clock()
    lit, spec = LitObject(look), profile.networks
    held_out = held_out_pictures(look.mesh, profile.pictures, profile.side, profile.side, seed)
    report("drawing places", 0.0)
    training = _training(lit, spec, held_out, seed, threads)
    clock.lap("places")
    train(training, training.epochs, folder / CHECKPOINT, report)
    model = training.finish()
    clock.lap("networks")
    report("measuring", 0.0)
    data = vision_graph(model).SerializeToString()
    judged = judge(lit, VisionRenderer(data, look.mesh, threads), held_out, profile.samples)
    clock.lap("measure")
    errors = dict(picture_errors(judged.references, judged.found)) | {"bytes": float(len(data))}
    return AuthoredVision(model, errors, _settings(spec, training), clock.seconds)


def _training(
    lit: LitObject, spec: CellsSpec, held_out: HeldOut, seed: int, threads: int | None
) -> CellTraining:
    if spec.size.kind != "osf-v":
        raise WrongUse(
            f"networks of kind {spec.size.kind!r} were asked for; those of kind 'osf-v' are trained here"
        )
    lattice = lattice_of(lit.appearance.mesh, spec.cells)
    shell = surface_shell(lit.appearance.mesh, lattice)
    lessons = draw_lessons(lit, spec.places, shell.voxel, seed, held_out)
    lamps = draw_lamps(_LAMPS, seed, held_out)
    return CellTraining(spec, grid_of(shell, lattice), lessons, lamps, OPAQUE / shell.voxel, seed, threads)


def _settings(spec: CellsSpec, training: CellTraining) -> Settings:
    told = {key: value for key, value in asdict(spec).items() if key != "size"}
    losses = training.losses
    return asdict(spec.size) | told | {"last_loss": sum(losses) / len(losses)}


class _Clock:
    """Seconds on the clock of parts that follow each other."""

    def __init__(self) -> None:
        self.seconds: dict[str, float] = {}
        self._since = time.perf_counter()

    def lap(self, part: str) -> None:
        """What passed since the last lap belongs to ``part``."""
        now = time.perf_counter()
        self.seconds[part], self._since = now - self._since, now
