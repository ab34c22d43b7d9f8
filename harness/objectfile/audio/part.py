"""Writing the sound of an ObjectFile: the modes, the network's graph, the table, their self-test."""

from collections.abc import Mapping
from dataclasses import dataclass, field

from onnx import ModelProto

from harness.basics.arrays import FloatArray
from harness.basics.errors import WrongUse
from harness.basics.mesh import Mesh
from harness.basics.toml_file import validate
from harness.objectfile.audio.table import scaled
from harness.objectfile.entries import (
    AudioEntry,
    Domain,
    Input,
    Provenance,
    TableEntry,
    Tensor,
)
from harness.objectfile.file import ObjectFile, file_entry, with_part
from harness.objectfile.network_part import NetworkPart, network_entry
from harness.objectfile.npy_file import npy_bytes
from harness.objectfile.surface_file import ply_bytes
from harness.objectfile.surface_search import SurfaceSearch
from harness.sim.modal.modes import Modes

NETWORK = "audio.onnx"
TABLE = "audio_table.npy"
TABLE_SURFACE = "audio_surface.ply"

_SELF_TEST_POINTS = 4
_TOLERANCE = 1e-4
"""Of the self-test, of the greatest gain: thirty times what float32 loses in these networks
(3e-6 against float64), and a hundredth of what a network may be wrong by."""


@dataclass(frozen=True, eq=False)
class AudioPart:
    """A sound to be written."""

    modes: Modes  #: of the finite-element mesh; its surface is where the table is exact.
    dampings: FloatArray  #: ``(m,)`` 1/s.
    near_surface: float  #: m, the farthest from the object's surface that a query may be.
    provenance: Provenance  #: of the sound.
    graph: ModelProto | None  #: of the network (``audio_graph``); None for a table alone.
    table: bool = True  #: whether the exact shapes are kept too.
    measured: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    """errors of each level, ``"network"`` and ``"table"``, by a name with its unit."""


def with_audio(of: ObjectFile, part: AudioPart) -> ObjectFile:
    """The ObjectFile with this sound written into it.

    Raises:
        WrongUse: there is neither a graph nor a table, or numbers that are no modes.
        DataRefused: a graph that must not be run, or that gives something else than the modes ask for.
    """
    modes = part.modes
    if part.graph is None and not part.table:
        raise WrongUse("a sound needs a network or a table; give a graph, or table=True")
    if part.dampings.shape != modes.frequencies.shape:
        raise WrongUse(
            f"{len(modes.frequencies)} modes and dampings of shape {part.dampings.shape}; one for each"
        )
    contents: dict[str, bytes] = {}
    network = table = None
    if part.graph is not None:
        points, gains = network_tensors(len(modes.frequencies), part.near_surface)
        asked = {"points": SurfaceSearch(of.mesh).spread(_SELF_TEST_POINTS)[0]}
        measured = part.measured.get("network", {})
        written = NetworkPart(NETWORK, part.graph, (points,), (gains,), asked, _TOLERANCE, measured)
        network = network_entry(written, contents)
    if part.table:
        halves, scales = scaled(modes.shapes)
        contents[TABLE] = npy_bytes(halves, "<f2")
        contents[TABLE_SURFACE] = ply_bytes(Mesh(modes.points, modes.faces))
        table = TableEntry(
            **file_entry(TABLE, contents[TABLE]).model_dump(),
            surface=file_entry(TABLE_SURFACE, contents[TABLE_SURFACE]),
            scales=tuple(scales.tolist()),
            measured=dict(part.measured.get("table", {})),
        )
    described = {
        "frequencies_hz": modes.frequencies.tolist(),
        "dampings_per_s": part.dampings.tolist(),
        "complete_up_to_hz": modes.limit,
        "mass_kg": modes.mass,
        "rigid_modes": modes.rigid,
        "nodes": modes.nodes,
        "elements": modes.elements,
        "residual": modes.residual,
        "near_surface_m": part.near_surface,
        "network": network,
        "table": table,
        "provenance": part.provenance,
    }
    entry = validate(described, AudioEntry, f"the sound of {of.description.name}")
    return with_part(of, "audio", entry, contents)


def network_tensors(modes: int, near_surface: float) -> tuple[Input, Tensor]:
    """Describe input and output of a network of sound; ``near_surface`` is as in ``AudioPart``."""
    points = Input(
        name="points",
        dtype="float64",
        shape=("n", 3),
        unit="m",
        meaning="where the object is struck",
        frame="object",
        domain=Domain(near_surface_m=near_surface),
        normaliser="in the graph",
    )
    gains = Tensor(
        name="gains",
        dtype="float32",
        shape=("n", modes, 3),
        unit="1/sqrt(kg)",
        meaning="mass-normalised shape of each mode: its gain for a unit force along x, y, z",
        frame="object",
    )
    return points, gains
