"""Tables 1 and 2 of vision: views and their reference, 1.0's field, the paper's cells, ours.

The looks of 1.0 and 2.0 are rendered as by the published programs: samples spread evenly along every ray, in
a frame in which the ball around the object has the radius 1, from where a ray may meet that ball to where it
leaves it. 1.0's look is one network for the whole object, in the published layout
(``harness.authoring.published.modules.Osf``): place, view and light to a raw colour and density. 2.0's are
the networks of cells, with an occupancy grid; samples where nothing is occupied have no density.
"""

from collections.abc import Mapping
from dataclasses import asdict, astuple, dataclass
from functools import cached_property, partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Final

import numpy as np
from scipy.ndimage import binary_dilation

from experiments.paper.rendering import (
    Column,
    FieldSpec,
    MadeMethod,
    RenderingMethod,
    RenderingWork,
    Sense,
    load_or_train_graph,
    picture_scores,
    train_network,
)
from harness.authoring.vision.data import HeldOutViews, held_out_pictures
from harness.authoring.vision.metrics import BEHIND, reference_pictures
from harness.authoring.vision.profiles import CellsSpec, vision_profile
from harness.authoring.vision.surface_cells import surface_cells
from harness.authoring.vision.vision import train_networks
from harness.basics.arrays import AnyArray, BoolArray, ByteArray, FloatArray
from harness.basics.errors import DataRefused
from harness.basics.mesh import Mesh
from harness.basics.store import digest
from harness.objectfile.file import ObjectFile
from harness.objectfile.published.look import FOCAL, SIZE, RawField, osf_field, osf_tensors
from harness.objectfile.published.volume_render import Field, render_rays, stretched_sigmoid
from harness.objectfile.runtime import Network
from harness.objectfile.vision.graph import VisionNetworks, vision_graph
from harness.objectfile.vision.network import PAPER, PER_CELL, VisionGrid
from harness.objectfile.vision.render import RenderSettings, open_vision
from harness.objects.builtin import BUILTIN
from harness.picture.linear_image import LinearImage
from harness.picture.pinhole import DirectionalLight, Pinhole
from harness.picture.srgb import bytes_from_linear
from harness.sim.light.appearance_source import appearance_of
from harness.sim.light.direct_image import LitObject

KILO_OSF: Final = CellsSpec(PAPER, places=1_500_000, steps=600)
"""2.0's VisionNet: the published size and inputs, 16^3 cells."""


FIELD: Final = FieldSpec()
"""1.0's VisionNet: 4 layers of 128 for its two times 8 of 256, 128 samples for its 64 and 192."""

DISTANCE = float(0.5 / np.sin(np.arctan(0.5 * SIZE / FOCAL)))
"""Diagonals of the object's box, at which the ball around it fills the view of the paper's camera."""

SAMPLES = 8
"""A side of a pixel, of the reference: its own noise is then below 1e-3 of white."""


@dataclass(frozen=True, eq=False)
class ViewBench:
    """Pictures of 256 x 256 pixels before white, as shown on a screen."""

    lit: LitObject  #: the object with its colours.
    views: HeldOutViews  #: cameras and lights, none of which is learned from.
    references: tuple[ByteArray, ...]  #: one a view.

    sense: Sense = "vision"

    @property
    def count(self) -> int:
        """Views."""
        return len(self.references)

    @cached_property
    def identity(self) -> str:
        """Of the reference's pictures and where they were taken."""
        views = map(self.view, range(self.count))
        return digest([*([camera.eye, light.direction] for camera, light in views), *self.references])

    def view(self, number: int) -> tuple[Pinhole, DirectionalLight]:
        """Return the camera and the light of a view."""
        return self.views.cameras[number], self.views.lights[number]

    def scores(self, number: int, rendered: AnyArray) -> Mapping[str, float]:
        """PSNR and SSIM of the whole picture."""
        return picture_scores(rendered, self.references[number])


def shown(image: LinearImage) -> ByteArray:
    """Return the ``(rows, columns, 3)`` picture in sRGB on a white background."""
    return image.display(BEHIND)


def view_bench(of: ObjectFile, views: int, work: RenderingWork) -> ViewBench:
    """Render the views of an object and their reference.

    Raises:
        DataRefused: its colours come from a file, which an ObjectFile does not contain.
    """
    work.report("vision: drawing the reference", 0.0)
    origins = [source.origin for source in of.description.provenance.sources]
    builtin = [origin for origin in origins if origin.startswith(BUILTIN)]
    if not builtin:
        raise DataRefused(
            f"{of.description.name} came from {', '.join(origins) or 'nowhere'}, whose colours its "
            "ObjectFile does not hold, so that no reference can be drawn; take one that is built in, as mug"
        )
    # The mesh as the object was built, and views that the ObjectFile's own networks did not learn from.
    vision = of.description.vision
    profile = None if vision is None else vision.provenance.settings.get("profile")
    seed = 0 if vision is None else vision.provenance.seeds.get("vision", 0)
    lit = LitObject(appearance_of(builtin[0], None, edge=vision_profile(str(profile or "shipped")).edge))
    held_out = held_out_pictures(lit.appearance.mesh, views, SIZE, SIZE, seed, DISTANCE)
    key = digest(["rendering reference", SAMPLES, lit.appearance.mesh.vertices, views, seed])
    stored = work.store.get(key)
    if not isinstance(stored, np.ndarray):
        stored = np.stack([shown(each) for each in reference_pictures(lit, held_out, SAMPLES)])
        work.store.put(key, stored)
    return ViewBench(lit, held_out, tuple(stored))


FIELD_FILE = "vision_field.onnx"
REACH = 4.0
"""Radii of the ball, that samples lie within."""


@dataclass(frozen=True, eq=False)
class UniformField:
    """The trained network, ready for pictures."""

    field: RawField  #: of places in the frame of the ball.
    middle: FloatArray  #: ``(3,)`` m, of the ball.
    radius: float  #: m.
    samples: int  #: of a ray.

    def picture(self, camera: Pinhole, light: DirectionalLight) -> ByteArray:
        """Render ``(rows, columns, 3)`` before white."""

        def shown(points: FloatArray, views: FloatArray) -> tuple[FloatArray, FloatArray]:
            raw = self.field(points, views, light.direction)
            return raw[:, 3], stretched_sigmoid(raw[:, :3])

        colour, cover = render_ball(shown, camera, self.middle, self.radius, self.samples)
        return np.rint(255.0 * np.clip(colour + (1.0 - cover)[..., None], 0.0, 1.0)).astype(np.uint8)


@dataclass(frozen=True, eq=False)
class CellFields:
    """The trained networks of cells, ready for pictures."""

    networks: VisionNetworks  #: networks that are given no visibility of the light (``osf``).
    mesh: Mesh  #: the object.
    cells: int  #: cells along the longest side.
    samples: int = 384  #: of a ray, as in the published files.

    @cached_property
    def shell(self) -> VisionGrid:
        """Voxels that the surface meets."""
        return surface_cells(self.mesh, self.cells * PER_CELL)

    @cached_property
    def occupied(self) -> BoolArray:
        """Mark voxels that intersect the surface, and their neighbours; one voxel of padding per side."""
        return binary_dilation(np.pad(self.shell.table >= 0, 1), np.ones((3, 3, 3), np.bool_))

    def picture(self, camera: Pinhole, light: DirectionalLight) -> ByteArray:
        """Render ``(rows, columns, 3)`` before white."""
        (middle, radius), shell, lamp = ball_of(self.mesh), self.shell, light.direction.astype(np.float32)

        def field(points: FloatArray, views: FloatArray) -> tuple[FloatArray, FloatArray]:
            density, colours = np.zeros(len(points)), np.zeros((len(points), 3))
            places = middle + radius * points
            at = np.floor((places - shell.low) / shell.cell).astype(np.int64) + 1
            near = np.flatnonzero(((at >= 0) & (at < self.occupied.shape)).all(axis=1))
            near = near[self.occupied[tuple(at[near].T)]]
            extras = np.empty((len(near), 0), np.float32)
            answers = self.networks.ask(places[near], views[near].astype(np.float32), lamp, extras)
            near = near[answers.known]
            density[near] = radius * answers.density[answers.known]
            colours[near] = light.irradiance / np.pi * answers.scattered[answers.known]
            return density, colours

        colour, cover = render_ball(field, camera, middle, radius, self.samples)
        return bytes_from_linear(colour + BEHIND * (1.0 - cover)[..., None])


def render_ball(
    field: Field, camera: Pinhole, middle: FloatArray, radius: float, samples: int
) -> tuple[FloatArray, FloatArray]:
    """Render a field in the frame of the ball around an object.

    Args:
        field: density and colour of points in the frame of the ball.
        camera: camera in the object's frame.
        middle: ``(3,)`` m, centre of the ball.
        radius: m.
        samples: samples of a ray.

    Returns:
        ``(rows, columns, 3)`` colours before black, and the ``(rows, columns)`` fraction that is covered.
    """
    eye = (camera.eye - middle) / radius
    away = float(np.linalg.norm(eye))

    def within(points: FloatArray, views: FloatArray) -> tuple[FloatArray, FloatArray]:
        # Nothing was learned outside of the ball, and the object lies within it.
        density, colours = field(points, views)
        return np.where(np.linalg.norm(points, axis=-1) <= 1.0, density, 0.0), colours

    depths = np.linspace(away - 1.0, away + 1.0, samples)
    colour, cover = render_rays(within, eye, camera.directions().reshape(-1, 3), depths)
    shape = (camera.height, camera.width)
    return colour.reshape(*shape, 3), cover.reshape(shape)


def ball_of(mesh: Mesh) -> tuple[FloatArray, float]:
    """Return the ``(3,)`` centre and the radius in m of the ball around an object's bounding box."""
    return mesh.bounds.mean(axis=0), 0.5 * mesh.diagonal


def open_field(data: bytes, mesh: Mesh, samples: int) -> UniformField:
    """Open the network of a graph to render an object."""
    inputs, outputs = osf_tensors(REACH)
    return UniformField(osf_field(Network(data, FIELD_FILE, inputs, outputs)), *ball_of(mesh), samples)


_SEED = 0

_SETTINGS: tuple[tuple[str, Column, RenderSettings], ...] = (
    ("coverage at pixel centres", "ours, smallest", RenderSettings(coverage=1)),
    ("default", "ours", RenderSettings()),
    ("four rays a pixel", "ours, largest", RenderSettings(rays=2)),
)


def look_methods(bench: ViewBench, of: ObjectFile, work: RenderingWork) -> list[RenderingMethod]:
    """Return every method of vision; the object's own networks are included if it has some."""
    white = MadeMethod(lambda _: np.full((SIZE, SIZE, 3), 255, np.uint8))
    entry = of.description.vision
    own = (
        []
        if entry is None
        else [
            RenderingMethod(
                f"networks of the ObjectFile, {name}",
                column,
                (entry.network.sha256, asdict(settings)),
                partial(_by_networks, bench, of, settings),
            )
            for name, column, settings in _SETTINGS
        ]
    )
    return [
        RenderingMethod("white alone", "other", (), lambda: white, "needs no training"),
        RenderingMethod(
            "one field, samples evenly (1.0)",
            "1.0 here",
            ("within the ball", *astuple(FIELD)),
            lambda: _by_field(bench, work),
            f"{FIELD.samples} samples a ray, {FIELD.depth} x {FIELD.width}",
        ),
        RenderingMethod(
            "KiloOSF (2.0)",
            "2.0 here",
            (asdict(KILO_OSF.size), *astuple(KILO_OSF)[1:], "volume", CellFields.samples),
            lambda: _by_cells(bench, work),
            f"its networks and inputs, {KILO_OSF.steps} steps each, {CellFields.samples} samples a ray",
        ),
        *own,
        RenderingMethod(
            "the mesh itself, 2 x 2 rays a pixel",
            "other",
            (),
            lambda: _by_mesh(bench),
            "as the reference, with fewer rays",
        ),
    ]  # fmt: skip


def _by_field(bench: ViewBench, work: RenderingWork) -> MadeMethod:
    data, seconds = train_network(work, "field", "the field of 1.0", bench, FIELD, bench.identity)
    field = open_field(data, bench.lit.appearance.mesh, FIELD.samples)
    return MadeMethod(lambda number: field.picture(*bench.view(number)), seconds)


def _by_cells(bench: ViewBench, work: RenderingWork) -> MadeMethod:
    def train() -> bytes:
        with TemporaryDirectory() as folder:
            checkpoint = Path(folder) / "cells.npz"
            networks = train_networks(bench.lit, bench.views, KILO_OSF, _SEED, checkpoint, work.report, 1)
            model = networks.finish()
        return vision_graph(model).SerializeToString()

    identity = ("kilo osf", bench.identity, asdict(KILO_OSF.size), *astuple(KILO_OSF)[1:])
    data, seconds = load_or_train_graph(work.store, identity, "KiloOSF", train, torch=False)
    fields = CellFields(VisionNetworks(data), bench.lit.appearance.mesh, KILO_OSF.cells)
    return MadeMethod(lambda number: fields.picture(*bench.view(number)), seconds)


def _by_networks(bench: ViewBench, of: ObjectFile, settings: RenderSettings) -> MadeMethod:
    renderer = open_vision(of, 1).renderer
    return MadeMethod(lambda number: shown(renderer.render(*bench.view(number), settings).image))


def _by_mesh(bench: ViewBench) -> MadeMethod:
    def observe(number: int) -> AnyArray:
        camera, light = bench.view(number)
        return shown(bench.lit.render(camera, [light], 2).image)

    return MadeMethod(observe)
