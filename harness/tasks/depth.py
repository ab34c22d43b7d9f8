"""The depth of a press from its pictures, as ``touchstone depth`` gives it."""

import time
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from harness.basics.arrays import ByteArray, FloatArray
from harness.basics.errors import DataRefused, WrongUse
from harness.basics.files.named_file import refusals_name
from harness.basics.npz_file import write_array, write_arrays
from harness.basics.result import HIDDEN, JSON_ONLY, Result
from harness.bench.sensor import TactileSensor, described_sensor, shipped_sensors
from harness.bench.station_file import load_station, station_path
from harness.picture.image_file import read_image
from harness.recording.run_folder import station_calibration
from harness.sim.gel.elastic import GelElastic
from harness.sim.optics.depth_reading import DepthReading, read_force, read_press
from harness.sim.optics.inverse import DRIFTING, STEADY
from harness.sim.optics.lit_calibration import named_calibration
from harness.sim.optics.tactile_calibration import TactileCalibration
from harness.tasks.press_force import PressForce, describe_force, force_notes, force_sentence


@dataclass(frozen=True)
class UsedCalibration:
    """The calibration that a picture was read with."""

    made_from: str
    sha256: str


@dataclass(frozen=True)
class UsedSensor:
    """The sensor whose gel was pressed."""

    name: str
    gel_thickness_m: float


@dataclass(frozen=True)
class DepthFlags:
    """Reasons not to trust a depth."""

    no_contact: bool
    touches_border: bool  #: the contact reaches the edge of the picture.
    not_anchored: bool  #: no gel in view is at rest, so heights are counted from their least.


@dataclass(frozen=True)
class DepthSeconds:
    """CPU time of each stage."""

    reading_cpu: float
    error_cpu: float
    force_cpu: float | None  #: None if no force was computed.


@dataclass(frozen=True, eq=False)
class PressDepth(Result):
    """The surface of a pressed gel, with one standard deviation of every pixel."""

    calibration: UsedCalibration = field(metadata=JSON_ONLY)
    made_square_by: float  #: factor by which the picture was stretched; 1 if its pixels were square.
    rows: int
    columns: int
    pitch_m: float  #: of a pixel.
    contact: bool  #: whether the object touches.
    contact_pixels: int
    contact_area_m2: float
    deepest_m: float
    deepest_sigma_m: float
    deepest_point_m: FloatArray | None = field(metadata=JSON_ONLY)  #: ``(3,)`` in ``frame``.
    frame: str  #: ``"gel"``, or ``"flange"`` if a station is given.
    sigma_contact_m: float | None  #: median over the contact.
    sigma_rest_m: float
    trusted_share: float | None  #: of the contact, whose slopes the calibration covers.
    light_moved_levels: FloatArray = field(metadata=JSON_ONLY)  #: ``(3,)`` grey levels of red, green, blue.
    flags: DepthFlags
    seconds: DepthSeconds = field(metadata=JSON_ONLY)
    notes: tuple[str, ...] = field(metadata=JSON_ONLY)
    sensor: UsedSensor | None
    out: Path | None
    picture: Path | None
    height_out: Path | None
    images: tuple[Path, ...] = field(metadata=JSON_ONLY)
    force_n: float | None
    force_uncertainty_n: float | None
    force: PressForce | None = field(metadata=JSON_ONLY)
    reading: DepthReading = field(metadata=HIDDEN)  #: ``height`` and ``sigma`` of every pixel, in m.
    points_m: FloatArray = field(metadata=HIDDEN)  #: ``(n, 3)`` of the contact, in ``frame``.

    def summary(self) -> tuple[str, ...]:
        """State the largest depth, its deviation and its position."""
        moved = ", ".join(f"{level:+.1f}" for level in self.light_moved_levels)
        lines = ["no contact"]
        if self.deepest_point_m is not None:
            x, y, z = 1e3 * self.deepest_point_m
            of = {"gel": "of the gel", "flange": "of the arm's flange"}[self.frame]
            lines = [
                f"{1e3 * self.deepest_m:.3f} mm at the deepest (one standard deviation "
                f"{1e3 * self.deepest_sigma_m:.3f}), at ({x:.2f}, {y:.2f}, {z:.2f}) mm in the frame {of}"
            ]
        if self.force_n is not None and self.force_uncertainty_n is not None:
            lines.append(force_sentence(self.force_n, self.force_uncertainty_n))
        lines.append(f"the light moved by {moved} grey levels (red, green, blue)")
        times = self.seconds
        lines.append(
            f"CPU time: reading {1e3 * times.reading_cpu:.0f} ms, error {1e3 * times.error_cpu:.0f} ms"
        )
        return tuple(lines)


def depth(
    images: Sequence[Path],
    calibration: str | None = None,
    background: Path | None = None,
    sensor: str | None = None,
    station: str | None = None,
    gel: GelElastic | None = None,
    thickness: float | None = None,
    out: Path | None = None,
    height_out: Path | None = None,
    picture: Path | None = None,
) -> PressDepth:
    """Measure the surface of a pressed gel from the pictures of its camera.

    Args:
        images: frames of one press that was held still; their mean is read.
        calibration: file that ``calibrate taxim`` wrote, or a shipped name; that of ``station`` if None.
        background: picture of the untouched gel just before the press; the calibration's if None.
        sensor: shipped name or sensor file, whose thickness bounds the depth; that of ``station``, or the
            one that the calibration names, if None.
        station: bench whose flange is the frame of the points; the gel's own frame if None.
        gel: stiffness, to compute the force as well; None for no force.
        thickness: of the gel in m, for the force; that of the sensor if None.
        out: NPZ file to write: height, sigma, contact, trusted, points, points_sigma.
        height_out: NPY file to write: heights in m.
        picture: PNG file to write: the picture, heights and their deviation.

    Raises:
        WrongUse: no calibration, or a force without a thickness.
        PictureRefused: the picture is not of the calibration's gel, or is deeper than the gel.
        DataRefused: frames of different cameras.
    """
    bench = None if station is None else load_station(station_path(station))
    used = (
        described_sensor(sensor).sensor if sensor is not None else None if bench is None else bench.gel.sensor
    )
    if calibration is not None:
        known = named_calibration(calibration)
    elif bench is not None:
        known = station_calibration(bench)
    else:
        raise WrongUse("say by which colours: --calibration FILE, or a --station that has one")
    own = _own_sensor(known)
    used = used or own
    if gel is not None and thickness is None:
        if used is None:
            raise WrongUse(
                "a force needs to know how thick the gel is: --thickness 2.5mm, a --sensor or a --station"
            )
        thickness = used.gel_thickness
    rest = None if background is None else read_image(background)
    # A background of just now is by the light of now; the calibration's is of another day.
    detection = DRIFTING if rest is None else STEADY
    frames, known_thickness = _read_frames(images), None if used is None else used.gel_thickness
    with refusals_name(*images, *([] if background is None else [background])):
        found = read_press(frames, known, detection, rest, known_thickness)
    points = found.points(None if bench is None else bench.flange_from_gel)
    contact, (row, column) = found.contact, found.deepest
    touched = bool(contact.any())
    border = bool(contact[[0, -1]].any() or contact[:, [0, -1]].any())
    notes = [*_reading_notes(found, touched, border), *_sensor_notes(known, sensor, used, own)]
    newtons, uncertainty, force, force_cpu = None, None, None, None
    if gel is not None and thickness is not None:
        began = time.process_time()
        pressed = read_force(found, thickness, gel)
        force_cpu = time.process_time() - began
        bound = bool(pressed.pressed.lower_bound[0]) or not found.anchored
        details = describe_force(pressed.pressed, "layer", gel, bound)
        shares = {**details.uncertainty_shares, "reading": pressed.reading}
        force = replace(details, uncertainty_shares=shares, thickness_m=thickness)
        newtons, uncertainty = pressed.newtons, pressed.uncertainty
        notes += force_notes(pressed.pressed, gel, bound)
    if out is not None:
        arrays = {"height": found.height, "sigma": found.sigma, "contact": contact, "trusted": found.trusted}
        write_arrays(out, {**arrays, "points": points, "points_sigma": found.sigma[contact]}, compressed=True)
    if height_out is not None:
        write_array(height_out, found.height)
    if picture is not None:
        # Plotting takes a second to import.
        from harness.report.figures.figures import Album
        from harness.report.figures.touch import depth_figure

        Album(picture.parent).photograph(picture.stem, depth_figure(found))
    return PressDepth(
        calibration=UsedCalibration(known.header.made_from, known.sha256),
        made_square_by=found.aspect,
        rows=found.height.shape[0],
        columns=found.height.shape[1],
        pitch_m=found.pitch,
        contact=touched,
        contact_pixels=int(contact.sum()),
        contact_area_m2=float(contact.sum()) * found.pitch**2,
        deepest_m=float(found.height[row, column]),
        deepest_sigma_m=float(found.sigma[row, column]),
        deepest_point_m=points[int(np.argmax(found.height[contact]))] if touched else None,
        frame="gel" if bench is None else "flange",
        sigma_contact_m=float(np.median(found.sigma[contact])) if touched else None,
        sigma_rest_m=float(found.sigma.min()),
        trusted_share=float(found.trusted[contact].mean()) if touched else None,
        light_moved_levels=found.depth.drift[0],
        flags=DepthFlags(not touched, border, not found.anchored),
        seconds=DepthSeconds(found.seconds[0], found.seconds[1], force_cpu),
        notes=tuple(notes),
        sensor=None if used is None else UsedSensor(used.name, used.gel_thickness),
        out=out,
        picture=picture,
        height_out=height_out,
        images=tuple(images),
        force_n=newtons,
        force_uncertainty_n=uncertainty,
        force=force,
        reading=found,
        points_m=points,
    )


def _own_sensor(known: TactileCalibration) -> TactileSensor | None:
    """Return the shipped sensor that a calibration names; its pixels alone do not identify it."""
    sensors = [described_sensor(name).sensor for name in shipped_sensors()]
    return next((sensor for sensor in sensors if sensor.name == known.header.sensor), None)


def _read_frames(images: Sequence[Path]) -> ByteArray:
    frames = [read_image(path) for path in images]
    for path, frame in zip(images, frames, strict=True):
        if frame.shape != frames[0].shape:
            raise DataRefused(
                f"{path} is {frame.shape[1]} x {frame.shape[0]} pixels and {images[0]} "
                f"{frames[0].shape[1]} x {frames[0].shape[0]}; give frames of one press by one camera"
            )
    return np.stack(frames)


def _reading_notes(found: DepthReading, touched: bool, border: bool) -> list[str]:
    notes = list(found.notes)
    if not touched:
        notes.append("no contact: nothing in the picture differs from the untouched gel")
    if border:
        notes.append("the contact reaches the edge of the window; there is more of it than is seen")
    if not found.anchored:
        notes.append(
            "none of the gel in view is at rest, or the light changed: heights are counted from their least, "
            "and only shapes mean anything; take --background just before the press, or leave it out"
        )
    if touched and found.trusted[found.contact].mean() < 0.5:
        notes.append(
            "more than half of the contact is steeper than any press of the calibration, or of another "
            "colour: its heights are worth what their error says"
        )
    if found.aspect != 1.0:
        notes.append(f"the picture was made square by {found.aspect:.4f}, as the calibration's presses were")
    return notes


def _sensor_notes(
    known: TactileCalibration, given: str | None, used: TactileSensor | None, own: TactileSensor | None
) -> list[str]:
    if used is None:
        return [
            "the thickness of the gel is not known, and the depth is not compared with it: the calibration "
            f"is of {known.header.sensor!r}; give --sensor"
        ]
    if given is not None and own is not None and own.name != used.name:
        return [
            f"the calibration is of {own.name!r} and --sensor is {used.name!r}, "
            f"{1e3 * used.gel_thickness:g} mm thick: the depth is right only if this gel has the "
            "calibration's colours and pixels"
        ]
    return []
