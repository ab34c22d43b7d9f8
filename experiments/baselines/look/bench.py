"""Views and lights that no network has learned from, and the reference's pictures of them."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from experiments.baselines.bench import RenderingWork, Sense, picture_scores
from harness.authoring.vision.data import HeldOutViews, held_out_pictures
from harness.authoring.vision.metrics import BEHIND, reference_pictures
from harness.authoring.vision.profiles import vision_profile
from harness.basics.arrays import AnyArray, ByteArray
from harness.basics.errors import DataRefused
from harness.basics.store import digest
from harness.objectfile.file import ObjectFile
from harness.objectfile.published.camera import FOCAL, SIZE
from harness.objects.builtin import BUILTIN
from harness.picture.linear_image import LinearImage
from harness.picture.pinhole import DirectionalLight, Pinhole
from harness.sim.light.appearance_source import appearance_of
from harness.sim.light.direct_image import LitObject

DISTANCE = float(0.5 / np.sin(np.arctan(0.5 * SIZE / FOCAL)))
"""Diagonals of the object's box, at which the ball around it fills the view of the paper's camera."""

SAMPLES = 8
"""A side of a pixel, of the reference: its own noise is then below 1e-3 of white."""


@dataclass(frozen=True, eq=False)
class ViewBench:
    """Pictures of 256 x 256 pixels before white, as shown on a screen.

    Attributes:
        lit: the object with its colours.
        views: cameras and lights, none of which is learned from.
        references: one a view.
    """

    lit: LitObject
    views: HeldOutViews
    references: tuple[ByteArray, ...]

    sense: Sense = "vision"

    @property
    def count(self) -> int:
        """Views."""
        return len(self.references)

    @cached_property
    def identity(self) -> str:
        """Of the reference's pictures and where they were taken."""
        eyes = [[camera.eye, light.direction] for camera, light in self._pairs]
        return digest([*eyes, *self.references])

    @property
    def _pairs(self) -> "zip[tuple[Pinhole, DirectionalLight]]":
        return zip(self.views.cameras, self.views.lights, strict=True)

    def scores(self, number: int, rendered: AnyArray) -> Mapping[str, float]:
        """PSNR and SSIM of the whole picture."""
        return picture_scores(rendered, self.references[number])


def shown(image: LinearImage) -> ByteArray:
    """``(rows, columns, 3)`` before white, in sRGB."""
    return image.display(BEHIND)


def view_bench(of: ObjectFile, views: int, work: RenderingWork) -> ViewBench:
    """The views of an object.

    Raises:
        DataRefused: its colours are not known here: it was not built in.
    """
    work.report("vision: drawing the reference", 0.0)
    lit = LitObject(appearance_of(origin_of(of), None, edge=_edge(of)))
    held_out = held_out_pictures(lit.appearance.mesh, views, SIZE, SIZE, _seed(of), DISTANCE)
    key = digest(["rendering reference", SAMPLES, lit.appearance.mesh.vertices, views, _seed(of)])
    stored = work.store.get(key)
    if not isinstance(stored, np.ndarray):
        stored = np.stack([shown(each) for each in reference_pictures(lit, held_out, SAMPLES)])
        work.store.put(key, stored)
    return ViewBench(lit, held_out, tuple(stored))


def origin_of(of: ObjectFile) -> str:
    """``builtin:NAME``, where an object's colours come from.

    Raises:
        DataRefused: they come from a file, which an ObjectFile does not hold.
    """
    origins = [source.origin for source in of.description.provenance.sources]
    found = [origin for origin in origins if origin.startswith(BUILTIN)]
    if not found:
        raise DataRefused(
            f"{of.description.name} came from {', '.join(origins) or 'nowhere'}, whose colours its "
            "ObjectFile does not hold, so that no reference can be drawn; take one that is built in, as mug"
        )
    return found[0]


def _edge(of: ObjectFile) -> float:
    """M between vertices of the look's mesh, as the object was built."""
    vision = of.description.vision
    profile = None if vision is None else vision.provenance.settings.get("profile")
    return vision_profile(str(profile or "shipped")).edge


def _seed(of: ObjectFile) -> int:
    """Of the views: those that the ObjectFile's own networks did not learn from."""
    vision = of.description.vision
    return 0 if vision is None else vision.provenance.seeds.get("vision", 0)
