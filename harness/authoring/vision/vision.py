"""From a look to its tiny networks, and what they are worth in pictures that they never saw.

Every network is trained on its own: regressed on what leaves places of the surface, without noise and
without a picture being drawn (``vision_lessons``). Nothing is distilled: the surface itself answers exactly.
"""

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path

from harness.authoring.training import Laps, Report
from harness.authoring.vision.cells import CellTraining
from harness.authoring.vision.data import HeldOutViews, held_out_pictures
from harness.authoring.vision.lessons import OPAQUE, draw_for
from harness.authoring.vision.metrics import picture_errors, reference_pictures
from harness.authoring.vision.profiles import CellsSpec, VisionProfile
from harness.authoring.vision.surface_cells import surface_cells
from harness.objectfile.vision.graph import vision_graph
from harness.objectfile.vision.network import PER_CELL, VisionModel
from harness.objectfile.vision.render import VisionRenderer
from harness.sim.light.appearance import Appearance
from harness.sim.light.direct_image import LitObject

CHECKPOINT = ".vision_training.npz"
"""Beside ``object.json`` until the training is over."""


@dataclass(frozen=True, eq=False)
class AuthoredVision:
    """Networks and their worth."""

    model: VisionModel  #: in float16, to be written; for the look's mesh.
    errors: Mapping[str, float]
    """of pictures kept back, by a name with its unit (``vision_metrics.picture_errors``)."""
    settings: Mapping[str, str | float | int | bool | None]  #: how they were made.
    seconds: Mapping[str, float]  #: s on the clock of each stage.


def author_vision(
    look: Appearance,
    profile: VisionProfile,
    seed: int,
    folder: Path,
    report: Report,
    threads: int | None = None,
) -> AuthoredVision:
    """Train and measure the networks of one object's vision; they are equal for any number of threads.

    An interrupted training continues from its checkpoint in the folder, with bit-equal results.

    Raises:
        MeshRefused: a surface without extent.
        OutOfDomain: no part of the surface is visible from outside.
        DataRefused: a checkpoint in the folder that cannot be continued.
    """
    clock, lit = Laps(), LitObject(look)
    held_out = held_out_pictures(look.mesh, profile.pictures, profile.side, profile.side, seed)
    references = reference_pictures(lit, held_out, profile.samples)
    clock.lap("references")
    spec, checkpoint = profile.networks, folder / CHECKPOINT
    training = train_networks(lit, held_out, spec, seed, checkpoint, report, threads, clock)
    model = training.finish()
    report("measuring", 0.0)
    data = vision_graph(model).SerializeToString()
    renderer = VisionRenderer(data, look.mesh, threads)
    views = zip(held_out.cameras, held_out.lights, strict=True)
    found = [renderer.render(camera, light).image for camera, light in views]
    clock.lap("measure")
    errors = {**picture_errors(references, found), "bytes": float(len(data))}
    # No teacher: every description says so, and the same build goes on writing the same file.
    given = {key: value for key, value in asdict(spec).items() if key != "size"}
    last_loss = sum(training.losses) / len(training.losses)
    settings = {"teaching": "none", **asdict(spec.size), **given, "last_loss": last_loss}
    return AuthoredVision(model, errors, settings, clock.seconds)


def train_networks(
    lit: LitObject,
    held_out: HeldOutViews,
    spec: CellsSpec,
    seed: int,
    checkpoint: Path,
    report: Report,
    threads: int | None = None,
    clock: Laps | None = None,
) -> CellTraining:
    """Train an object's networks without measuring their errors; raises as ``author_vision``.

    No training sample is close to a view of ``held_out``; an interrupted training continues from the file
    ``checkpoint``, which is left in place; ``clock`` receives the seconds by stage.
    """
    clock = Laps() if clock is None else clock
    report("drawing places", 0.0)
    grid = surface_cells(lit.appearance.mesh, spec.cells)
    voxel = grid.cell / PER_CELL
    lessons, lamps = draw_for(spec.size.kind, lit, spec.places, voxel, seed, held_out)
    training = CellTraining(spec, grid, lessons, lamps, OPAQUE / voxel, seed, threads)
    clock.lap("places")
    if checkpoint.exists():
        training.load(checkpoint)
    while not training.done:
        epoch, epochs = training.epoch, training.epochs
        report(f"training, epoch {epoch + 1} of {epochs}", epoch / epochs)
        training.step_epoch()
        training.save(checkpoint)
    clock.lap("networks")
    return training
