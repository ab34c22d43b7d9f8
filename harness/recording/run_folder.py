"""The files that a run carries so that it can be estimated again from the folder alone."""

import datetime as dt
import importlib.metadata
import os
import shutil
import subprocess
import uuid
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import cached_property
from hashlib import sha256
from pathlib import Path
from typing import Any

from harness.basics.arrays import BoolArray
from harness.basics.clock import clock_offset_ns
from harness.basics.errors import RecordingDamaged, WrongUse
from harness.basics.files.lock_file import hold_folder
from harness.basics.mesh import Mesh
from harness.basics.npz_file import read_arrays, write_arrays
from harness.basics.whole_file import removed_on_failure, write_bytes_whole
from harness.bench.acquisition import AcquisitionCalibration
from harness.bench.scene import SceneFile, scene_from_json
from harness.bench.sensor import sensor_path, shipped_sensors
from harness.bench.station import RunContext
from harness.bench.station_file import Station, station_from_json
from harness.effects.accuracy import Level
from harness.effects.catalogue import network_levels, senses_of
from harness.effects.scene_object import known_file
from harness.objectfile.file import ObjectFile, write_described
from harness.objects.builtin import DESCRIPTION
from harness.picture.object_mask import mask_by_background
from harness.picture.square_pixels import aspect_stated
from harness.recording.observation import Observation, look_pictures, observe_step
from harness.recording.recording import HEADER, IN_USE, STEPS, Recording, RunHeader, require_unused
from harness.recording.step_file import StepRecord
from harness.sim.optics.inverse import GelReader
from harness.sim.optics.known_gel import require_own
from harness.sim.optics.lit_calibration import named_calibration, read_calibration, shadow_of
from harness.sim.optics.tactile_calibration import TactileCalibration, save_calibration

OBJECT, CALIBRATION, ACQUISITION = "object.npz", "calibration.npz", "acquisition.json"
SENSOR = "sensor.toml"
OBJECTFILE = "objectfile"
"""The folder of the object's ObjectFile within that of a run."""

_DESCRIBED = f"{OBJECTFILE}/{DESCRIPTION}"

OWN_NAMES = (OBJECT, CALIBRATION, ACQUISITION, SENSOR, OBJECTFILE, STEPS, HEADER)
"""Names that ``create_run`` may write into a run's folder; nothing else there is replaced or removed."""

_NUMBERS_COME_FROM = ("numpy", "scipy", "numba", "opencv-contrib-python-headless", "mujoco", "touchstone-lab")


def station_calibration(station: Station) -> TactileCalibration:
    """The calibration of a station's gel: a file, or one that comes with the package.

    Raises:
        CalibrationRefused: it is missing or damaged.
        DataRefused: it is of a camera of another size.
        WrongUse: the station's light casts shadows, and the calibration has none.
    """
    named = station.gel.calibration
    found = named_calibration(named)
    require_own(found, station.gel.sensor)
    if station.gel.casts_shadow and shadow_of(found) is None:
        raise WrongUse(
            f"the station {station.title!r} has gel.casts_shadow = true, and the presses of its calibration "
            f"({named}) showed no shadow; set it to false, or calibrate with `touchstone calibrate taxim` by "
            "presses that show one"
        )
    return found


def station_acquisition(scene: SceneFile, station: Station) -> AcquisitionCalibration | None:
    """The calibration of the hammer's box; None where the scene asks for no sound.

    Raises:
        WrongUse: the scene asks for sound and the station has no hammer.
        CalibrationRefused: it is missing, damaged, or not one.
    """
    if not scene.sensors.sound:
        return None
    return station.require_hammer()[0].acquisition


def create_run(
    folder: Path,
    experiment: str,
    scene: SceneFile,
    station: Station,
    mesh: Mesh,
    calibration: TactileCalibration,
    plan: Mapping[str, Any],
    seed: int,
    mock: Mapping[str, Any] | None,
    acquisition: AcquisitionCalibration | None = None,
) -> Recording:
    """Create a run folder with all inputs of an estimate; see ``RunHeader``.

    One process creates it; another process with the same folder is refused and removes nothing. Mesh and
    calibration are those of the estimator; ``acquisition`` is None for a run without sound.

    Raises:
        WrongUse: the folder has a run or is being written to, or files there have the names that a run
            uses; or the scene names an ObjectFile of another object.
        DataRefused: that ObjectFile is damaged.
    """
    of = known_file(scene, mesh)
    with hold_folder(folder, IN_USE), removed_on_failure(folder, OWN_NAMES):
        require_unused(folder)
        taken = [name for name in OWN_NAMES if os.path.lexists(folder / name)]
        if taken:
            raise WrongUse(
                f"{folder} holds {', '.join(taken)}, which a run would replace; name another folder"
            )
        carried = _carried(folder, scene, station, mesh, calibration, acquisition, of)
        header = RunHeader(
            experiment=experiment,
            scene=scene.model_dump(mode="json", by_alias=True),
            station=station.model_dump(mode="json", by_alias=True),
            plan=plan,
            files={name: _hash(folder / name) for name in carried},
            versions=versions(),
            seed=seed,
            mock=mock,
            clock_offset_ns=clock_offset_ns(),
            created=dt.datetime.now(dt.UTC).isoformat(timespec="seconds"),
            run_id=uuid.uuid4().hex,
        )
        return Recording.create(folder, header)


def _carried(
    folder: Path,
    scene: SceneFile,
    station: Station,
    mesh: Mesh,
    calibration: TactileCalibration,
    acquisition: AcquisitionCalibration | None,
    of: ObjectFile | None,
) -> list[str]:
    """Write the files that a run carries; their names within its folder."""
    write_arrays(folder / OBJECT, {"vertices": mesh.vertices, "faces": mesh.faces})
    save_calibration(calibration, folder / CALIBRATION)
    carried = [OBJECT, CALIBRATION]
    if acquisition is not None:
        acquisition.save(folder / ACQUISITION)
        carried.append(ACQUISITION)
    if station.gel.make not in shipped_sensors():
        write_bytes_whole(folder / SENSOR, sensor_path(station.gel.make).read_bytes())
        carried.append(SENSOR)
    if of is not None:
        (folder / OBJECTFILE).mkdir(parents=True, exist_ok=True)
        contents = {entry.file: of.read(entry) for entry in of.description.files_of(senses_of(scene))}
        write_described(folder / OBJECTFILE, of.description, contents)
        carried.append(_DESCRIBED)
    return carried


@dataclass(frozen=True, eq=False)
class RunFiles:
    """A recording with what it carries, read on first use and checked against the hashes in ``run.json``."""

    recording: Recording
    _observed: dict[int, Observation] = field(default_factory=dict, init=False, repr=False)
    _silhouettes: dict[int, BoolArray | None] = field(default_factory=dict, init=False, repr=False)

    @cached_property
    def scene(self) -> SceneFile:
        """As it was resolved when the run was made."""
        with _of_run():
            return scene_from_json(self.recording.header.scene, self._where)

    @cached_property
    def station(self) -> Station:
        """As it was resolved when the run was made; a make of one's own is read from the run's folder."""
        tree = self.recording.header.station
        gel = tree.get("gel")
        if SENSOR in self.recording.header.files and isinstance(gel, dict):
            tree = {**tree, "gel": {**gel, "make": str(self._checked(SENSOR).resolve())}}
        with _of_run():
            return station_from_json(tree, self._where)

    @cached_property
    def mesh(self) -> Mesh:
        """The object as the estimator knows it."""
        arrays = read_arrays(self._checked(OBJECT), "an object", ("vertices", "faces"))
        return Mesh(arrays["vertices"], arrays["faces"])

    @cached_property
    def calibration(self) -> TactileCalibration:
        """The gel's colours as the estimator knows them."""
        return read_calibration(self._checked(CALIBRATION))

    @cached_property
    def acquisition(self) -> AcquisitionCalibration | None:
        """What the hammer's box says; None for a run without sound."""
        if ACQUISITION not in self.recording.header.files:
            return None
        return AcquisitionCalibration.load(self._checked(ACQUISITION))

    @cached_property
    def objectfile(self) -> ObjectFile:
        """What the scene's ObjectFile said of the object when the run was made, for the senses of the scene.

        Raises:
            WrongUse: the scene named none.
            DataRefused: it is damaged.
        """
        if not self.carries_objectfile:
            raise WrongUse(
                f"{self.recording.folder} carries no ObjectFile, as its scene named none; take "
                "sound.shapes = elements and touch.shapes = reference"
            )
        return ObjectFile.open(self._checked(_DESCRIBED).parent)

    @cached_property
    def gel_reader(self) -> GelReader:
        """Reader of the gel's pictures, shared by all that read this run."""
        return GelReader(self.calibration)

    def observe(self, record: StepRecord) -> Observation:
        """Return one committed contact as it was recorded; it is computed on first use.

        Raises:
            RecordingDamaged: the step has no images, or no pose of the arm with them.
        """
        index = record.step.index
        if index not in self._observed:
            given = self.station.flange_from_gel, self.acquisition, self.aspect
            self._observed[index] = observe_step(record, *given)
        return self._observed[index]

    @property
    def aspect(self) -> float:
        """Height of a pixel of the gel's camera over its width."""
        return aspect_stated(self.calibration.header.made_from)

    def silhouette(self, record: StepRecord) -> BoolArray | None:
        """Return the object's pixels in the picture of a committed look; it is computed on first use.

        Returns:
            ``(rows, columns)``; None if the step is not a look.

        Raises:
            DataRefused: the pictures with and without the object differ in size.
        """
        index = record.step.index
        if index not in self._silhouettes:
            pictures = look_pictures(record)
            self._silhouettes[index] = None if pictures is None else mask_by_background(*pictures)
        return self._silhouettes[index]

    @property
    def carries_objectfile(self) -> bool:
        """Whether the scene named an ObjectFile when the run was made."""
        return _DESCRIBED in self.recording.header.files

    @property
    def network_levels(self) -> dict[str, Level]:
        """Levels at which networks of the carried ObjectFile stand for the simulation; none without one."""
        return network_levels(self.scene, self.objectfile.description) if self.carries_objectfile else {}

    @property
    def context(self) -> RunContext:
        """Inputs of a mocked bench for this run."""
        header = self.recording.header
        gap = (header.mock or {}).get("gap")
        return RunContext(self.recording.truth_path, self.mesh, header.seed, gap, header.run_id)

    @property
    def _where(self) -> str:
        return f"{self.recording.folder}/run.json"

    def _checked(self, name: str) -> Path:
        path = self.recording.folder / name
        wanted = self.recording.header.files.get(name)
        if not path.exists() or _hash(path) != wanted:
            raise RecordingDamaged(f"{path} is missing or is not the file this run was recorded with")
        return path


@contextmanager
def _of_run() -> Iterator[None]:
    """What would be an operator's mistake in a file of theirs is damage in one that a run wrote."""
    try:
        yield
    except WrongUse as error:
        raise RecordingDamaged(str(error)) from error


def versions() -> dict[str, str]:
    """Of what shapes the numbers, and the commit of the checkout with + where it was changed."""
    found = {name: importlib.metadata.version(name) for name in _NUMBERS_COME_FROM}
    return {**found, "git": git_commit()}


def git_commit() -> str:
    """Return the short hash of the checkout, + where it was changed; "unknown" outside a checkout."""
    if shutil.which("git") is None or not (Path(__file__).parents[2] / ".git").exists():
        return "unknown"
    described = subprocess.run(
        ["git", "describe", "--always", "--dirty=+", "--abbrev=12"],  # noqa: S607 - whichever git is installed
        cwd=Path(__file__).parent,
        capture_output=True,
        text=True,
        check=False,
    )
    return described.stdout.strip() or "unknown"


def _hash(path: Path) -> str:
    return sha256(path.read_bytes()).hexdigest()
