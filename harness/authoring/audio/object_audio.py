"""From a file to an ObjectFile with a sound: intake, modes, network, measurement, writing."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from harness.authoring.audio.audio import AuthoredAudio, author_audio
from harness.authoring.audio.data import canonical
from harness.authoring.audio.profiles import profile
from harness.authoring.object_source import PartRequest, created_object, provenance_of, source_of
from harness.authoring.training import Report
from harness.basics.errors import DataRefused, MeshRefused
from harness.basics.mesh import Mesh
from harness.basics.store import Store
from harness.objectfile.audio.part import AudioPart, with_audio
from harness.objectfile.entries import Source
from harness.objectfile.file import ObjectFile, with_part
from harness.objectfile.verify import verify
from harness.sim.modal.file import modes_of_file
from harness.sim.modal.modal import HEARING, default_edge, solved_once
from harness.sim.modal.modes import Modes, dampings
from harness.sim.modal.solve import CPU, Begin, cpu, timed, wall
from harness.sim.solid.intake import surface_of
from harness.sim.solid.volume_mesh import read_volume

STAGES = ("intake", "mesh", "assemble", "solve", "order", "train", "measure", "export", "verify")
"""In their order; ``"order"`` gives signs and groups of modes one meaning (``data.canonical``)."""

MODES = 128
"""At most, where nobody asks for another number."""

_SOLVED = {"tetrahedra": "mesh", "assembly": "assemble", "solve": "solve"}
"""Names of stages, by those that the solver gives them."""

_KEPT = "its modes were kept from an earlier solution, and so are the seconds of mesh, assemble and solve"

_NEAR = 0.02
"""Of the diagonal, how far from the surface a query may be: more than a mesh is off by."""


@dataclass(frozen=True, eq=False)
class AudioRequest(PartRequest):
    """Settings of the audio part to build, by a profile of ``profiles.PROFILES``."""

    limit: float = HEARING  #: Hz, modes up to there.
    most: int = MODES  #: modes at most, the lowest.
    edge: float | None = None  #: m, longest edge of an element; None for a share of the shortest wave.


@dataclass(frozen=True, eq=False)
class BuiltAudio:
    """An ObjectFile and how it came about."""

    object: ObjectFile  #: on disk.
    modes: Modes  #: canonical.
    audio: AuthoredAudio  #: its network and errors.
    said: tuple[str, ...]  #: what was done to the mesh and what to look at.
    seconds: Mapping[str, float]
    """Duration of each of ``STAGES`` in s (``solve.timed``). If modes were stored by an earlier solution,
    ``"mesh"``, ``"assemble"`` and ``"solve"`` are the durations of that solution."""


def build_audio(
    wanted: AudioRequest, out: Path, store: Store | None, report: Report, threads: int = 1
) -> BuiltAudio:
    """Build an object's sound, or continue a build that was stopped.

    The folder ``out`` keeps its other modalities and its mesh; modes are cached in ``store``, so that a build
    that is repeated does not solve again.

    Raises:
        WrongUse: options that conflict or are out of range.
        MeshRefused: a mesh that is no solid object, or without a mode in the frequency range.
        DataRefused: the folder has an ObjectFile of another object, or a written file does not read
            back.
    """
    chosen = profile(wanted.profile)
    report("reading the mesh", 0.0)
    seconds: dict[str, float] = {}
    mesh, found, source, said = _modes(wanted, store, seconds, lambda stage: report(stage, 0.0))
    with timed(seconds, "order"):
        modes = _lowest(canonical(found), wanted.most)
    rates = dampings(modes.frequencies, wanted.material)
    with timed(seconds, "export"):
        created = created_object(wanted.mesh, wanted.licence, wanted.material, mesh, out, source)
    audio = author_audio(modes, rates, chosen, wanted.seed, report, threads)
    seconds |= audio.seconds
    report("writing", 0.0)
    part = AudioPart(
        modes=modes,
        dampings=rates,
        near_surface=_NEAR * mesh.diagonal,
        provenance=provenance_of(wanted, "audio", audio.settings, (source,)),
        graph=audio.graph,
        table=chosen.table,
        measured={"network": audio.errors["network"], "table": audio.errors["table_float16"]},
    )
    with timed(seconds, "export"):
        made = with_audio(created, part)
    report("verifying what was written", 0.0)
    with timed(seconds, "verify"):
        failed = [check for check in verify(made) if not check.passed]
        if failed:
            raise DataRefused(
                f"{made.folder}: {failed[0].check}: {failed[0].said}; delete the folder and build again"
            )
    ordered = {before + stage: seconds[before + stage] for before in ("", CPU) for stage in STAGES}
    entry = made.description.audio
    assert entry is not None
    spent = {"seconds": wall(ordered), "cpu_seconds": cpu(ordered)}
    provenance = entry.provenance.model_copy(update=spent)
    timed_file = with_part(made, "audio", entry.model_copy(update={"provenance": provenance}), {})
    return BuiltAudio(timed_file, modes, audio, said, ordered)


def _modes(
    wanted: AudioRequest, store: Store | None, seconds: dict[str, float], begin: Begin
) -> tuple[Mesh, Modes, Source, tuple[str, ...]]:
    whole: dict[str, float] = {}
    with timed(whole, "intake"):
        source = source_of(wanted.mesh, wanted.licence)
        is_file = source.sha256 is not None
        volume = is_file and read_volume(Path(wanted.mesh), wanted.units, wanted.up_axis) is not None
    if volume:
        given = Path(wanted.mesh), wanted.material, wanted.units, wanted.wall, wanted.limit
        solved = modes_of_file(*given, edge=wanted.edge, begin=begin, up_axis=wanted.up_axis)
        modes, said = solved.solution.modes, solved.notes
        mesh = Mesh(modes.points, modes.faces)
    else:
        with timed(whole, "intake"):
            taken = surface_of(wanted.mesh, wanted.units, wanted.wall, wanted.up_axis)
        edge = wanted.edge
        if edge is None:
            edge = default_edge(taken.mesh, wanted.material, wanted.limit, wanted.most)
        modes, kept = solved_once(taken.mesh, wanted.material, wanted.limit, edge, wanted.most, store, begin)
        mesh, said = taken.mesh, (*taken.said, *((_KEPT,) if kept else ()))
    none = dict.fromkeys([before + stage for before in ("", CPU) for stage in _SOLVED.values()], 0.0)
    seconds |= whole | none
    for old, new in _SOLVED.items():
        for before in ("", CPU):
            if before + old in modes.seconds:
                seconds[before + new] = modes.seconds[before + old]
    return mesh, modes, source, said


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
