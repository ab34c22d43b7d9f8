"""ObjectFiles: opened, checked and built."""

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
from harness.objectfile.file import ObjectFile
from harness.objectfile.published.entries import PublishedObject, open_either
from harness.objectfile.verify import verify
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


@dataclass(frozen=True)
class ObjectCheck:
    """One check of an ObjectFile."""

    check: str  #: name of the check.
    passed: bool
    said: str  #: finding; where the check failed, what to do.


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
    checks = tuple(ObjectCheck(check.name, check.passed, check.said) for check in verify(load_object(folder)))
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
