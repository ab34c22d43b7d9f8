"""A small object whose look is known: a box of one colour, opaque, that any level draws alike."""

from pathlib import Path

from harness.authoring.vision.surface_cells import surface_cells
from harness.basics.materials import MATERIALS
from harness.objectfile.file import ObjectFile, create_object
from harness.objectfile.vision.network import VisionModel
from harness.objectfile.vision.part import VisionPart, with_vision
from tests.oracles.plain_look import TOLD, even_look, shadow_look
from tests.oracles.seen_shapes import cuboid
from tests.samples.object_bench import PROVENANCE

BOX = cuboid(0.1, 0.08, 0.06)
LOGITS = (0.0, 1.0, -1.0)
OPAQUE = 1e6


def box_look(density: float = OPAQUE) -> VisionModel:
    """The same colour everywhere within the box's shell."""
    return even_look(surface_cells(BOX, 8), density, LOGITS)


def told_look() -> VisionModel:
    """White where the light is seen, black where it is not."""
    model = shadow_look(surface_cells(BOX, 8), OPAQUE)
    assert model.weights.size == TOLD
    return model


def box_part(model: VisionModel | None = None) -> VisionPart:
    """Its look."""
    return VisionPart(model or box_look(), PROVENANCE, {"psnr_db_mean": 40.0})


def box_file(folder: Path, model: VisionModel | None = None) -> ObjectFile:
    """The object, written."""
    of = create_object(folder, "box", BOX, MATERIALS["wood"], PROVENANCE)
    return with_vision(of, box_part(model))
