"""The networks whose pictures are compared in cost: trained once, kept by what they were trained from."""

from dataclasses import astuple
from pathlib import Path

from harness.authoring.training import Report
from harness.authoring.vision.cells import VERSION
from harness.authoring.vision.cost import Views
from harness.authoring.vision.trades import Networks
from harness.authoring.vision.vision import networks_alone
from harness.basics.store import digest
from harness.objectfile.vision.network.graph import vision_graph, vision_model
from harness.objectfile.vision.network.network import VisionModel


def trained(
    wanted: Networks, views: Views, seed: int, folder: Path, report: Report, threads: int | None = None
) -> VisionModel:
    """Networks in float16, from the folder where they are there; a training that was killed goes on.

    Args:
        wanted: their bits are not looked at.
        views: whose cameras and lights nothing is learned from.
        seed: of all that is drawn.
        folder: exists.
        report: told of progress.
        threads: None for as many as the process has cores.

    Raises:
        DataRefused: a file of that name that is of something else.
    """
    name = _key(wanted, views, seed)
    kept, checkpoint = folder / f"{name}.onnx", folder / f".{name}.npz"
    if kept.is_file():
        return vision_model(kept.read_bytes(), kept.name)
    model = networks_alone(views.lit, views.held_out, wanted.spec, seed, checkpoint, report, threads)
    part = kept.with_name(f".{kept.name}.part")
    part.write_bytes(vision_graph(model).SerializeToString())
    part.replace(kept)
    checkpoint.unlink(missing_ok=True)
    return model


def _key(wanted: Networks, views: Views, seed: int) -> str:
    look, kept = views.lit.appearance, views.held_out
    size, *others = astuple(wanted.spec)
    surface = [look.mesh.vertices, look.mesh.faces, look.normals, look.tints, look.places, look.texture_of]
    eyes = [camera.eye for camera in kept.cameras] + [light.direction for light in kept.lights]
    told = ["vision networks", VERSION, list(size), others, seed, surface, list(look.textures), eyes]
    return digest([*told, kept.apart])[:16]
