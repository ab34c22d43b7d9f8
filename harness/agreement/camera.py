"""The scene camera: how far the object's outline reaches in its picture, against the model's.

An outline is read as how far it reaches in each of 72 directions. What may be off, the camera's place, turn
and focal length and the object's place, turn and size, moves all directions together along few patterns, to
first order. How far the outline is off along these, over the stated sigmas, is where it lies; what is left is
its shape. Each is a chi-square.
"""

from dataclasses import dataclass, field, replace

import cv2
import numpy as np

from harness.agreement.agreement import Residual, SenseResiduals, SideBySide
from harness.agreement.place_noise import POSITION
from harness.agreement.subject import Subject
from harness.basics.arrays import BoolArray, FloatArray
from harness.basics.errors import DataRefused
from harness.basics.geometry import apply, rotation_from_vector
from harness.basics.mesh import Mesh, hull_of
from harness.bench.gap import BenchErrors
from harness.bench.instruments.cameras import CameraSection
from harness.picture.camera_errors import CameraErrors
from harness.picture.object_mask import overlap
from harness.picture.outline import SeenOutline, corners_of, directions, read_outline

_UNKNOWNS = 14
"""The object's place (3), rotation (3) and size, the camera's place (3), rotation (3) and focal length."""

_NEAREST = 1.0e-2
"""m before a camera, at least, of what has an outline."""


@dataclass(frozen=True)
class OutlineNoise:
    """How far an outline in a picture may be from a model's, beside where the object stands."""

    camera: CameraErrors = field(default_factory=CameraErrors)  #: of its place, rotation and focal length.
    read: float = 0.7
    """pixels, one sigma of how far an outline reaches in one direction: half a pixel's width, the camera's
    noise, and what the surface is off by."""


def compare_camera(subject: Subject) -> SenseResiduals:
    """Compare the object's outline in every image of the scene camera with the model's."""
    run, residuals, notes = subject.run, list[Residual](), list[str]()
    none = SenseResiduals("camera", "reference", (), "no picture by the scene camera was recorded")
    if run.station.camera is None:
        return none
    view = OutlineView(subject.mesh, subject.base_from_object, run.station.camera)
    for record in run.recording.steps():
        try:
            mask = run.silhouette(record)
            if mask is not None:
                residuals += _residuals(view, record.step.index, mask, run.station.errors)
        except DataRefused as refusal:
            notes.append(f"step {record.step.index + 1}: {refusal}")
    if not residuals and not notes:
        return none
    return SenseResiduals("camera", "reference", tuple(residuals), "; ".join(notes))


def _residuals(view: "OutlineView", step: int, mask: BoolArray, errors: BenchErrors) -> list[Residual]:
    seen = read_outline(mask)
    outlines = (seen.extents, view.extents(np.zeros(_UNKNOWNS)))
    filled = []
    for extents in outlines:
        corners = corners_of(SeenOutline(extents, np.zeros(len(extents), np.bool_)))
        picture = np.zeros(mask.shape, np.uint8)
        cv2.fillPoly(picture, [np.rint(corners - 0.5).astype(np.int32)], 1)
        filled.append(picture.astype(np.bool_))
    read, modelled = filled
    sides = SideBySide(read.astype(np.float64), modelled.astype(np.float64), "covered")
    shared = {"overlap": overlap(read, modelled)}
    found = outline_residuals(step, view, seen, errors, OutlineNoise())
    return [replace(one, numbers={**one.numbers, **shared}, sides=sides) for one in found]


def outline_residuals(
    step: int, view: "OutlineView", seen: SeenOutline, errors: BenchErrors, noise: OutlineNoise
) -> tuple[Residual, ...]:
    """Compare position and shape of an outline with the model's, without the hidden directions.

    Raises:
        DataRefused: the outline is hidden in every direction, or the model is behind the camera.
    """
    free = ~seen.hidden
    if not free.any():
        raise DataRefused("the object's outline is hidden, or cut off by the picture's border, all around")
    gaps = (seen.extents - view.extents(np.zeros(_UNKNOWNS)))[free]
    patterns, sizes, _ = np.linalg.svd(view.slopes(errors, noise.camera)[free])
    along = patterns.T @ gaps
    variances = np.full(len(gaps), noise.read**2)
    variances[: len(sizes)] += sizes**2
    # Patterns that the noise of reading hides belong to the shape.
    moving = int(np.count_nonzero(sizes > noise.read))
    parts = {"outline's place": slice(0, moving), "outline's shape": slice(moving, None)}
    found = []
    for name, part in parts.items():
        if len(along[part]):
            rms, sigma = np.sqrt(np.mean(along[part] ** 2)), np.sqrt(np.mean(variances[part]))
            chi_square, count = np.sum(along[part] ** 2 / variances[part]), float(len(along[part]))
            numbers = {"rms_px": float(rms), "sigma_px": float(sigma)}
            found.append(Residual(step, name, float(chi_square), count, numbers))
    return tuple(found)


class OutlineView:
    """A model of the object before the scene camera.

    Args:
        mesh: of the object, m, in its own frame.
        base_from_object: ``(4, 4)``, where the scene states it.
        camera: of the station.
    """

    def __init__(self, mesh: Mesh, base_from_object: FloatArray, camera: CameraSection) -> None:
        self._anchor = base_from_object[:3, 3]
        self._standing = apply(base_from_object, hull_of(mesh.vertices)) - self._anchor
        self._camera = camera

    def extents(self, unknowns: FloatArray) -> FloatArray:
        """``(72,)`` pixels: how far the outline reaches in each direction.

        Args:
            unknowns: ``(14,)`` m, rad and relative: what the object and the camera are off by.

        Raises:
            DataRefused: the object stands behind the camera.
        """
        moved, turned, grown, eye_moved, eye_turned, focal = np.split(unknowns, [3, 6, 7, 10, 13])
        standing = (1.0 + grown) * self._standing @ rotation_from_vector(turned).T
        pose = self._camera.base_from_camera.matrix
        rotation = pose[:3, :3] @ rotation_from_vector(eye_turned)
        seen = (standing + self._anchor + moved - pose[:3, 3] - eye_moved) @ rotation
        if seen[:, 2].min() < _NEAREST:
            raise DataRefused("at the pose that the scene states, the object is not before the scene camera")
        middle = 0.5 * np.array([self._camera.columns, self._camera.rows])
        places = (1.0 + focal) * self._camera.focal_length * seen[:, :2] / seen[:, 2:] + middle
        return np.asarray((directions() @ places.T).max(axis=1))

    def slopes(self, errors: BenchErrors, camera: CameraErrors) -> FloatArray:
        """``(72, 14)`` pixels for one sigma of everything that may be off."""
        of_object = [*3 * [POSITION], errors.tilt, errors.tilt, errors.yaw, errors.scale]
        sigmas = [*of_object, *3 * [camera.position], *3 * [camera.rotation], camera.focal_length]
        return np.array([0.5 * (self.extents(one) - self.extents(-one)) for one in np.diag(sigmas)]).T
