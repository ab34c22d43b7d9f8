"""A tactile camera calibrated from pictures of ball presses, as ``touchstone calibrate taxim`` gives it."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from datetime import UTC, datetime
from json import dumps
from pathlib import Path

import numpy as np

from calibration.taxim.arm.moves import ArmScale, Uncertain
from calibration.taxim.arm.record import NAME, ArmPresses, read_arm_run
from calibration.taxim.mark_free import Identity, MarkFree, calibrate
from calibration.taxim.pictures import Channels, Pictures, Refused, read_pictures, squared
from harness.basics.arrays import FloatArray
from harness.basics.errors import CalibrationRefused, WrongUse
from harness.basics.npz_file import write_arrays
from harness.basics.result import HIDDEN, JSON_ONLY, Result, json_value
from harness.basics.whole_file import write_text_whole
from harness.bench.sensor import GELSIGHT_R15, TactileSensor, described_sensor, shipped_sensors
from harness.recording.recording import Recording
from harness.sim.optics.lit_calibration import read_calibration, shadow_of
from harness.sim.optics.shadow_file import write_shadow_table
from harness.sim.optics.tactile_calibration import TactileCalibration, save_calibration

NO_MOVES = (
    "no arm moves are known of these pictures: ball presses alone cannot tell millimetres per pixel, aspect "
    "or rotation, because another pitch only relabels the slopes; calibrate with --station"
)

MAX_MARK = 8.0
"""Grey levels by which a place of the untouched gel may change during a run without a warning."""

_SAME_SHAPE = 0.02
"""Relative difference of the reductions along both sides, by rounding to whole pixels."""


@dataclass(frozen=True)
class CalibrationPress:
    """A press that the calibration was fitted to, and its prediction by presses of other folds."""

    name: str  #: of its picture.
    centre_px: tuple[float, float]  #: column and row.
    radius_px: float  #: of the contact line.
    depth_m: float
    psnr_table_db: float
    psnr_smooth_db: float
    psnr_unrefitted_db: float
    psnr_nothing_db: float


@dataclass(frozen=True)
class SummarizedShadow:
    """The shadow of one colour of light."""

    colour: str
    drawn: bool
    missing: str | None  #: reason why it is not drawn.
    falls_rad: float
    falls_sigma_rad: float
    dark_side_rad: float
    deepest_levels: float
    deepest_sigma_levels: float
    misfit_levels: float
    half_within_m: float
    wide_rad: float


@dataclass(frozen=True)
class ShadowSummary:
    """Shadows of the presses, and their prediction on held-out ones."""

    rim_depth_m: float
    colours: tuple[SummarizedShadow, ...]
    psnr_own_db: float | None  #: over the shadow's own pixels; None where there is no shadow.
    psnr_own_without_db: float | None
    gain_db: float | None
    better_share: float | None
    presses: int


@dataclass(frozen=True, eq=False)
class MeasuredScale:
    """The map from pixels to the gel by the arm's moves: values, sigmas and half-widths of 95 % intervals."""

    pitch_m: float
    pitch_sigma_m: float
    pitch_within95_m: float
    wide_m: float
    wide_sigma_m: float
    wide_within95_m: float
    high_m: float
    high_sigma_m: float
    high_within95_m: float
    aspect: float
    aspect_sigma: float
    aspect_within95: float
    rotation_rad: float
    rotation_sigma_rad: float
    rotation_within95_rad: float
    skew_rad: float
    skew_sigma_rad: float
    skew_within95_rad: float
    gel_from_pixels_m: FloatArray  #: ``(2, 2)``.
    scatter_m: float
    presses: int
    off: tuple[str, ...]  #: presses off the map, which are not used for it.

    @classmethod
    def of(cls, scale: ArmScale, arm: ArmPresses) -> "MeasuredScale":
        """Take the numbers of a fitted map."""
        return cls(
            *_three(scale.pitch),
            *_three(scale.wide),
            *_three(scale.high),
            *_three(scale.aspect),
            *_three(scale.rotation),
            *_three(scale.skew),
            gel_from_pixels_m=scale.gel_from_pixels,
            scatter_m=scale.scatter,
            presses=len(scale.used),
            off=tuple(arm.taken[k].name for k in scale.off),
        )


def _three(number: Uncertain) -> tuple[float, float, float]:
    return number.value, number.sigma, number.within95


@dataclass(frozen=True, eq=False)
class TaximResult(Result):
    """A calibration of a tactile camera, its held-out errors and the presses it stands on."""

    artefact: Path  #: the calibration's file.
    sha256: str
    psnr_contact_db: float  #: median over held-out presses, table with the centre refitted.
    psnr_contact_smooth_db: float  #: smooth model, centre refitted.
    psnr_contact_unrefitted_db: float  #: table, centre as detected.
    psnr_untouched_db: float  #: of no prediction at all.
    presses: int
    refused: tuple[Refused, ...] = field(metadata=JSON_ONLY)
    per_press: tuple[CalibrationPress, ...] = field(metadata=JSON_ONLY)
    contact_radius_px: float
    contact_line_scatter_px: float  #: deviation of the contact line from a circle.
    smooth_lean_rad: float = field(metadata=JSON_ONLY)
    covered: float  #: fraction of the picture that a contact reached.
    steepest: float  #: largest slope that is covered.
    misfit_grey: float | None  #: grey levels that held-out colours are off by, next to the noise.
    misfit_alike: float | None = field(metadata=JSON_ONLY)
    shadow: ShadowSummary = field(metadata=JSON_ONLY)
    shadow_drawn: bool
    shadow_reason: str | None  #: why no shadow is drawn.
    background: str  #: origin of the picture of the untouched gel.
    polycalib: Path | None
    report: Path | None
    seconds: float
    scale: MeasuredScale | None = field(metadata=JSON_ONLY)
    scale_reason: str | None  #: why the scale is not measured.
    pitch_m: float
    made_square_by: float
    drift_levels: float | None  #: grey levels by which the light moved during a run; None without a run.
    marked_levels: float | None  #: largest change of the untouched gel in grey levels; None without a run.
    notes: tuple[str, ...] = field(metadata=JSON_ONLY)
    fitted: MarkFree = field(metadata=HIDDEN)

    def summary(self) -> tuple[str, ...]:
        """State refused presses, shadows and the measured scale."""
        lines = [f"refused: {one.name}: {one.reason}" for one in self.refused]
        lines.append(f"{self.artefact}: {self.presses} presses, {len(self.refused)} refused")
        lines += [
            f"shadow of {one.colour} behind {1e3 * self.shadow.rim_depth_m:.2f} mm rims: falls at "
            f"{math.degrees(one.falls_rad):.1f} deg (to {math.degrees(one.falls_sigma_rad):.1f}), at most "
            f"{one.deepest_levels:.0f} grey levels"
            for one in self.shadow.colours
            if one.drawn
        ]
        found = self.scale
        if found is not None:
            turned, within = math.degrees(found.rotation_rad), math.degrees(found.rotation_within95_rad)
            lines.append(
                f"by the arm: {1e3 * found.pitch_m:.5f} mm a pixel (to {1e3 * found.pitch_within95_m:.5f}), "
                f"aspect {found.aspect:.4f} (to {found.aspect_within95:.4f}), rotation {turned:.2f} deg (to "
                f"{within:.2f}), at 95 % confidence"
            )
        return tuple(lines)


def calibrate_taxim(
    source: Path,
    ball_radius: float | None = None,
    pitch: float | None = None,
    aspect: float | None = None,
    sensor: str | None = None,
    serial: str = "unknown",
    licence: str = "not stated",
    background: Path | None = None,
    channels: Channels | None = None,
    like: Path | None = None,
    use_marks: bool = False,
    out: Path | None = None,
    polycalib: Path | None = None,
    shadow_table: Path | None = None,
    report: Path | None = None,
) -> TaximResult:
    """Fit the calibration of a tactile camera to pictures of ball presses, without marks by hand.

    Args:
        source: folder of pictures, one a press; a dataPack.npz; or the folder of a run by the arm.
        ball_radius: radius of the ball in m; a run of the arm has it in its folder.
        pitch: length of gel that a pixel shows, in m; measured by the arm, else of the sensor, if None.
        aspect: height of a pixel over its width; measured by the arm, else 1, if None.
        sensor: shipped name, sensor file or any other name.
        serial: of the sensor.
        licence: of the pictures.
        background: picture of the untouched gel; found by its name or made from the presses if None.
        channels: order of the colours in the files; as their formats say if None.
        like: calibration of the same make, mounted alike, which fixes the order of the colours.
        use_marks: start from the circles that came with a data pack.
        out: file to write; ``<source>_calibration.npz``, or ``fitted.npz`` in a run of the arm, if None.
        polycalib: file to write with the colour table in Taxim's layout.
        shadow_table: file to write with the shadows in Taxim's layout.
        report: folder to write a page with pictures into; ``report/`` of a run of the arm if None.

    Raises:
        CalibrationRefused: the presses do not give a calibration.
        WrongUse: options that conflict.
        DataRefused: pictures that cannot be used.
    """
    arm, scale, taken = _read(source, background, channels)
    pictures = squared(taken, aspect if aspect is not None else 1.0 if scale is None else scale.aspect_taken)
    who = identify(sensor, serial, licence, pitch, ball_radius, arm, scale, pictures)
    fitted = calibrate(
        pictures, who, use_marks=use_marks, like=None if like is None else read_calibration(like)
    )
    by_pictures = Path(f"{source.resolve().stem}_calibration.npz")
    artefact = out or (by_pictures if arm is None else source / "fitted.npz")
    save_calibration(fitted.calibration, artefact)
    _write_published(fitted, polycalib, shadow_table)
    page = None
    if report is None and arm is not None:
        report = source / "report"
    if report is not None:
        # Plotting takes a second to import.
        from calibration.taxim.report import write_report

        page = write_report(fitted, pictures, f"{who.sensor}, {source.name}", report, scale, arm)
    measured, notes = None, list[str]()
    if scale is not None and arm is not None:
        measured = MeasuredScale.of(scale, arm)
        _write_scale(measured, pictures.aspect, artefact)
        notes = scale_notes(scale, arm, pictures.aspect)
    header, missing = fitted.calibration.header, fitted.shadow_missing
    return TaximResult(
        artefact=artefact,
        sha256=fitted.calibration.sha256,
        psnr_contact_db=fitted.median("table"),
        psnr_contact_smooth_db=fitted.median("smooth"),
        psnr_contact_unrefitted_db=fitted.median("unrefitted"),
        psnr_untouched_db=fitted.median("nothing"),
        presses=len(fitted.used),
        refused=fitted.refused,
        per_press=tuple(
            CalibrationPress(
                press.name,
                press.centre,
                press.radius,
                press.depth,
                press.score.table,
                press.score.smooth,
                press.score.unrefitted,
                press.score.nothing,
            )
            for press in fitted.used
        ),
        contact_radius_px=fitted.contact_radius,
        contact_line_scatter_px=fitted.roundness,
        smooth_lean_rad=fitted.lean,
        covered=float((fitted.coverage > 0).mean()),
        steepest=header.slope_limit,
        misfit_grey=None if header.misfit is None else header.misfit.rms,
        misfit_alike=None if header.misfit is None else header.misfit.alike,
        shadow=_summarize_shadow(fitted),
        shadow_drawn=missing == "",
        shadow_reason=missing or None,
        background=fitted.background_from,
        polycalib=polycalib,
        report=page,
        seconds=fitted.seconds,
        scale=measured,
        scale_reason=NO_MOVES if measured is None else None,
        pitch_m=who.pitch,
        made_square_by=pictures.aspect,
        drift_levels=None if arm is None else arm.drift,
        marked_levels=None if arm is None else arm.marked,
        notes=tuple(notes),
        fitted=fitted,
    )


def _read(
    source: Path, background: Path | None, channels: Channels | None
) -> tuple[ArmPresses | None, ArmScale | None, Pictures]:
    """Return the pictures and, where an arm made them, what its moves measure."""
    if not ((source / "run.json").is_file() and Recording(source).header.experiment == NAME):
        return None, None, read_pictures(source, background, channels)
    if background is not None or channels is not None:
        raise WrongUse("--background and --channels are of pictures; a run of the arm has both in its folder")
    arm = read_arm_run(source)
    return arm, arm.scale(), arm.pictures


def identify(
    sensor: str | None,
    serial: str,
    licence: str,
    pitch: float | None,
    ball_radius: float | None,
    arm: ArmPresses | None,
    scale: ArmScale | None,
    pictures: Pictures,
) -> Identity:
    """Return the sensor's identity with its pitch: as given, else by the arm, else of the sensor's file."""
    recorded = None if arm is None else arm.ball_radius
    if ball_radius is None and recorded is None:
        raise WrongUse("--ball-radius is missing: the radius of the ball that was pressed, e.g. 2mm")
    if ball_radius is not None and recorded is not None and abs(ball_radius / recorded - 1.0) > 1e-6:
        raise WrongUse(
            f"--ball-radius {1e3 * ball_radius:g} mm: this run was made with a ball of {1e3 * recorded:g} "
            "mm; leave it out"
        )
    described = None
    # Any other name is the sensor's own, without a description.
    if sensor is not None and (
        sensor in shipped_sensors() or Path(sensor).suffix == ".toml" or Path(sensor).is_file()
    ):
        described = described_sensor(sensor).sensor
    if pitch is None:
        pitch = scale.pitch.value if scale is not None else _pitch_of_pictures(described, pictures)
    name = sensor if described is None else described.name
    return Identity(
        sensor=name or ("GelSight" if arm is None else arm.sensor),
        serial=serial if arm is None or serial != "unknown" else arm.serial or serial,
        licence=licence,
        date=datetime.now(UTC).date().isoformat(),
        pitch=pitch,
        ball_radius=recorded if recorded is not None else ball_radius or 0.0,
    )


def _pitch_of_pictures(sensor: TactileSensor | None, pictures: Pictures) -> float:
    """Return m per pixel of pictures that may be a reduced version of the sensor's own.

    Raises:
        WrongUse: the pictures are cropped, or another sensor's.
    """
    if sensor is None:
        return GELSIGHT_R15.pitch
    rows, columns = pictures.background.shape[:2]
    down, right = sensor.rows / rows, sensor.columns / columns
    if abs(down / right - 1.0) > _SAME_SHAPE:
        raise WrongUse(
            f"the pictures are {columns} x {rows} pixels and {sensor.name} has {sensor.columns} x "
            f"{sensor.rows}: they are not its whole picture; give --pitch, or the sensor that took them"
        )
    return float(sensor.pitch * (down * right) ** 0.5)


def _write_published(fitted: MarkFree, polycalib: Path | None, shadow_table: Path | None) -> None:
    """Write the colour table and the shadows in Taxim's layout, where a file is named."""
    if polycalib is not None:
        write_polycalib(fitted.calibration, polycalib)
    if shadow_table is None:
        return
    table = shadow_of(fitted.calibration)
    if table is None:
        raise CalibrationRefused(
            f"--shadow-table {shadow_table}: these presses show no shadow to write: {fitted.shadow_missing}; "
            "leave it out"
        )
    write_shadow_table(table, shadow_table)


def _write_scale(scale: MeasuredScale, aspect: float, artefact: Path) -> None:
    measured = {"schema": 1, **{name: json_value(value) for name, value in vars(scale).items()}}
    text = dumps({**measured, "made_square_by": aspect}, indent=1, allow_nan=False) + "\n"
    write_text_whole(artefact.with_name(f"{artefact.stem}.scale.json"), text)


def scale_notes(scale: ArmScale, arm: ArmPresses, aspect: float) -> list[str]:
    """Return warnings about a measured scale; pictures were made square by ``aspect``."""
    notes = []
    if aspect != 1.0:
        notes.append(
            f"a pixel is {scale.aspect.value:.4f} times as high as wide (to {scale.aspect.within95:.4f}): "
            f"the pictures were made square by {aspect:.4f} before the fit, and live ones are by the same, "
            "as the artefact's made_from says"
        )
    if abs(aspect - scale.aspect.value) > scale.aspect.within95:
        notes.append(
            f"an aspect of {aspect:.4f} was given, and the arm measured {scale.aspect.value:.4f} to "
            f"{scale.aspect.within95:.4f}: leave --aspect out"
        )
    if abs(scale.skew.value) > scale.skew.within95:
        notes.append(
            f"rows and columns are {math.degrees(scale.skew.value):.2f} deg from square, more than the "
            "error: the gel slips sideways, or the camera looks at it from the side"
        )
    if scale.off:
        notes.append(f"off the map and not used for it: {', '.join(arm.taken[k].name for k in scale.off)}")
    if arm.marked > MAX_MARK:
        notes.append(
            f"a place of the untouched gel changed by {arm.marked:.0f} grey levels since the first "
            "background: an imprint that had not gone, dirt, or a gel that moved"
        )
    return notes


def _summarize_shadow(fitted: MarkFree) -> ShadowSummary:
    score, pitch = fitted.shadow_score, fitted.calibration.header.pitch
    colours: Sequence[SummarizedShadow] = [
        SummarizedShadow(
            colour=one.colour,
            drawn=one.missing == "" and fitted.shadow_missing == "",
            missing=one.missing or None,
            falls_rad=one.falls,
            falls_sigma_rad=one.falls_error,
            dark_side_rad=one.dark_side,
            deepest_levels=one.deepest,
            deepest_sigma_levels=one.deepest_error,
            misfit_levels=one.misfit,
            half_within_m=pitch * one.reach,
            wide_rad=one.wide,
        )
        for one in fitted.shadow.colours
    ]
    return ShadowSummary(
        rim_depth_m=pitch * fitted.shadow.rim,
        colours=tuple(colours),
        psnr_own_db=None if score is None else score.shaded,
        psnr_own_without_db=None if score is None else score.plain,
        gain_db=None if score is None else score.gain,
        better_share=None if score is None else score.better,
        presses=0 if score is None else score.presses,
    )


def write_polycalib(calibration: TactileCalibration, path: Path) -> None:
    """Write ``polycalib.npz``: the number of bins and one table a channel.

    The layout names its channels r, g, b and holds what OpenCV reads, blue first: ``grad_r`` is blue.
    Taxim's program takes it so, and so does ours.

    Args:
        calibration: whose table is written; pitch, background and quality have no place in the file.
        path: of the file.
    """
    red, green, blue = (calibration.table[..., c].astype(np.float64) for c in range(3))
    bins = np.array(calibration.bins, dtype=np.int64)
    write_arrays(path, {"bins": bins, "grad_r": blue, "grad_g": green, "grad_b": red})
