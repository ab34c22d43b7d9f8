"""From a file to an ObjectFile with a sound: intake, modes, network, measurement, writing."""

import time
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from harness.authoring.audio import CHECKPOINT, AuthoredAudio, author_audio
from harness.authoring.audio_data import canonical
from harness.authoring.audio_profiles import profile
from harness.authoring.object_source import created_object, source_of, surface_of
from harness.authoring.training import Report
from harness.code_version import content_hash
from harness.errors import MeshRefused
from harness.materials import Material
from harness.mesh import Mesh
from harness.objectfile.audio_part import AudioPart, with_audio
from harness.objectfile.entries import Provenance, Source
from harness.objectfile.file import ObjectFile
from harness.sim.modal import HEARING, default_edge, modes_of
from harness.sim.modal_file import modes_of_file
from harness.sim.modes import Modes, dampings
from harness.sim.volume_mesh import read_volume
from harness.store import Store

MODES = 128
"""At most, where nobody asks for another number."""

_NEAR = 0.02
"""Of the diagonal, how far from the surface a query may be: more than a mesh is off by."""


@dataclass(frozen=True, eq=False)
class ObjectRequest:
    """What is to be built.

    Attributes:
        mesh: a file of a surface or of tetrahedra, or ``builtin:`` and a name.
        material: of all of it.
        profile: of ``audio_profiles.PROFILES``.
        units: of the file's numbers; None to take the only ones that make sense.
        wall: m, of a hollow thing of which the file has the outside.
        limit: Hz, modes up to there.
        most: modes at most, the lowest.
        edge: m, longest edge of an element; None for a share of the shortest wave.
        licence: of the mesh, and so of the ObjectFile.
        seed: of everything random.
    """

    mesh: str
    material: Material
    profile: str = "standard"
    units: str | None = None
    wall: float | None = None
    limit: float = HEARING
    most: int = MODES
    edge: float | None = None
    licence: str = "unknown"
    seed: int = 0


@dataclass(frozen=True, eq=False)
class BuiltAudio:
    """An ObjectFile and how it came about.

    Attributes:
        object: on disk.
        modes: canonical.
        audio: its network and errors.
        said: what was done to the mesh and what to look at.
        seconds: s on the clock of each stage.
    """

    object: ObjectFile
    modes: Modes
    audio: AuthoredAudio
    said: tuple[str, ...]
    seconds: Mapping[str, float]


def build_audio(
    wanted: ObjectRequest, out: Path, store: Store | None, report: Report, threads: int = 1
) -> BuiltAudio:
    """Build an object's sound, or go on with a build that was stopped.

    Args:
        wanted: what.
        out: the ObjectFile's folder; one that is there keeps its other modalities and its mesh.
        store: where modes are kept, so that a build that is begun again need not solve again.
        report: told of progress.
        threads: of a training.

    Raises:
        WrongUse: options that cannot be.
        MeshRefused: a mesh that cannot stand for an object, or none of whose modes is in reach.
        DataRefused: a checkpoint or an ObjectFile in the folder that is of something else.
    """
    chosen = profile(wanted.profile)
    begun = time.perf_counter()
    report("modes", 0.0)
    mesh, found, source, said = _modes(wanted, store)
    modes = _lowest(canonical(found), wanted.most)
    rates = dampings(modes.frequencies, wanted.material)
    solved = time.perf_counter() - begun
    created = created_object(wanted.mesh, wanted.licence, wanted.material, mesh, out, source)
    audio = author_audio(modes, rates, chosen, wanted.seed, out, report, threads)
    begun = time.perf_counter()
    report("writing", 0.0)
    provenance = Provenance(
        code={"harness.authoring.object_audio": content_hash("harness.authoring.object_audio")},
        seeds={"audio": wanted.seed},
        settings={"profile": wanted.profile, **audio.settings},
        sources=(source,),
        licence=wanted.licence,
    )
    part = AudioPart(
        modes=modes,
        dampings=rates,
        near_surface=_NEAR * mesh.diagonal,
        provenance=provenance,
        graph=audio.graph,
        measured={"network": audio.errors["network"], "table": audio.errors["table_float16"]},
    )
    made = with_audio(created, part)
    (out / CHECKPOINT).unlink(missing_ok=True)
    seconds = {"modes": solved, **audio.seconds, "write": time.perf_counter() - begun}
    return BuiltAudio(made, modes, audio, said, seconds)


def _modes(wanted: ObjectRequest, store: Store | None) -> tuple[Mesh, Modes, Source, tuple[str, ...]]:
    source = source_of(wanted.mesh, wanted.licence)
    if source.sha256 is not None and read_volume(Path(wanted.mesh), wanted.units) is not None:
        path = Path(wanted.mesh)
        solved = modes_of_file(
            path, wanted.material, wanted.units, wanted.wall, wanted.limit, edge=wanted.edge
        )
        modes = solved.solution.modes
        return Mesh(modes.points, modes.faces), modes, source, solved.said
    taken = surface_of(wanted.mesh, wanted.units, wanted.wall)
    return taken.mesh, _solved(wanted, taken.mesh, store), source, taken.said


def _solved(wanted: ObjectRequest, mesh: Mesh, store: Store | None) -> Modes:
    edge = wanted.edge
    if edge is None:
        edge = default_edge(mesh, wanted.material, wanted.limit, wanted.most)
    return modes_of(mesh, wanted.material, wanted.limit, edge, wanted.most, store)


def _lowest(modes: Modes, most: int) -> Modes:
    if len(modes.frequencies) == 0:
        raise MeshRefused(
            f"the object has no mode up to {modes.limit:g} Hz, so it has no sound there; "
            "ask for modes up to a higher frequency"
        )
    if len(modes.frequencies) <= most:
        return modes
    kept = modes.frequencies[:most]
    return replace(
        modes,
        frequencies=kept,
        shapes=np.ascontiguousarray(modes.shapes[:, :most]),
        limit=float(kept[-1]),
    )
