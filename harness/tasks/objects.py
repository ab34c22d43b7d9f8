"""ObjectFiles: opened, checked and built."""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TypeVar

import numpy as np

from harness.authoring.audio.object_audio import MODES, AudioRequest, BuiltAudio, build_audio
from harness.authoring.object_source import PartRequest
from harness.authoring.touch.object_touch import BuiltTouch, TouchRequest, build_touch
from harness.authoring.vision.object_vision import BuiltVision, build_vision
from harness.basics.arrays import FloatArray
from harness.basics.errors import DataRefused, WrongUse
from harness.basics.files.lock_file import hold_folder
from harness.basics.materials import Material
from harness.basics.materials import material as named
from harness.basics.result import HIDDEN, JSON_ONLY, JsonValue, Result
from harness.basics.store import Store, default_folder
from harness.bench.scene_objectfile import find_objectfile
from harness.bench.sensor import DEFAULT_MAKE, described_sensor
from harness.objectfile.description import Description
from harness.objectfile.file import ObjectFile
from harness.objectfile.published.entries import PublishedDescription, PublishedObject, open_either
from harness.objectfile.verify import ObjectCheck, verify
from harness.sim.modal.modal import HEARING
from harness.sim.modal.solve import cpu, wall

Part = TypeVar("Part")

Report = Callable[[str, float], None]
"""Called with the stage of a computation and the fraction of it that is done."""


def load_object(folder: str | Path) -> ObjectFile | PublishedObject:
    """Open an ObjectFile by its folder or its name, e.g. ``mug``; networks are loaded on first use.

    Raises:
        WrongUse: there is no ObjectFile.
        DataRefused: its ``object.json`` is damaged or of another version.
    """
    return open_either(find_objectfile(folder))


@dataclass(frozen=True, eq=False)
class ObjectInfo(Result):
    """An ObjectFile, as its ``object.json`` describes it."""

    folder: Path = field(metadata=JSON_ONLY)
    description: Description | PublishedDescription = field(metadata=HIDDEN)

    def as_json(self) -> dict[str, JsonValue]:
        """Return the folder and the content of the file as JSON values."""
        return {"folder": str(self.folder), **self.description.model_dump(mode="json", by_alias=True)}

    def summary(self) -> tuple[str, ...]:
        """List the object, its senses and its networks."""
        return tuple(describe_object(self.description))


def describe_object(of: Description | PublishedDescription) -> list[str]:
    """Describe an object, its senses and its networks, one per line."""
    if isinstance(of, PublishedDescription):
        return _published_lines(of)
    mesh, material, audio, touch, vision = of.mesh, of.material, of.audio, of.touch, of.vision
    size = " x ".join(f"{(b - a) * 1e3:.4g}" for a, b in zip(mesh.low_m, mesh.high_m, strict=True))
    lines = [
        f"{of.name}, of {material.name}",
        f"  mesh      {mesh.file}: {mesh.vertices} vertices, {mesh.faces} faces, {size} mm",
        f"  material  {material.density_kg_per_m3:g} kg/m3, E = {material.young_pa:g} Pa, "
        f"nu = {material.poisson:g}, alpha = {material.rayleigh_alpha_per_s:g}/s, "
        f"beta = {material.rayleigh_beta_s:g} s",
        f"  licence   {of.provenance.licence}",
    ]

    def part(label: str, file: str, size: int, measured: Mapping[str, float] | None) -> None:
        errors = "".join(f"; {name} {number:.4g}" for name, number in (measured or {}).items())
        lines.append(f"    {label:<7} {file}, {size / 1e6:.2f} MB{errors}")

    if audio is None:
        lines.append("  audio     none yet")
    else:
        low, high = audio.frequencies_hz[0], audio.frequencies_hz[-1]
        lines.append(
            f"  audio     {len(audio.frequencies_hz)} modes, {low:.5g} to {high:.5g} Hz, all up to "
            f"{audio.complete_up_to_hz:.5g} Hz; {audio.mass_kg:.4g} kg; queries within "
            f"{audio.near_surface_m * 1e3:g} mm of the surface"
        )
        if audio.network is not None:
            part("network", audio.network.file, audio.network.bytes, audio.network.measured)
        if audio.table is not None:
            size_of_table = audio.table.bytes + audio.table.surface.bytes
            part("table", audio.table.file, size_of_table, audio.table.measured)
    if touch is None:
        lines.append("  touch     none yet")
    else:
        gel, (shallow, deep) = touch.gel, touch.depth_m
        lines.append(
            f"  touch     {gel.name}, {gel.rows} x {gel.columns}; {shallow * 1e3:g} to {deep * 1e3:g} mm "
            f"deep, tilts to {math.degrees(touch.most_tilt_rad):g} deg"
        )
        if touch.codes is not None:
            network = touch.codes.network
            part("codes", network.file, network.bytes + touch.codes.nodes.bytes, network.measured)
        if touch.perceptron is not None:
            part("perceptron (not rendered)", touch.perceptron.file, touch.perceptron.bytes, None)
    if vision is None:
        return [*lines, "  vision    none yet"]
    lines.append(
        f"  vision    {vision.level}: {vision.grid.networks} networks {vision.size.width} wide, in cubes of "
        f"{vision.grid.cell_m * 1e3:.4g} mm; {vision.colour}, camera as {vision.camera}"
    )
    part("network", vision.network.file, vision.network.bytes, vision.network.measured)
    return lines


def _published_lines(of: PublishedDescription) -> list[str]:
    """Describe imported networks: the source, the tables of each sense, and what the file did not hold."""
    source = of.provenance.sources[0]
    lines = [
        f"{of.name}, imported from {source.origin} ({of.format})",
        f"  sha256    {source.sha256}",
        f"  licence   {of.provenance.licence}",
    ]
    for sense in ("audio_gains", "audio_spectrum", "touch_depth", "touch_colours", "vision"):
        tables = []
        for key, value in getattr(of, sense) or ():
            if isinstance(value, tuple) and len(value) > 3:
                tables.append(f"{len(value)} {key} from {min(value):.5g} to {max(value):.5g}")
            elif isinstance(value, tuple | float | int | str):
                tables.append(f"{key} {value}")
        if tables:
            lines.append(f"  {sense}: {'; '.join(tables)}")
    dropped = sum(of.dropped.values())
    if dropped:
        lines.append(f"  dropped   {dropped} weights in {len(of.dropped)} layers that nothing uses")
    return [*lines, *(f"  lacks     {sentence}" for sentence in of.missing)]


@dataclass(frozen=True)
class VerifiedObject(Result):
    """All checks of an ObjectFile."""

    folder: Path
    verified: bool  #: whether every check passed.
    checks: tuple[ObjectCheck, ...] = field(metadata=JSON_ONLY)

    def summary(self) -> tuple[str, ...]:
        """List the checks, and how many failed."""
        failed = sum(not check.passed for check in self.checks)
        lines = (
            f"{'ok  ' if check.passed else 'FAIL'}  {check.check}: {check.said}" for check in self.checks
        )
        number = len(self.checks)
        return (*lines, f"{failed} of {number} checks failed" if failed else f"all {number} checks hold")


def verify_object(folder: str | Path) -> VerifiedObject:
    """Check hashes, graphs, shapes and known answers of an ObjectFile; nothing in it can run code.

    Raises:
        WrongUse: there is no ObjectFile.
        DataRefused: its ``object.json`` is damaged or of another version.
    """
    checks = tuple(verify(load_object(folder)))
    return VerifiedObject(Path(folder), all(check.passed for check in checks), checks)


@dataclass(frozen=True, eq=False)
class AudioBuild(Result):
    """The sound of an object, built into its ObjectFile."""

    folder: Path  #: of the ObjectFile.
    frequencies_hz: FloatArray  #: ``(modes,)``.
    dampings_per_s: FloatArray  #: ``(modes,)`` decay rates.
    unknowns: int  #: degrees of freedom of the finite-element model.
    vertices: int  #: of the surface.
    held_out: int  #: vertices that the network was not trained on, where errors are measured.
    settings: Mapping[str, JsonValue] = field(metadata=JSON_ONLY)  #: of the training.
    errors: Mapping[str, Mapping[str, float]]  #: at held-out vertices: by source of the gains and by measure.
    seconds: Mapping[str, float]  #: wall time by stage.
    cpu_seconds: Mapping[str, float]  #: CPU time by stage.
    notes: tuple[str, ...] = field(metadata=JSON_ONLY)
    built: BuiltAudio = field(metadata=HIDDEN)

    def summary(self) -> tuple[str, ...]:
        """State the size of the problem."""
        number = len(self.frequencies_hz)
        return (
            f"{self.folder}: {number} modes, {self.held_out} of {self.vertices} vertices held out; "
            f"{sum(self.seconds.values()):.1f} s",
        )


@dataclass(frozen=True, eq=False)
class TouchBuild(Result):
    """The touch of an object, built into its ObjectFile."""

    folder: Path  #: of the ObjectFile.
    nodes: int  #: coded points of the surface.
    settings: Mapping[str, JsonValue] = field(metadata=JSON_ONLY)  #: of the training.
    errors: Mapping[str, Mapping[str, Mapping[str, float]]]  #: by kind of point, source and measure.
    measured: Mapping[str, float]  #: errors that the ObjectFile states.
    bytes: int
    seconds: Mapping[str, float]  #: wall time by stage.
    notes: tuple[str, ...] = field(metadata=JSON_ONLY)
    built: BuiltTouch = field(metadata=HIDDEN)

    def summary(self) -> tuple[str, ...]:
        """State what the errors are of."""
        return (
            f"{self.folder}: {self.nodes} coded points; errors of presses by codes, by the nearest trained "
            "point and of an untouched gel (background)",
        )


@dataclass(frozen=True, eq=False)
class VisionBuild(Result):
    """The appearance of an object, built into its ObjectFile."""

    folder: Path  #: of the ObjectFile.
    level: str  #: kind of networks.
    networks: int
    cell_m: float  #: edge of the cube of one network.
    width: int  #: of a network's layers.
    settings: Mapping[str, JsonValue] = field(metadata=JSON_ONLY)  #: of the training.
    errors: Mapping[str, float]  #: on pictures of held-out cameras and lights.
    bytes: int
    seconds: Mapping[str, float]  #: wall time by stage.
    seconds_in_all: float
    notes: tuple[str, ...] = field(metadata=JSON_ONLY)
    built: BuiltVision = field(metadata=HIDDEN)

    def summary(self) -> tuple[str, ...]:
        """State what the errors are of."""
        return (f"{self.folder}: {self.networks} networks; errors on pictures never trained on",)


def build_objectfile(
    mesh: str | Path,
    out: Path,
    material: str | Material,
    only: str = "audio",
    profile: str = "standard",
    units: str | None = None,
    up_axis: str | None = None,
    wall: float | None = None,
    up_to: float = HEARING,
    count: int = MODES,
    edge: float | None = None,
    licence: str = "unknown",
    seed: int = 0,
    threads: int | None = None,
    sensor: str | None = None,
    report: Report = lambda _stage, _fraction: None,
) -> AudioBuild | TouchBuild | VisionBuild:
    """Build the sound, the touch or the appearance of an object: networks, with their measured errors.

    A build that was stopped continues where it was when it is called again.

    Args:
        mesh: file of a closed surface, or ``"builtin:mug"``.
        out: folder of the ObjectFile; other modalities that it holds are kept.
        material: name, or a ``Material``.
        only: modality to build: ``"audio"``, ``"touch"`` or ``"vision"``.
        profile: ``"smoke"``, ``"shipped"`` (of the fewest bytes), ``"standard"``, or for vision ``"paper"``.
        units: unit of the file's coordinates; None to detect it.
        up_axis: axis of the file that points up; None for the one that it declares, else z.
        wall: wall thickness in m of a hollow object of which the file has the outside.
        up_to: highest frequency in Hz, for audio.
        count: largest number of modes, for audio.
        edge: longest edge of an element in m, for audio; chosen by the shortest wavelength if None.
        licence: of the mesh, and so of the ObjectFile.
        seed: random seed.
        threads: for the training; one if None, and as many as cores for vision.
        sensor: make of the tactile camera or its file, for touch.
        report: called with stage and progress.

    Raises:
        MeshRefused: the mesh cannot be used.
        WrongUse: an unknown name, or an option of another modality.
    """
    if only not in ("audio", "touch", "vision"):
        raise WrongUse(f"--only {only} cannot be built; there is audio, touch and vision")
    if sensor is not None and only != "touch":
        raise WrongUse(f"--sensor is of touch, and --only {only} was asked for")
    made_of = named(material) if isinstance(material, str) else material
    wanted = PartRequest(str(mesh), made_of, profile, units, wall, licence, seed, up_axis)
    with hold_folder(out):
        if only == "touch":
            gel = described_sensor(sensor or DEFAULT_MAKE).sensor
            return _touch_result(
                build_touch(TouchRequest(**vars(wanted), sensor=gel), out, report, threads or 1)
            )
        if only == "vision":
            return _vision_result(build_vision(wanted, out, report, threads))
        audio = AudioRequest(**vars(wanted), limit=up_to, most=count, edge=edge)
        return _audio_result(build_audio(audio, out, Store(default_folder()), report, threads or 1))


def _entry(part: Part | None) -> Part:
    if part is None:
        raise DataRefused("the build wrote nothing: another program changed the ObjectFile; build it again")
    return part


def _audio_result(built: BuiltAudio) -> AudioBuild:
    modes = built.modes
    entry = _entry(built.object.description.audio)
    return AudioBuild(
        folder=built.object.folder,
        frequencies_hz=modes.frequencies,
        dampings_per_s=np.array(entry.dampings_per_s),
        unknowns=3 * modes.nodes,
        vertices=len(modes.points),
        held_out=len(built.audio.split.held_out),
        settings=built.audio.settings,
        errors=built.audio.errors,
        seconds=wall(built.seconds),
        cpu_seconds=cpu(built.seconds),
        notes=built.said,
        built=built,
    )


def _touch_result(built: BuiltTouch) -> TouchBuild:
    entry = _entry(built.object.description.touch)
    return TouchBuild(
        folder=built.object.folder,
        nodes=len(built.touch.codes.nodes),
        settings=built.touch.settings,
        errors=built.touch.errors,
        measured=built.touch.codes.measured,
        bytes=sum(file.bytes for file in entry.files),
        seconds=built.seconds,
        notes=built.said,
        built=built,
    )


def _vision_result(built: BuiltVision) -> VisionBuild:
    entry = _entry(built.object.description.vision)
    return VisionBuild(
        folder=built.object.folder,
        level=entry.level,
        networks=entry.grid.networks,
        cell_m=entry.grid.cell_m,
        width=entry.size.width,
        settings=built.vision.settings,
        errors=built.vision.errors,
        bytes=sum(file.bytes for file in entry.files),
        seconds=built.seconds,
        seconds_in_all=sum(built.seconds.values()),
        notes=built.said,
        built=built,
    )
