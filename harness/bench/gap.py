"""The reality gap: how the bench differs from what is believed of it, as a file of distributions.

The mocked world samples a ``Gap`` once per run; no estimator reads it. A value is the sigma of a normal
distribution with mean zero unless its attribute says otherwise. Estimators and comparisons use
``BenchErrors`` alone, which a station may state as ``[errors]``.
"""

from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from pydantic import Field

from harness.basics.errors import WrongUse
from harness.basics.files.named_file import nearest, real_path
from harness.basics.quantities import Angle, Decay, Length, Level, Nonnegative, Ordered, Positive, Ratio, Time
from harness.basics.toml_file import StrictModel, load_toml


class BenchErrors(StrictModel):
    """One standard deviation of everything that may be off at a bench."""

    yaw: Annotated[Angle, Positive] = float(np.radians(1.5))
    """Rotation in rad of the object about the vertical, if a scene states its yaw."""
    tilt: Annotated[Angle, Positive] = float(np.radians(0.5))
    """Rotation in rad of the object about base x and about base y."""
    scale: Annotated[Ratio, Positive] = 0.005  #: of the object's true size over its model's, less 1.
    gel_centre: Annotated[Length, Positive] = 0.5e-3
    """Displacement in m of the gel's centre along each axis of its own frame."""
    gel_tilt: Annotated[Angle, Positive] = float(np.radians(0.7))  #: rad, of the gel about its x and y each.
    gel_yaw: Annotated[Angle, Positive] = float(np.radians(1.0))  #: rad, of the gel's image about its z.
    arm: Annotated[Length, Positive] = 0.45e-3
    """Displacement in m of each contact along each axis: error of the arm's pose and of the local shape."""
    arm_tilt: Annotated[Angle, Positive] = float(np.radians(0.8))  #: rad, of each contact about each axis.
    gel_depth: Annotated[Length, Positive] = 0.064e-3
    """Error in m (rms over a contact) of the depth from a tactile image."""

    def times(self, factor: float) -> "BenchErrors":
        """All of them so many times as large; ``factor`` is above 0."""
        return BenchErrors.model_construct(**{name: factor * value for name, value in self})


USUAL = BenchErrors()
"""Errors of a carefully assembled bench, the default of a station."""


_FOLDER = Path(__file__).parent / "gaps"


class ArmGap(StrictModel):
    """Where the arm is, against where its controller says."""

    translation: Annotated[Length, Nonnegative]  #: m, per axis of the base and contact.
    along_tool: Annotated[Length, Nonnegative]  #: m, along the tool's axis, per contact, in addition.


class ObjectGap(StrictModel):
    """How the object stands, against the scene's nominal pose."""

    position: Annotated[Length, Nonnegative]
    """m, per axis of the base and run; no estimator is told the position."""
    yaw: Annotated[Angle, Nonnegative]  #: rad, about the vertical, per run.
    tilt: Annotated[Angle, Nonnegative]  #: rad, about base x and y each, per run.
    height: Annotated[Length, Nonnegative] | None = None
    """m, of the support under it, per run; None for what ``position`` says."""


class SensorGap(StrictModel):
    """How the sensor is mounted, against the station's frame of it."""

    tilt: Annotated[Angle, Nonnegative]  #: rad, about gel x and y each, per run.
    tilt_per_contact: Annotated[Angle, Nonnegative]  #: rad, about gel x and y each, per contact.
    image_yaw: Annotated[Angle, Nonnegative]  #: rad, of the image about the gel's z, per run.
    gel_centre: Annotated[Length, Nonnegative]  #: m, per axis of the gel's frame, per run.
    pitch: Annotated[Ratio, Nonnegative] = 0.0  #: relative, of the length of gel that a pixel shows, per run.
    aspect: Annotated[Ratio, Nonnegative] = 0.0  #: relative, of a pixel's height against its width, per run.
    housing: Literal["rigid", "not there"] = "rigid"
    """whether the rigid face around the gel stops at the object, or passes through it as if it were not
    there."""


class GelGap(StrictModel):
    """How the gel deforms and is seen, against its model."""

    height_gain: Annotated[Ratio, Nonnegative]  #: relative, of the indentation, per run.
    height_offset: Annotated[Length, Nonnegative]  #: m of indentation, per contact.
    pixel_noise: Annotated[Length, Nonnegative]  #: m of indentation, per pixel.
    shading: Annotated[Length, Nonnegative]  #: m of indentation, smooth over the image, per run.
    skirt: Annotated[Length, Nonnegative]
    """m, the blur by which the gel hangs from what it touches: the value itself."""
    calibration: Literal["other presses", "the estimator's"]
    """whether the world's colours come from presses other than the estimator's."""


class ShapeGap(StrictModel):
    """The object as it was made, against its model."""

    scale: Annotated[Ratio, Nonnegative]  #: relative, per run.
    deviation: Annotated[Length, Nonnegative]  #: m, per axis, smooth, per run.
    deviation_length: Annotated[Length, Positive]  #: m over which the deviation varies: the value itself.


class SoundGap(StrictModel):
    """The struck object and what carries its sound, against their models."""

    wall: Annotated[tuple[Ratio, Ratio], Ordered]
    """relative change of the wall's thickness: uniform between the two."""
    poisson: float = Field(ge=0.0, lt=0.5)  #: uniform between minus and plus this.
    elastic_field: Annotated[Ratio, Nonnegative]  #: relative, smooth fields of Young's modulus and density.
    frequency: Annotated[Ratio, Nonnegative]  #: relative, of all modes together, per run.
    frequency_per_mode: Annotated[Ratio, Nonnegative]  #: relative.
    damping: Annotated[Ratio, Nonnegative]  #: of the logarithm, of all modes together, per run.
    damping_per_mode: Annotated[Ratio, Nonnegative]  #: of the logarithm.
    microphone_gain: Annotated[Level, Nonnegative]  #: dB, per mode, common to a run, with a random phase.
    strike_direction: Annotated[Angle, Nonnegative]
    """rad, the angle between the blow and the hammer's axis, about an axis drawn uniformly, per strike."""
    strike_point: Annotated[Length, Nonnegative]  #: m, per axis across the hammer and strike.
    force_gain: Annotated[Ratio, Nonnegative]  #: relative, per run.
    pulse: Annotated[Time, Positive]  #: s, the length of the half sine: the value itself.
    pulse_spread: Annotated[Ratio, Nonnegative]  #: relative, per strike, uniform between minus and plus this.
    reverberation_time: Annotated[Time, Nonnegative]
    """s to fall by 60 dB: the value itself; zero without a room."""
    direct_to_reverberant: Level  #: dB: the value itself.
    signal_to_noise: Level  #: dB, of a middling strike over its first half second: the value itself.
    gain_per_strike: Annotated[Level, Nonnegative] = 0.0
    """dB, per mode and strike: a microphone, or an object, that moves in between."""
    phase_per_strike: Annotated[Angle, Nonnegative] = 0.0  #: rad, per mode and strike.
    extra_damping: Annotated[Decay, Nonnegative] = 0.0
    """1/s on top of every mode's, as of a hand that holds the object: the value itself."""
    silent_strikes: tuple[int, ...] = ()
    """contacts, counted from 0, at which the striker does not reach the object."""
    saturated_strikes: tuple[int, ...] = ()  #: contacts at which the blow is ten times as hard.
    double_strikes: tuple[int, ...] = ()  #: contacts at which the hammer bounces and hits twice.
    material: bool = False
    """whether stiffness, density and damping are as uncertain as ``harness.basics.materials`` says of the
    object's material, in place of ``frequency`` and ``damping``."""


class CameraGap(StrictModel):
    """Where the scene camera is and what it adds, against the station's description of it."""

    position: Annotated[Length, Nonnegative] = 0.0  #: m, per axis of the base, per run.
    rotation: Annotated[Angle, Nonnegative] = 0.0  #: rad, per axis of the camera, per run.
    focal_length: Annotated[Ratio, Nonnegative] = 0.0  #: relative, per run.
    noise: float = Field(default=0.0, ge=0.0, allow_inf_nan=False)
    """grey levels of 255, per pixel, channel and picture."""


class Gap(StrictModel):
    """Everything that may differ between the bench and what is believed of it."""

    schema_number: Literal[1] = Field(alias="schema")
    title: str
    arm: ArmGap
    object: ObjectGap
    sensor: SensorGap
    gel: GelGap
    shape: ShapeGap
    sound: SoundGap
    camera: CameraGap = CameraGap()


def gap_path(name: str) -> Path:
    """The file of a gap: ``"default"``, ``"none"``, or a path.

    Raises:
        WrongUse: there is no such file and no such name.
    """
    shipped = {path.stem: path for path in _FOLDER.glob("*.toml")}
    if name in shipped:
        return shipped[name]
    if not Path(name).is_file():
        raise WrongUse(f"no gap file {name!r}; give a path or a shipped name: {nearest(name, shipped)}")
    return real_path(Path(name))


def load_gap(name: str) -> Gap:
    """A gap by name or path; ``WrongUse`` as ``gap_path`` and ``load_toml``."""
    return load_toml(gap_path(name), Gap)


def lasting_name(name: str) -> str:
    """What to write of a gap in a run: a shipped name, or a path that holds wherever it is resumed from.

    Raises:
        WrongUse: the gap cannot be read.
    """
    load_gap(name)
    path = gap_path(name)
    return name if path.stem == name else str(path)
