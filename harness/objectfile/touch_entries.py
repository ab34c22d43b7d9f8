"""The tables of ``object.json`` that say what an object's touch is."""

from typing import Annotated, ClassVar, Self

import numpy as np
from pydantic import Field, model_validator

from harness.basics.arrays import FloatArray
from harness.bench.sensor import TactileSensor
from harness.objectfile.entries import Entry, FileEntry, Modality, NetworkEntry, Provenance
from harness.sim.gel.gel import GelSkirt

Positive = Annotated[float, Field(gt=0.0)]
Size = Annotated[int, Field(ge=1)]

MAP_RANGE = 2e-3
"""m that the decibels of a model card are of: the deepest press that errors are measured on."""

WORST_OF_TEN = "unseen_places_psnr_db_p10"
"""On a model card: nine of ten maps at places that were never coded are at least so near."""

_COARSE = 4


def rms_at(decibels: FloatArray | float) -> FloatArray:
    """m, root mean square over a whole map, of a model card's PSNR in dB."""
    return np.asarray(MAP_RANGE * 10.0 ** (-0.05 * np.asarray(decibels)))


def ray_pixels(rows: int, columns: int) -> int:
    """Pixels of a gel, each way, to one ray of what is only looked at coarsely."""
    return _COARSE if rows % _COARSE == 0 and columns % _COARSE == 0 else 1


class GelEntry(Entry):
    """The flat gel that the maps are of, and its skirt in its own pixels."""

    name: str  #: of the sensor's make.
    rows: Size  #: pixels.
    columns: Size  #: pixels.
    pitch_m: Positive  #: m, of a pixel.
    thickness_m: Positive  #: m, of the gel.
    skirt_kernels: tuple[Size, ...]  #: pixels, widths of the pyramid of blurs.
    skirt_final: Size  #: pixels, width of the last blur.
    skirt_core: Annotated[float, Field(ge=0.0, le=1.0)]
    """share of the greatest depth from which the object shapes the gel."""

    @classmethod
    def of(cls, sensor: TactileSensor, skirt: GelSkirt) -> Self:
        """The entry of a sensor."""
        return cls(
            name=sensor.name,
            rows=sensor.rows,
            columns=sensor.columns,
            pitch_m=sensor.pitch,
            thickness_m=sensor.gel_thickness,
            skirt_kernels=skirt.kernels,
            skirt_final=skirt.final,
            skirt_core=skirt.core,
        )

    @property
    def sensor(self) -> TactileSensor:
        """Its geometry again."""
        return TactileSensor(self.name, self.rows, self.columns, self.pitch_m, self.thickness_m)

    @property
    def skirt(self) -> GelSkirt:
        """Its skirt again."""
        return GelSkirt(self.skirt_kernels, self.skirt_final, self.skirt_core)

    @property
    def ray_pixels(self) -> int:
        """Pixels, each way, to one ray of ``gaps``."""
        return ray_pixels(self.rows, self.columns)


class CodesEntry(Entry):
    """Codes of the surface."""

    network: NetworkEntry  #: graph from a node and the gel's pose to a map.
    nodes: FileEntry  #: places and outward normals.
    most_off_m: Positive  #: m, how far a press may be from a node.
    deepest_m: Positive
    """m, the greatest depth of a press; the least is 0, as a press is a motion and not learned."""
    most_tilt_rad: Annotated[float, Field(gt=0.0, lt=1.5)]  #: rad, the greatest tilt.

    @property
    def stated_rms(self) -> float:
        """m, root mean square over a whole map, that nine of ten maps at places never coded are within.

        What its card states, for whoever compares readings with it; 0 where the card states no error.
        """
        decibels = self.network.measured.get(WORST_OF_TEN, np.inf)
        return float(rms_at(decibels))


class TouchEntry(Entry):
    """The object's touch: what may be queried, and the codes that answer."""

    gel: GelEntry  #: that the maps are of.
    depth_m: tuple[Positive, Positive]  #: m, least and greatest depth of a press, but for codes.
    most_tilt_rad: Annotated[float, Field(gt=0.0, lt=1.5)]  #: rad, the greatest tilt, but for codes.
    near_surface_m: Positive  #: m, how far from the surface a contact may be.
    codes: CodesEntry | None = None  #: network of the level ``codes``; earlier versions could leave it out.
    perceptron: NetworkEntry | None = None  #: network of ObjectFolder 2.0 of earlier versions; not rendered.
    provenance: Provenance  #: of the touch.

    sense: ClassVar[Modality] = "touch"

    @property
    def files(self) -> tuple[FileEntry, ...]:
        """All that the folder must hold for it."""
        codes = () if self.codes is None else (self.codes.network, self.codes.nodes)
        return codes if self.perceptron is None else (*codes, self.perceptron)

    @model_validator(mode="after")
    def _agrees(self) -> Self:
        if self.codes is None and self.perceptron is None:
            raise ValueError("there are neither codes nor a perceptron")
        if self.depth_m[0] > self.depth_m[1]:
            raise ValueError(
                f"depth_m runs from {self.depth_m[0]} to {self.depth_m[1]}; the lesser comes first"
            )
        image = ("n", self.gel.rows, self.gel.columns)
        if self.codes is not None:
            inputs = [("node", "int64", ("n", 1)), ("node_from_gel", "float64", ("n", 3, 4))]
            every = self.gel.ray_pixels
            rays = ("n", self.gel.rows // every, self.gel.columns // every)
            outputs = [("maps", "float32", image), ("gaps", "float32", rays)]
            network = self.codes.network
            taken = [(tensor.name, tensor.dtype, tensor.shape) for tensor in network.inputs]
            given = [(tensor.name, tensor.dtype, tensor.shape) for tensor in network.outputs]
            if taken != inputs or given != outputs:
                raise ValueError(
                    f"its codes take {taken} and give {given}, where touch has {inputs} and {outputs}; build "
                    "the touch again"
                )
        return self
