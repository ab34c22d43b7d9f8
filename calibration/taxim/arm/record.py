"""Ball presses as an arm recorded them, read back from the run's folder alone.

``rest_change`` is the untouched gel as it was while the presses were made. A single picture of it carries its
own noise, moire and blocks of compression, and is not of the same minute. Every press shows most of the gel
untouched; where enough of them do, their median has the finer structure better. What varies over more than a
contact stays the picture's: the presses' own halos do.
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.ndimage import distance_transform_edt, gaussian_filter

from calibration.taxim.arm.moves import ArmScale, arm_scale
from calibration.taxim.arm.touch_down import look, touch_downs
from calibration.taxim.pictures import Pictures, PressPack, Refused, set_digest
from calibration.taxim.smooth_fit import distance
from harness.basics.arrays import ByteArray, FloatArray, block_means, read_only
from harness.basics.errors import CalibrationRefused, RecordingDamaged
from harness.basics.geometry import apply, inverse, rotation_from_quaternion, transform
from harness.bench.device import Reading
from harness.recording.recording import Recording
from harness.recording.run_folder import RunFiles
from harness.recording.step_file import StepRecord

NAME = "calibrate-taxim"
"""Of these runs, in ``run.json``."""

LEAST_BALL = 1.2
"""Of a measured pitch over the stated one, either way: beyond, the scene's ball or the station is wrong."""

AWAY = 2.5
"""Radii of the contact from its centre beyond which the gel is taken to be untouched."""

SIGHTINGS = 16
"""Presses that must show a place untouched. Where the presses lie close together a few remain, with the
halos of their neighbours: the picture as given is better there."""

_FINE = 1.5
"""Contact radii, sigma of the blur whose result counts as varying slowly."""

_SEAM = 0.15
"""Of that sigma, over which the correction fades in, so that it leaves no seam."""

IMAGE = "gel.image"
"""The press at rest; of a background step the untouched gel."""

UNTOUCHED = "gel.untouched.image"
"""The gel at the stand-off, just before."""

DESCENT = "gel.descent.image"
"""On the way down, from the first touch on."""

WAY = "press.way"
"""m from the stand-off, of each picture of the way down."""

STATE = "press.state"
"""Whether the ball was met (1 or 0), whether the picture came to rest (1 or 0), s that it took."""

UNREST = "press.unrest"
"""Grey levels between each look and the one before."""

ARM = "arm.base_from_flange"


@dataclass(frozen=True, eq=False)
class Taken:
    """One press as it was recorded."""

    name: str  #: for people and for files.
    image: FloatArray  #: ``(rows, columns, 3)`` grey levels, pressed.
    rest: FloatArray  #: ``(rows, columns, 3)`` grey levels, untouched, just before.
    descent: FloatArray
    """``(pictures, rows, columns, 3)`` grey levels against ``rest``, from the first touch on."""
    on_gel: FloatArray  #: ``(2,)`` m, where the arm says the ball is on the gel.
    touched: bool  #: whether the ball was met.
    settled: bool  #: whether the picture came to rest.
    unrest: float  #: grey levels between the last two looks.
    seconds: float  #: that it was waited for.


@dataclass(frozen=True, eq=False)
class ArmPresses:
    """A run's presses."""

    pictures: Pictures  #: that a calibration is made of; presses without contact or rest are refused in it.
    taken: tuple[Taken, ...]  #: every press, in the order they were made.
    backgrounds: FloatArray  #: ``(n, rows, columns, 3)`` grey levels, of the untouched gel, in order.
    ball_radius: float  #: m.
    pitch: float  #: m a pixel, as the station states it.
    sensor: str  #: its make.
    serial: str  #: of the sensor.
    drift: float  #: grey levels, the most that the untouched gel as a whole moved from the first background.
    marked: float  #: grey levels, the most that a place of it changed beside the whole.

    def scale(self) -> ArmScale:
        """Pitch, aspect and rotation by the arm.

        Raises:
            CalibrationRefused: too few presses that began, or a map that cannot be.
        """
        ball = self.ball_radius / self.pitch
        descents = [one.descent for one in self.taken]
        on_gel = np.array([one.on_gel for one in self.taken])
        began, at_depth = touch_downs(descents, ball)
        found = arm_scale(began, on_gel, at_depth)
        share = found.pitch.value / self.pitch
        if not 1.0 / LEAST_BALL < share < LEAST_BALL:
            raise CalibrationRefused(
                f"by the arm a pixel shows {1e3 * found.pitch.value:.4f} mm, and by the station's sensor "
                f"{1e3 * self.pitch:.4f} mm: the camera's resolution or the make in the station is wrong"
            )
        return found


def read_arm_run(folder: Path) -> ArmPresses:
    """Everything that a calibration is made of, from a run's folder.

    Raises:
        CalibrationRefused: another experiment's run, or no background or no press in it yet.
        RecordingDamaged: a step that does not read back.
    """
    recording = Recording(folder)
    if recording.header.experiment != NAME:
        raise CalibrationRefused(
            f"{folder} is a run of {recording.header.experiment}; calibrations are made of {NAME}"
        )
    steps = recording.steps()
    rests = [look(record.readings[IMAGE]) for record in steps if record.step.kind == "background"]
    taken = tuple(taken_of(record, recording) for record in steps if record.step.kind == "press")
    if not rests or not taken:
        raise CalibrationRefused(
            f"{folder} holds {len(rests)} pictures of the untouched gel and {len(taken)} presses so far; go "
            f"on with `touchstone calibrate taxim --resume {folder}`"
        )
    station, plan = recording.header.station, recording.header.plan
    pairs = [changed(rests[0], other) for other in [*rests[1:], *(one.rest for one in taken)]]
    drift, marked = max(whole for whole, _ in pairs), max(place for _, place in pairs)
    return ArmPresses(
        _pictures(rests[0], taken, folder.name),
        taken,
        np.array(rests),
        float(plan["ball_radius_m"]),
        float(plan["pitch_m"]),
        str(plan["sensor"]),
        str(station["gel"]["serial"]),
        drift,
        marked,
    )


def taken_of(record: StepRecord, recording: Recording) -> Taken:
    """One recorded press."""
    readings = record.readings
    touched, settled, seconds = readings[STATE].values[-1]
    unrest = readings.get(UNREST)
    rest = look(readings[UNTOUCHED])
    descent = readings.get(DESCENT)
    return Taken(
        press_name(record.step.index),
        look(readings[IMAGE]),
        rest,
        np.zeros((0, *rest.shape)) if descent is None else descent.values.astype(np.float64) - rest,
        _on_gel(readings[ARM], recording),
        bool(touched),
        bool(settled),
        0.0 if unrest is None else float(unrest.values[-1]),
        float(seconds),
    )


def press_name(step: int) -> str:
    """Of a step, counted from 1 as its file's number is not: as an operator counts."""
    return f"step {step + 1:03d}"


def _on_gel(poses: Reading, recording: Recording) -> FloatArray:
    """Return the ball's nominal ``(2,)`` position on the gel in m, averaged over the frame's arm packets."""
    station = RunFiles(recording).station
    ball = np.asarray(recording.header.plan["ball_in_base_m"], dtype=np.float64)
    each = []
    for pose in poses.values:
        base_from_flange = transform(rotation_from_quaternion(pose[3:]), pose[:3])
        each.append(apply(inverse(base_from_flange @ station.flange_from_gel), ball[None])[0, :2])
    if not each:
        raise RecordingDamaged(f"{recording.folder}: a press without the arm's pose")
    return np.asarray(np.mean(each, axis=0), dtype=np.float64)


def _pictures(rest: FloatArray, taken: tuple[Taken, ...], name: str) -> Pictures:
    each = (why_not(one.name, one.touched, one.settled, one.unrest, one.seconds) for one in taken)
    bad = tuple(reason for reason in each if reason is not None)
    kept = [one for one in taken if one.touched and one.settled]
    if not kept:
        raise CalibrationRefused(f"{name}: no press met the ball and came to rest; {bad[0].reason}")
    background = _rounded(rest)
    images = np.stack([_rounded(one.image) for one in kept])
    return Pictures(
        read_only(background),
        "taken by the arm before the first press",
        read_only(images),
        tuple(one.name for one in kept),
        None,
        name,
        set_digest(background, images),
        bad,
    )


def why_not(name: str, touched: bool, settled: bool, unrest: float, seconds: float) -> Refused | None:
    """Why a press is no picture of a ball at rest; None where it is.

    Args:
        name: of the press.
        touched: whether the ball was met.
        settled: whether the picture came to rest.
        unrest: grey levels between the last two looks.
        seconds: that it was waited for.
    """
    if not touched:
        return Refused(
            name,
            "no contact",
            "the gel went down as far as was rehearsed and its picture showed nothing: no ball was there",
        )
    if not settled:
        return Refused(
            name,
            "unsettled",
            f"its picture still changed by {unrest:.1f} grey levels from look to look after "
            f"{seconds:.1f} s: the gel slips or creeps, or the light flickers",
        )
    return None


def changed(first: FloatArray, later: FloatArray) -> tuple[float, float]:
    """Grey levels by which the untouched gel as a whole, and beside that any place of it, has changed."""
    apart = later - first
    whole = np.median(apart.reshape(-1, 3), axis=0)
    left = np.abs(block_means(apart - whole, 4))
    return float(np.abs(whole).max()), float(np.percentile(left.max(axis=2), 99.5))


def _rounded(picture: FloatArray) -> ByteArray:
    return np.asarray(np.round(picture), dtype=np.uint8)


def rest_change(pack: PressPack, change: FloatArray) -> FloatArray:
    """``(rows, columns, 3)`` grey levels by which the presses' untouched gel differs from the background.

    Args:
        pack: the presses; their centres and radii say where each is touched.
        change: ``(presses, rows, columns, 3)`` against the background, drift removed.

    Returns:
        The median over the presses less what varies slowly of it; 0 where fewer than 16 show the place
        untouched.
    """
    far = np.stack(
        [distance(pack.shape, c) > AWAY * r for c, r in zip(pack.centres, pack.radii, strict=True)], axis=0
    )
    count = far.sum(axis=0)
    rest = np.zeros(change.shape[1:])
    seen = count >= SIGHTINGS
    if not seen.any():
        return rest
    # Touched ones sort to the end, and the median is read off the front.
    values = np.where(far[:, seen, None], change[:, seen], np.inf)
    values.sort(axis=0)
    places, n = np.arange(values.shape[1]), count[seen]
    rest[seen] = 0.5 * (values[(n - 1) // 2, places] + values[n // 2, places])
    sigma = _FINE * float(np.median(pack.radii))
    share = np.maximum(gaussian_filter(seen.astype(np.float64), sigma), 1e-6)
    slow = gaussian_filter(rest, (sigma, sigma, 0.0)) / share[..., None]
    if seen.all():
        return rest - slow
    # Blend linearly from observed to unobserved pixels, to avoid a seam.
    faded = np.minimum(distance_transform_edt(seen) / (_SEAM * sigma), 1.0)
    return np.asarray(faded[..., None] * (rest - slow))
