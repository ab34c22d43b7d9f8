"""The object at its nominal size as each sense knows it, and where it nominally stands."""

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from experiments.scale_estimation.section import Scale
from experiments.scale_estimation.size import SizeRange
from experiments.scale_estimation.sound.hearing import MaterialGuess
from experiments.scale_estimation.sound.peaks import RingingModel
from experiments.scale_estimation.touch.fit import Stand, StandErrors
from experiments.scale_estimation.vision.vision import View
from harness.basics.arrays import FloatArray
from harness.basics.errors import WrongUse
from harness.basics.materials import KNOWN, MATERIALS
from harness.basics.mesh import Mesh, hull_of
from harness.bench.scene import SceneFile
from harness.bench.station_file import Station
from harness.effects.accuracy import Accuracy, Level
from harness.experiment.object_modes import ReadFile, object_modes
from harness.experiment.repeated_readings import PlaceTolerance
from harness.picture.camera_errors import CameraErrors
from harness.sim.solid.surface_samples import sample_surface
from harness.skills.exploring.lines import nowhere
from harness.skills.exploring.unknown_space import UnknownStand
from harness.twin.bench import TwinBench
from harness.twin.bench_of import twin_of

MEASURED_SIGMA = 0.03
"""Of sqrt(E / density), relative, where it was measured on a thing of the same material."""

_SAMPLES = 60
"""Samples along the longest side of the nominal object: of its surface, for contacts."""


@dataclass(frozen=True, eq=False)
class ObjectModel:
    """An object of known shape."""

    mesh: Mesh  #: in metres, at its nominal size.
    scene: SceneFile  #: says how it stands, and which sizes it may have.
    station: Station  #: whose camera looks at it.
    objectfile: ReadFile | None = None  #: reads the object's; None for the one that the scene names.
    _ringing: dict[tuple[tuple[str, Level], ...], RingingModel] = field(
        default_factory=dict, init=False, repr=False
    )

    @property
    def nominal(self) -> float:
        """M, the longest side of its bounding box."""
        return float(np.ptp(self.mesh.bounds, axis=0).max())

    @cached_property
    def sizes(self) -> SizeRange:
        """That are asked about."""
        return SizeRange(*self.scene.object.sizes_of(self.nominal))

    @property
    def upright(self) -> FloatArray:
        """``(3, 3)`` rotation of the object in base, at the scene's yaw."""
        return self.scene.base_from_object(self.mesh)[:3, :3]

    @property
    def place(self) -> FloatArray:
        """``(3,)`` m in base: where the scene puts its anchor."""
        return np.array(self.scene.object.pose.position)

    @cached_property
    def anchor(self) -> FloatArray:
        """``(3,)`` m in the object's frame: the point that the scene puts there, and that it grows about."""
        pose = self.scene.base_from_object(self.mesh)
        return np.asarray(pose[:3, :3].T @ (self.place - pose[:3, 3]))

    @property
    def place_error(self) -> float:
        """M, one standard deviation per axis of the plane."""
        return self.scene.section(Scale).place_error

    @cached_property
    def corners(self) -> FloatArray:
        """``(n, 3)`` m: of its convex hull, upright in base, the anchor at the origin."""
        return hull_of((self.mesh.vertices - self.anchor) @ self.upright.T)

    @property
    def height(self) -> float:
        """M, of the nominal object above the support."""
        return float(self.corners[:, 2].max())

    @property
    def nowhere(self) -> Mesh:
        """A mark of 2 mm on the support, in base: stands for an object of which nothing is known."""
        return nowhere(self.place)

    def twin_around(self, mesh_in_base: Mesh, has_object: bool = True) -> TwinBench:
        """The bench with this in the object's place, m in base."""
        return twin_of(self.scene, self.station, mesh_in_base, np.eye(4), has_object)

    @cached_property
    def stand(self) -> Stand:
        """For contacts."""
        surface = sample_surface(self.mesh, self.nominal / _SAMPLES)
        asked = self.scene.section(Scale)
        errors = StandErrors.at(self.station.errors, asked.place_error, asked.support_error, self.same_place)
        return Stand.of(surface, self.upright, self.anchor, self.place, errors)

    @property
    def same_place(self) -> PlaceTolerance:
        """Largest differences between two contacts at one place."""
        return PlaceTolerance.from_errors(self.station.errors, self.station.gel.sensor.gel_thickness)

    @property
    def errors(self) -> CameraErrors:
        """How well it is known where the camera is, and what it looks at."""
        asked = self.scene.section(Scale)
        return CameraErrors(
            position=asked.camera_position_error,
            rotation=asked.camera_rotation_error,
            focal_length=asked.focal_length_error,
            support=asked.support_error,
            tilt=self.station.errors.tilt,
            place=asked.place_error,
        )

    @property
    def unknown_stand(self) -> UnknownStand:
        """The same of an object whose shape nobody knows."""
        return UnknownStand(self.place, self.errors, self.station.camera)

    @cached_property
    def view(self) -> View:
        """For a picture.

        Raises:
            WrongUse: the station has no camera.
        """
        camera = self.station.camera
        if camera is None:
            raise WrongUse(
                f"the station {self.station.title!r} has no [camera]; describe it, or leave vision out"
            )
        centre = 0.5 * camera.columns, 0.5 * camera.rows
        matrix = camera.base_from_camera.matrix
        return View(matrix, camera.focal_length, centre, self.corners, self.place, self.errors)

    def materials(self, accuracy: Accuracy) -> list[MaterialGuess]:
        """What the object may be made of, with how surely; what the scene states first.

        Raises:
            MeshRefused: its surface cannot be filled with elements.
        """
        stated, asked = self.ringing(accuracy), self.scene.section(Scale).material
        if asked == "measured":
            return [MaterialGuess(stated, MEASURED_SIGMA)]
        names = [self.scene.object.material]
        if asked == "unknown":
            names += [name for name in MATERIALS if name != names[0]]
        return [
            MaterialGuess(stated.made_of(MATERIALS[name]), KNOWN[name].uncertainty.speed) for name in names
        ]

    def ringing(self, accuracy: Accuracy) -> RingingModel:
        """For strikes, at the accuracy of its modes.

        Raises:
            MeshRefused: its surface cannot be filled with elements.
        """
        levels = tuple(accuracy.items())
        if levels not in self._ringing:
            modes = object_modes(self.scene, self.station, self.mesh, accuracy, self.objectfile)
            self._ringing[levels] = RingingModel.of(modes, MATERIALS[self.scene.object.material])
        return self._ringing[levels]

    def scene_at(self, size: float, x: float, y: float, yaw: float) -> SceneFile:
        """The scene with the object of a size in m, off its nominal place by m and rad."""
        pose = self.scene.object.pose
        position = (pose.position[0] + x, pose.position[1] + y, pose.position[2])
        there = pose.model_copy(update={"position": position, "yaw": pose.yaw + yaw})
        stated = {"pose": there, "scale": size / self.nominal, "sizes": None}
        return self.scene.model_copy(update={"object": self.scene.object.model_copy(update=stated)})

    def mesh_at(self, size: float) -> Mesh:
        """Its mesh at a size in m."""
        return Mesh(self.mesh.vertices * (size / self.nominal), self.mesh.faces)
