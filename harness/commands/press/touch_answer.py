"""What ``sim touch`` found, for programs, for people and as a picture."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from harness.commands.force_options import force_json, force_row, press_force_notes
from harness.commands.output import ANSWERS

if TYPE_CHECKING:
    from harness.basics.arrays import ByteArray, FloatArray
    from harness.effects.touch_press import Press
    from harness.sim.gel.press_pose import ContactPlace


@dataclass(frozen=True, eq=False)
class Touched:
    """A press and where it came from."""

    press: "Press"  #: as it was drawn.
    source: str  #: the mesh or the height map.
    place: "ContactPlace | None" = None  #: on the mesh; None for a height map.
    gel_from_object: "FloatArray | None" = None  #: ``(4, 4)``; None for a height map.
    asked: Mapping[str, float] = field(default_factory=dict)
    """depth and angles in SI units; empty for a height map."""
    said: tuple[str, ...] = ()  #: by the mesh's intake.
    live: "ByteArray | None" = None  #: what a camera saw; None without.
    seconds: Mapping[str, float] = field(default_factory=dict)  #: s before the effects ran.

    def compared(self, live: "ByteArray | None", before: Mapping[str, float]) -> "Touched":
        """The same beside what a camera saw.

        Raises:
            DataRefused: the camera's picture has another size.
        """
        from harness.basics.errors import DataRefused

        image = self.press.image
        if live is not None and live.shape != image.shape:
            raise DataRefused(
                f"--live is {live.shape[0]} x {live.shape[1]} pixels and the simulated picture "
                f"{image.shape[0]} x {image.shape[1]}; give the sensor's own picture, not cropped"
            )
        return replace(self, live=live, seconds={**before, **self.seconds})

    @property
    def missing(self) -> int:
        """Pixels for which the map had no height."""
        return 0 if self.press.missing is None else int(self.press.missing.sum())

    @property
    def fills_window(self) -> bool:
        """Whether the object touches all that the camera sees and has a height for."""
        touched = int(self.press.contact.sum())
        return 0 < touched == self.press.contact.size - self.missing

    @property
    def notes(self) -> list[str]:
        """What the operator should know."""
        press, said = self.press, list(self.said)
        if not press.contact.any():
            said.append("no contact: the picture is the untouched gel's")
        if self.missing:
            said.append(
                f"{self.missing} of {press.contact.size} heights are missing (not finite, or no height): the "
                "gel was hung over them, and neither picture nor contact is known there"
            )
        if self.fills_window:
            said.append("the contact fills the window: a flat face then looks like the untouched gel")
        if press.touches_border:
            said.append("the contact reaches the edge of the window; there is more of it than is seen")
        if (press.out_of_domain or 0.0) > 0.0:
            said.append(
                f"{press.out_of_domain:.2%} of the pixels are steeper than any press of the calibration and "
                "drawn as its steepest"
            )
        if press.saturated:
            said.append(f"{press.saturated} values of the picture were clipped to black or white")
        return said + press_force_notes(press)


def as_json(touched: Touched, out: Path, picture: Path | None, height_out: Path | None) -> dict[str, Any]:
    """The one JSON object."""
    from harness.effects.explain import as_json as plan_json
    from harness.sim.optics.optics import colour_error, filled_share

    press, place = touched.press, touched.place
    sensor, calibration = press.gel.sensor, press.gel.calibration
    return {
        "schema": 1,
        "image": str(out),
        "picture": None if picture is None else str(picture),
        "height_out": None if height_out is None else str(height_out),
        "source": touched.source,
        "heights_of": press.of,
        "sensor": sensor.name,
        "calibration": {"made_from": calibration.header.made_from, "sha256": calibration.sha256},
        "rows": sensor.rows,
        "columns": sensor.columns,
        "pitch_m": sensor.pitch,
        **touched.asked,
        "point_m": None if place is None else place.point.tolist(),
        "normal": None if place is None else place.normal.tolist(),
        "moved_m": None if place is None else place.moved,
        "gel_from_object": None if touched.gel_from_object is None else touched.gel_from_object.tolist(),
        "contact": bool(press.contact.any()),
        "contact_pixels": int(press.contact.sum()),
        "contact_area_m2": float(press.contact.sum()) * sensor.pitch**2,
        "deepest_m": press.deepest,
        **force_json(press),
        "flags": {
            "no_contact": not press.contact.any(),
            "touches_border": press.touches_border,
            "fills_window": touched.fills_window,
            "missing_heights": touched.missing,
            "saturated_values": press.saturated,
            "out_of_domain_share": press.out_of_domain,
            "filled_bins_share": filled_share(_towards_camera(press), calibration),
            "shadow_out_of_table_share": press.shadow_out_of_table,
        },
        "error_estimate": {
            "held_out_db": _claimed(calibration.header.held_out_db),
            "held_out_table_db": _claimed(calibration.header.held_out_table_db),
            "residual_rms_grey": _finite(calibration.header.residual_rms),
            "table_colour_grey": colour_error(_towards_camera(press), calibration),
            "maps_measured": press.maps_measured,
        },
        "live": None if touched.live is None else _compared(touched),
        "levels": press.plan.levels,
        "effects": plan_json(press.plan),
        "seconds": {**touched.seconds, **press.evaluation.seconds},
        "notes": touched.notes,
    }


def draw(touched: Touched, picture: Path) -> None:
    """Heights, colours and differences, side by side."""
    from harness.report.figures.figures import Album
    from harness.report.figures.touch import TouchPictures, touch_figure

    press = touched.press
    shown = TouchPictures(
        press.heights,
        press.image,
        press.gel.calibration.background,
        touched.live,
        press.gel.sensor.pitch,
        _captions(touched),
    )
    Album(picture.parent).photograph(picture.stem, touch_figure(shown))


def print_answer(touched: Touched, out: Path, picture: Path | None) -> None:
    """For people."""
    press = touched.press
    if touched.place is not None:
        moved = f", moved {touched.place.moved * 1e3:.3g} mm onto the surface" if touched.place.moved else ""
        at = ", ".join(f"{1e3 * x:.2f}" for x in touched.place.point)
        ANSWERS.print(f"contact at ({at}) mm of {touched.source}{moved}", markup=False)
    if press.contact.any():
        ANSWERS.print(
            f"{int(press.contact.sum())} pixels in contact, {press.deepest * 1e3:.3f} mm at the deepest"
        )
    else:
        ANSWERS.print("no contact")
    if (pressed := force_row(press)) is not None:
        ANSWERS.print(pressed)
    if touched.live is not None:
        compared = _compared(touched)
        for name in ("simulated", "background"):
            ANSWERS.print(
                f"live against {name}: {_decibels(compared[name], 'psnr_db')} over the frame, "
                f"{_decibels(compared[name], 'psnr_contact_db')} over the contact"
            )
    ANSWERS.print(f"{out}", markup=False)
    if picture is not None:
        ANSWERS.print(f"{picture}", markup=False)
    seconds = {**touched.seconds, **press.evaluation.seconds}
    ANSWERS.print(", ".join(f"{stage} {1e3 * took:.1f} ms" for stage, took in seconds.items()), markup=False)


def _towards_camera(press: "Press") -> "FloatArray":
    from harness.sim.gel.height_map import rest_surface

    rest = press.gel.rest
    return press.surface + (-rest_surface(press.gel.sensor) if rest is None else rest)


def _compared(touched: Touched) -> dict[str, Any]:
    """How far the live picture is from the simulated one, and from the background alone."""
    from harness.picture.image_metrics import psnr

    press, live = touched.press, touched.live
    assert live is not None
    found: dict[str, Any] = {"contact_pixels": int(press.contact.sum())}
    for name, drawn in (("simulated", press.image), ("background", press.gel.calibration.background)):
        contact = psnr(live, drawn, press.contact) if press.contact.any() else None
        full = psnr(live, drawn)
        found[name] = {
            "psnr_db": _finite(full),
            "psnr_contact_db": None if contact is None else _finite(contact),
            "identical": math.isinf(full),
        }
    return found


def _captions(touched: Touched) -> tuple[str, ...]:
    press = touched.press
    pixels = int(press.contact.sum())
    touching = f"{press.deepest * 1e3:.3f} mm deep, {pixels} px in contact" if pixels else "no contact"
    first = (touching, press.gel.sensor.name, "")
    if touched.live is None:
        return first
    compared = _compared(touched)
    against = [
        f"PSNR {_decibels(compared[name], 'psnr_db')}, "
        f"in contact {_decibels(compared[name], 'psnr_contact_db')}"
        for name in ("simulated", "background")
    ]
    return (*first, "", *against)


def _decibels(row: Mapping[str, Any], key: str) -> str:
    if row[key] is None:
        return "identical" if row["identical"] else "no pixel"
    return f"{row[key]:.2f} dB"


def _finite(value: float) -> float | None:
    return value if math.isfinite(value) else None


def _claimed(held_out: float) -> float | None:
    """A published calibration claims nothing, which its header writes as 0 dB."""
    return held_out if held_out > 0.0 else None
