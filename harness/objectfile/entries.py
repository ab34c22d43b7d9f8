"""The tables of ``object.json``: files, what graphs take and give, where parts come from."""

import re
from typing import Annotated, ClassVar, Literal, Self

from pydantic import AfterValidator, ConfigDict, Field, model_validator

from harness.basics.materials import Material
from harness.basics.toml_file import StrictModel
from harness.objects.builtin import DESCRIPTION

Modality = Literal["audio", "touch", "vision"]

MOST_BYTES = 512 * 2**20
"""Of one file; nothing larger is read. A published look has 4096 networks, 317 MiB in float32."""

_FILE_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9._-]{0,63}")


def _plain_name(name: str) -> str:
    if not _FILE_NAME.fullmatch(name) or name == DESCRIPTION:
        raise ValueError("it must be the name of a file beside object.json: letters, digits, . _ -")
    return name


class Entry(StrictModel):
    """A table of ``object.json``; NaN and infinity are refused as unknown keys are."""

    model_config = ConfigDict(allow_inf_nan=False)


class FileEntry(Entry):
    """A file of the folder, and what its bytes must be."""

    file: Annotated[str, AfterValidator(_plain_name)]  #: its name, beside ``object.json``.
    sha256: Annotated[str, Field(pattern=r"^[0-9a-f]{64}$")]  #: of its bytes, hexadecimal.
    bytes: Annotated[int, Field(gt=0, le=MOST_BYTES)]  #: its size.


class Source(Entry):
    """Something that was taken from elsewhere."""

    what: str
    origin: str
    licence: str
    sha256: str | None = None
    metres_per_unit: Annotated[float, Field(gt=0.0)] | None = None


class Provenance(Entry):
    """How a part came to be, so that it can be made again."""

    code: dict[str, str] = Field(default_factory=dict)  #: versions and hashes of the programs.
    seeds: dict[str, int] = Field(default_factory=dict)  #: of everything random, by name.
    settings: dict[str, str | float | int | bool | None] = Field(default_factory=dict)
    """that it was built with, by name."""
    sources: tuple[Source, ...] = ()  #: that it was made from.
    licence: str  #: of the part.
    made: str | None = None  #: date, if whoever built it wants one.
    seconds: dict[str, float] = Field(default_factory=dict)  #: on the clock, by stage.
    cpu_seconds: dict[str, float] = Field(default_factory=dict)  #: of the processor, by stage.


class MaterialEntry(Entry):
    """As the modes and their dampings were computed with."""

    name: str
    density_kg_per_m3: Annotated[float, Field(gt=0.0)]
    young_pa: Annotated[float, Field(gt=0.0)]
    poisson: Annotated[float, Field(gt=-1.0, lt=0.5)]
    rayleigh_alpha_per_s: Annotated[float, Field(ge=0.0)]
    rayleigh_beta_s: Annotated[float, Field(ge=0.0)]

    @classmethod
    def of(cls, material: Material) -> Self:
        """Return the entry of a material."""
        return cls(
            name=material.name,
            density_kg_per_m3=material.density,
            young_pa=material.young,
            poisson=material.poisson,
            rayleigh_alpha_per_s=material.alpha,
            rayleigh_beta_s=material.beta,
        )

    def material(self) -> Material:
        """Return the material again."""
        return Material(
            self.name,
            self.density_kg_per_m3,
            self.young_pa,
            self.poisson,
            self.rayleigh_alpha_per_s,
            self.rayleigh_beta_s,
        )


class MeshEntry(FileEntry):
    """The object's surface: what every point of a query is near to."""

    metres_per_unit: Annotated[float, Field(gt=0.0)]  #: of the numbers in the file.
    vertices: Annotated[int, Field(ge=3)]  #: their number.
    faces: Annotated[int, Field(ge=1)]  #: their number.
    low_m: tuple[float, float, float]  #: m, least corner of the bounding box.
    high_m: tuple[float, float, float]  #: m, greatest corner of the bounding box.


class Tensor(Entry):
    """An input or output of a graph; the first number of its shape is ``"n"``, that of queries."""

    name: str
    dtype: Literal["float16", "float32", "float64", "int32", "int64"]
    shape: Annotated[tuple[Annotated[int, Field(ge=1)] | Literal["n"], ...], Field(min_length=1)]
    unit: str
    meaning: str
    frame: str = ""

    @model_validator(mode="after")
    def _by_queries(self) -> Self:
        if [size == "n" for size in self.shape] != [True] + [False] * (len(self.shape) - 1):
            raise ValueError(f"its shape {self.shape} must begin with 'n' and have no other")
        return self


class Domain(Entry):
    """What the numbers of an input may be.

    Either each number lies from ``low`` to ``high``; or they are points in metres, no farther from
    the object's surface than ``near_surface_m``.
    """

    low: tuple[float, ...] | None = None
    high: tuple[float, ...] | None = None
    near_surface_m: Annotated[float, Field(gt=0.0)] | None = None

    @model_validator(mode="after")
    def _one_kind(self) -> Self:
        if (self.low is None) != (self.high is None) or (self.low is None) == (self.near_surface_m is None):
            raise ValueError("say either low and high, or near_surface_m")
        if self.low is not None and self.high is not None:
            ordered = all(a <= b for a, b in zip(self.low, self.high, strict=False))
            if len(self.low) != len(self.high) or not ordered:
                raise ValueError("low and high have as many numbers, and none of low is above high's")
        return self


class Input(Tensor):
    """What a graph takes, where it was made for, and that its normaliser is inside."""

    domain: Domain
    normaliser: Literal["in the graph"]


class Whole(Entry):
    """All numbers of an array, row by row."""

    name: str
    values: tuple[float, ...]


class Sampled(Entry):
    """Some numbers of an array: which (counted row by row), and their values."""

    name: str
    at: Annotated[tuple[Annotated[int, Field(ge=0)], ...], Field(min_length=1)]
    values: tuple[float, ...]

    @model_validator(mode="after")
    def _as_many(self) -> Self:
        if len(self.at) != len(self.values):
            raise ValueError(f"{len(self.at)} places and {len(self.values)} values")
        return self


class SelfTest(Entry):
    """What a graph gave when it was made."""

    rows: Annotated[int, Field(ge=1)]  #: the number of queries, ``n``.
    inputs: Annotated[tuple[Whole, ...], Field(min_length=1)]  #: the queries.
    outputs: Annotated[tuple[Sampled, ...], Field(min_length=1)]  #: some of the answers.
    tolerance: Annotated[float, Field(gt=0.0, le=0.1)]
    """that a number may differ by, in the greatest one of that output that is kept here."""


class NetworkEntry(FileEntry):
    """A graph in ONNX: what goes in, what comes out, and how to see that it still does."""

    inputs: Annotated[tuple[Input, ...], Field(min_length=1)]  #: of the graph.
    outputs: Annotated[tuple[Tensor, ...], Field(min_length=1)]  #: of the graph.
    self_test: SelfTest  #: queries with their answers.
    measured: dict[str, float] = Field(default_factory=dict)  #: errors, by names with their unit.

    @model_validator(mode="after")
    def _tests_all(self) -> Self:
        asked = ([item.name for item in self.inputs], [item.name for item in self.outputs])
        kept = ([item.name for item in self.self_test.inputs], [item.name for item in self.self_test.outputs])
        if asked != kept:
            raise ValueError(f"self_test is of {kept} where the graph has {asked}")
        return self


class TableEntry(FileEntry):
    """The modes' shapes at the nodes of a surface, each mode divided by its scale, as float16."""

    surface: FileEntry
    scales: tuple[Annotated[float, Field(gt=0.0)], ...]
    measured: dict[str, float] = Field(default_factory=dict)


class AudioEntry(Entry):
    """The object's sound: its modes, and one or two ways to their shapes near the surface."""

    frequencies_hz: Annotated[tuple[Annotated[float, Field(gt=0.0)], ...], Field(min_length=1)]
    """Hz, undamped, ascending."""
    dampings_per_s: tuple[Annotated[float, Field(ge=0.0)], ...]  #: 1/s: a mode decays as ``exp(-d t)``.
    complete_up_to_hz: Annotated[float, Field(gt=0.0)]  #: Hz below which no mode is missing.
    mass_kg: Annotated[float, Field(gt=0.0)]  #: kg.
    rigid_modes: Annotated[int, Field(ge=0)]  #: left out.
    nodes: Annotated[int, Field(ge=4)]  #: of the finite-element mesh.
    elements: Annotated[int, Field(ge=1)]  #: of the finite-element mesh.
    residual: Annotated[float, Field(ge=0.0)]  #: the greatest relative residual of a mode.
    near_surface_m: Annotated[float, Field(gt=0.0)]  #: m, how far from the surface a query may be.
    network: NetworkEntry | None = None  #: of the shapes.
    table: TableEntry | None = None  #: of the shapes.
    provenance: Provenance  #: of the sound.

    sense: ClassVar[Modality] = "audio"

    @property
    def files(self) -> tuple[FileEntry, ...]:
        """All that the folder must hold for it."""
        surface = None if self.table is None else self.table.surface
        return tuple(entry for entry in (self.network, self.table, surface) if entry is not None)

    @model_validator(mode="after")
    def _agrees(self) -> Self:
        modes = len(self.frequencies_hz)
        if len(self.dampings_per_s) != modes:
            raise ValueError(f"{modes} frequencies and {len(self.dampings_per_s)} dampings")
        if list(self.frequencies_hz) != sorted(self.frequencies_hz):
            raise ValueError("frequencies_hz must ascend")
        if self.network is None and self.table is None:
            raise ValueError("there is neither a network nor a table")
        if self.network is not None:
            taken = [(tensor.name, tensor.dtype, tensor.shape) for tensor in self.network.inputs]
            given = [(tensor.name, tensor.dtype, tensor.shape) for tensor in self.network.outputs]
            wanted = [("points", "float64", ("n", 3))], [("gains", "float32", ("n", modes, 3))]
            if (taken, given) != wanted:
                raise ValueError(
                    f"its network takes {taken} and gives {given}, where sound is float64 points (n, 3) "
                    f"to float32 gains (n, {modes}, 3)"
                )
            if self.network.inputs[0].domain.near_surface_m != self.near_surface_m:
                raise ValueError(
                    f"the domain of its network's points must say near_surface_m = {self.near_surface_m}"
                )
        if self.table is not None and len(self.table.scales) != modes:
            raise ValueError(f"{modes} frequencies and {len(self.table.scales)} scales of the table")
        return self
