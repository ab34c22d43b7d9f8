"""The table of ``object.json`` that says what an object's look is."""

from typing import Annotated, ClassVar, Literal, Self

from pydantic import Field, model_validator

from harness.objectfile.entries import Entry, FileEntry, Modality, NetworkEntry, Provenance
from harness.objectfile.vision_tensors import EXTRAS, MOST_CELLS, Corner, Kind, box_tensors

Positive = Annotated[float, Field(gt=0.0)]
Cells = Annotated[int, Field(ge=1, le=MOST_CELLS)]


class VisionGridEntry(Entry):
    """Where the networks answer: cubes of a lattice in the object's frame; which ones, the graph says."""

    low_m: Corner  #: m, least corner of the lattice.
    cell_m: Positive  #: m, side of a cell.
    cells: tuple[Cells, Cells, Cells]  #: along x, y and z.
    networks: Annotated[int, Field(ge=1)]  #: cells that have one.

    @property
    def box(self) -> tuple[Corner, Corner]:
        """Least and greatest corner, m."""
        x, y, z = (low + self.cell_m * count for low, count in zip(self.low_m, self.cells, strict=True))
        return self.low_m, (x, y, z)


class VisionSizeEntry(Entry):
    """How large each network is, as ``NetworkSize``, and the samples of a block."""

    width: Annotated[int, Field(ge=8, le=256, multiple_of=8)]
    octaves: Annotated[int, Field(ge=0, le=10)]
    turns: Annotated[int, Field(ge=0, le=10)]
    block: Annotated[int, Field(ge=1, le=1024)]


class VisionShellEntry(Entry):
    """The depth behind the surface to which the networks were trained."""

    voxels_per_cell: Annotated[int, Field(ge=4, le=64, multiple_of=4)]
    """the unit of that depth, along a side of a cell."""
    deep_voxels: Annotated[float, Field(ge=0.0, le=64.0)]  #: behind the surface.


class VisionEntry(Entry):
    """The object's look: the networks, where they answer, and how their numbers are meant."""

    level: Kind
    """inputs of a network: ``osf`` place, view and light, as the paper's; ``osf-v`` also the light's
    visibility and the surface's normal."""
    metres_per_unit: Positive = 1.0  #: of the graph's points.
    camera: Literal["OpenCV: x right, y down, z forward"] = "OpenCV: x right, y down, z forward"
    """its frame."""
    pixel: Literal["row i, column j: centre at x = j + 0.5, y = i + 0.5"] = (
        "row i, column j: centre at x = j + 0.5, y = i + 0.5"
    )
    """where its centre is."""
    views: Literal["unit, from the camera"] = "unit, from the camera"  #: the direction of a ray.
    light: Literal["unit, towards the lamp; irradiance pi"] = "unit, towards the lamp; irradiance pi"
    """the direction of a light."""
    colour: Literal["linear, sRGB primaries"] = "linear, sRGB primaries"  #: of the answers.
    density_per_m: Positive  #: 1/m that a density of 1 stands for.
    grid: VisionGridEntry  #: of cells.
    size: VisionSizeEntry  #: of each network.
    shell: VisionShellEntry  #: in which the networks answer.
    network: NetworkEntry  #: the graph; errors on held-out pictures under ``measured``.
    surface: FileEntry | None = None  #: that pictures are drawn along; null where it is the mesh.
    provenance: Provenance  #: of the look.

    sense: ClassVar[Modality] = "vision"

    @property
    def files(self) -> tuple[FileEntry, ...]:
        """All that the folder must hold for it."""
        return (self.network,) if self.surface is None else (self.network, self.surface)

    @model_validator(mode="after")
    def _agrees(self) -> Self:
        if self.metres_per_unit != 1.0:
            raise ValueError(
                f"metres_per_unit is {self.metres_per_unit}; graphs of vision take metres, and it must be 1"
            )
        inputs, outputs = box_tensors(self.grid.networks, self.grid.box, EXTRAS[self.level], self.size.block)
        for wanted, found in ((inputs, self.network.inputs), (outputs, self.network.outputs)):
            if found != wanted:
                names = [tensor.name for tensor in found]
                odd = [one.name for one, other in zip(wanted, found, strict=False) if one != other]
                raise ValueError(
                    f"its network has {names}, of which {odd or 'the number'} is not what the level "
                    f"{self.level!r} with this grid and block takes and gives"
                )
        return self
