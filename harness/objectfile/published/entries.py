"""A folder of networks imported from a published file: the tables of its ``object.json``, and its files.

Published networks predict other quantities than a built ObjectFile's, in frames of their own: gains of modes
in a unit that is nowhere stated, the distance from a camera to a gel, raw colour and density in a normalised
cube. Each table names its quantity; what a file does not hold is null and listed under ``missing``.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from harness.basics.errors import WrongUse
from harness.objectfile.description import is_published, model_from, read_tree
from harness.objectfile.entries import Entry, FileEntry, NetworkEntry, Provenance
from harness.objectfile.file import ObjectFile, read_named
from harness.objectfile.runtime import Network
from harness.objectfile.self_test import open_network
from harness.objects.builtin import DESCRIPTION

Positive = Annotated[float, Field(gt=0.0)]
Size = Annotated[int, Field(ge=1)]
Point = tuple[float, float, float]
Bounds = tuple[float, float]

Format = Literal["ObjectFolder 1.0", "ObjectFolder 2.0"]


class PublishedGainsEntry(Entry):
    """Sound of ObjectFolder 2.0: modes, and their gains for a unit force along x, y and z.

    ``s(t) = sum_i g_i exp(-|d_i| t) sin(2 pi f_i t)``
    """

    frequencies_hz: Annotated[tuple[float, ...], Field(min_length=1)]
    """Hz, as published: of the damped modes, in any order."""
    dampings_per_s: tuple[float, ...]  #: 1/s, as published; their sign is ignored.
    low_m: Point  #: m, least corner of the box that points may lie in.
    high_m: Point  #: m, greatest corner.
    network: NetworkEntry  #: points to gains, whose unit the file does not state.

    @model_validator(mode="after")
    def _agrees(self) -> Self:
        modes = len(self.frequencies_hz)
        if len(self.dampings_per_s) != modes or self.network.outputs[0].shape != ("n", modes, 3):
            raise ValueError(
                f"{modes} frequencies, {len(self.dampings_per_s)} dampings and gains of "
                f"{self.network.outputs[0].shape}; there is one of each for each mode"
            )
        return self


class PublishedSpectrumEntry(Entry):
    """Sound of ObjectFolder 1.0: short-time spectra for a unit force along x, y and z."""

    rate_hz: Positive = 16000.0  #: samples per second.
    samples: Size = 32000  #: of a sound.
    window: Size = 400  #: samples of a Hann window.
    hop: Size = 160  #: samples between windows.
    transform: Size = 512  #: samples of a transform; it has ``transform / 2 + 1`` frequencies.
    frames: Size = 201  #: windows of a sound.
    voxels: FileEntry  #: file of ``(m, 3)`` float64, the solid voxels whose spectra the network learnt.
    grid: Size = 32  #: voxels along a side of the grid.
    translation: Point  #: added to a point in metres ...
    scale: Positive  #: ... and multiplied by: then ``grid`` more are voxels.
    bounds: Bounds | None = None
    """of the voxels' coordinates, 0 and 1 of the network's; null where nobody gave them."""
    network: NetworkEntry  #: normalised place, frequency and time to the spectrum's real and imaginary part.


class PublishedDepthEntry(Entry):
    """Touch of ObjectFolder 2.0: the distance from the gel's camera to its surface."""

    rows: Size = 120  #: pixels.
    columns: Size = 160  #: pixels.
    low_m: Point  #: m, least corner of the box that contacts may lie in.
    high_m: Point  #: m, greatest corner.
    most_tilt_rad: Positive  #: rad, of the gel from the vertex's normal, at most.
    depth_m: tuple[Positive, Positive]  #: m, least and greatest depth of a press.
    network: NetworkEntry  #: nine numbers of a pixel to metres from the camera.


class PublishedColoursEntry(Entry):
    """Touch of ObjectFolder 1.0: what a DIGIT sees of a press along the normal."""

    rows: Size = 160  #: pixels.
    columns: Size = 120  #: pixels.
    bounds_m: Bounds | None = None
    """m, least and greatest coordinate (x, y and z alike) of what the network learnt from; null where nobody
    gave them."""
    network: NetworkEntry  #: normalised place, row and column to red, green and blue, -1 to 1.


class PublishedCellsEntry(Entry):
    """The cells of a KiloOSF: a lattice over a cube, a network in each that matter may be in."""

    low: Point  #: least corner of the cube.
    high: Point  #: greatest corner.
    cells: tuple[Size, Size, Size]  #: along x, y and z.
    block: Size  #: samples of one network that are queried together.
    networks: FileEntry
    """file of ``(x y z,)`` int32: the network of each cell, x slowest; -1 where there is none."""
    occupancy: FileEntry | None = None
    """file of packed bits, x slowest, the first voxel in the highest bit; null where all is taken for
    occupied."""
    voxels: tuple[Size, Size, Size] | None = None  #: of the occupancy, along x, y and z.

    @model_validator(mode="after")
    def _agrees(self) -> Self:
        if (self.occupancy is None) != (self.voxels is None):
            raise ValueError("occupancy and voxels go together")
        return self


class PublishedVisionEntry(Entry):
    """Look of either: raw colour and density in a normalised frame, summed along rays.

    Lengths are in the frame's own unit. What it is in metres, and how it lies to the mesh, is not published.
    """

    kind: Literal["osf", "kilo-osf"]  #: ``osf`` one network for all places; ``kilo-osf`` one for each cell.
    frame: Literal["vision: normalised, z up"] = "vision: normalised, z up"  #: of points, views and light.
    near: Positive  #: along the camera's axis, the first sample.
    far: Positive  #: along the camera's axis, the last sample.
    samples: Annotated[int, Field(ge=2, le=4096)]  #: along a ray.
    importance: Annotated[int, Field(ge=0, le=4096)]
    """further samples, placed by the weights of the first; 0 for none."""
    white: bool  #: whether the background is white; else it is black.
    colour: Literal["sigmoid", "clipped"]
    """how raw colour becomes colour before it is stretched by 1.2 about 0.5."""
    network: NetworkEntry  #: the only one, or the coarse one.
    fine: NetworkEntry | None = None  #: takes the further samples; null where there are none.
    cells: PublishedCellsEntry | None = None  #: of ``kilo-osf``.

    @model_validator(mode="after")
    def _agrees(self) -> Self:
        if not self.near < self.far:
            raise ValueError(f"samples from {self.near} to {self.far}; far must be beyond near")
        if (self.kind == "kilo-osf") != (self.cells is not None):
            raise ValueError("cells belong to kilo-osf and to nothing else")
        if (self.importance > 0) != (self.fine is not None):
            raise ValueError("further samples and a fine network go together")
        return self


class PublishedDescription(Entry):
    """All of an imported ``object.json``."""

    schema_number: Literal[1] = Field(alias="schema")  #: ``schema`` in the file.
    kind: Literal["published"]
    """that it is of networks imported from a published file, not built from a mesh."""
    name: Annotated[str, Field(min_length=1, max_length=200)]  #: of the object.
    format: Format  #: of the published file.
    missing: tuple[str, ...]  #: what the file does not hold and a user may expect, a sentence each.
    dropped: dict[str, int] = Field(default_factory=dict)
    """numbers of the file that its own program never uses, by name."""
    provenance: Provenance  #: file, hash, licence.
    audio_gains: PublishedGainsEntry | None = None  #: sound of 2.0.
    audio_spectrum: PublishedSpectrumEntry | None = None  #: sound of 1.0.
    touch_depth: PublishedDepthEntry | None = None  #: touch of 2.0.
    touch_colours: PublishedColoursEntry | None = None  #: touch of 1.0.
    vision: PublishedVisionEntry | None = None  #: look of either.

    @property
    def networks(self) -> dict[str, NetworkEntry]:
        """Networks that there are, by the name of their file: audio, touch, vision, vision fine."""
        named = ((entry.file.removesuffix(".onnx").replace("_", " "), entry) for entry in self.files)
        return {name: entry for name, entry in named if isinstance(entry, NetworkEntry)}

    @property
    def files(self) -> tuple[FileEntry, ...]:
        """Every file that the folder must hold."""
        return tuple(_files_of(self))


def _files_of(table: Entry) -> Iterator[FileEntry]:
    for _, value in table:
        if isinstance(value, FileEntry):
            yield value
        elif isinstance(value, Entry):
            yield from _files_of(value)


@dataclass(frozen=True, eq=False)
class PublishedObject:
    """An object whose networks were published by others."""

    folder: Path  #: where its files are.
    description: PublishedDescription  #: contents of its ``object.json``.

    @classmethod
    def open(cls, folder: Path) -> "PublishedObject":
        """Read ``object.json``; the files are read when they are used.

        Raises:
            WrongUse: there is none, or it is of an object built from its mesh.
            DataRefused: it is damaged.
        """
        path = folder / DESCRIPTION
        tree = read_tree(path)
        if not is_published(tree):
            raise WrongUse(
                f"{folder} was built from a mesh and not imported from a published file; open it as an "
                "ObjectFile"
            )
        return cls(folder, model_from(tree, PublishedDescription, str(path)))

    def read(self, entry: FileEntry) -> bytes:
        """Read a file; ``DataRefused`` if it is missing, leads out of the folder, or its hash differs."""
        return read_named(self.folder, entry)

    def network(self, entry: NetworkEntry) -> Network:
        """Open a network; ``DataRefused`` if it is not the one described, or answers otherwise."""
        return open_network(self.read(entry), entry)


def open_either(folder: Path) -> ObjectFile | PublishedObject:
    """Open a folder of either kind; errors as of ``ObjectFile.open`` and ``PublishedObject.open``."""
    is_imported = is_published(read_tree(folder / DESCRIPTION))
    return PublishedObject.open(folder) if is_imported else ObjectFile.open(folder)
