"""What ``touchstone object compare vision`` answers: a sheet, one JSON object, or lines for people."""

import math
import time
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from harness.commands.object.render_vision_answer import camera_as_json
from harness.commands.output import ANSWERS

if TYPE_CHECKING:
    from harness.basics.arrays import ByteArray
    from harness.bench.scene_camera import Lamp
    from harness.objectfile.file import ObjectFile
    from harness.objectfile.vision.render import ObjectVision
    from harness.picture.live_picture import Apart, LiveComparison
    from harness.picture.pinhole import Pinhole

_LEAST_OVERLAP = 0.8
"""Of the masks (IoU), below which object and simulation are hardly in one place."""

_MANY_OUTLIERS = 0.25


@dataclass(frozen=True, eq=False)
class ComparedPhoto:
    """What a camera saw, and how it was simulated."""

    live: "ByteArray"  #: ``(rows, columns, 3)`` RGB.
    camera: "Pinhole"  #: in the object's frame.
    lamps: "tuple[Lamp, ...]"  #: one or more.
    assumed: bool  #: whether nobody said where the light comes from.


@dataclass(frozen=True, eq=False)
class Compared:
    """A comparison, and all that is said of it."""

    of: "ObjectFile"  #: the object.
    vision: "ObjectVision"  #: its look.
    seen: ComparedPhoto  #: by the camera.
    found: "LiveComparison"  #: how both differ.
    seconds: dict[str, float]  #: s on the clock by stage, before the comparison; ``draw`` adds its own.


def draw(compared: Compared, out: Path) -> None:
    """Write the sheet; it counts among the seconds."""
    from harness.report.figures.figures import Album
    from harness.report.figures.tiles import live_figure

    begun = time.perf_counter()
    found = compared.found
    fit = found.exposure
    gains = ", ".join(f"{g:.3f}±{e:.3f}" for g, e in zip(fit.gain, fit.gain_error, strict=True))
    offsets = ", ".join(f"{o:+.3f}±{e:.3f}" for o, e in zip(fit.offset, fit.offset_error, strict=True))
    words = (
        f"object found by {found.masked_by} (orange), simulated (blue)\noverlap {found.overlap:.1%}",
        f"red, green, blue:\ngain {gains}\noffset {offsets}",
        f"over the object: {_in_words(found.fitted)}\nbefore the fit: {_in_words(found.unfitted)}",
    )
    Album(out.parent).photograph(out.stem, live_figure(found, words))
    compared.seconds["draw"] = time.perf_counter() - begun


def notes(compared: Compared) -> list[str]:
    """What the operator should know."""
    found, said = compared.found, []
    if compared.seen.assumed:
        said.append("nobody said where the light comes from: over the left shoulder was taken; say --light")
    if found.overlap < _LEAST_OVERLAP:
        said.append(
            f"the object covers {found.overlap:.0%} of what simulation and picture cover together: it stands "
            "elsewhere, is another, or its outline was not found; give --background, or look at the sheet"
        )
    if found.exposure.outliers.max() > _MANY_OUTLIERS:
        said.append(
            f"{found.exposure.outliers.max():.0%} of the pixels follow no exposure: highlights, shadows, "
            "another light, or another object"
        )
    return said


def as_json(compared: Compared, files: Mapping[str, Path | None]) -> dict[str, Any]:
    """As scripts read it."""
    found, seen = compared.found, compared.seen
    fit = found.exposure
    rows, columns = found.mask.shape
    return {
        "schema": 1,
        "folder": str(compared.of.folder),
        "object": compared.of.description.name,
        "level": "one_sample",
        "networks": compared.vision.entry.level,
        **{name: None if path is None else str(path) for name, path in files.items()},
        "rows": rows,
        "columns": columns,
        "camera": camera_as_json(seen.camera),
        "lights": [
            {"direction": lamp.light.direction.tolist(), "colour": lamp.colour.tolist()}
            for lamp in seen.lamps
        ],
        "light_assumed": seen.assumed,
        "exposure": {
            "fit": fit.kind,
            "gain": fit.gain.tolist(),
            "gain_error": fit.gain_error.tolist(),
            "attenuation": fit.attenuation.tolist(),
            "offset": fit.offset.tolist(),
            "offset_error": fit.offset_error.tolist(),
            "stops": fit.stops,
            "white_balance": fit.balance.tolist(),
            "white_balance_error": (fit.balance * fit.balance_error).tolist(),
            "scatter": fit.scatter.tolist(),
            "pixels": fit.pixels.tolist(),
            "saturated": fit.saturated.tolist(),
            "outlier_share": fit.outliers.tolist(),
        },
        "mask": {
            "by": found.masked_by,
            "pixels": int(found.mask.sum()),
            "simulated_pixels": int(found.silhouette.sum()),
            "overlap": found.overlap,
        },
        "difference": _apart(found.fitted),
        "difference_before_fit": _apart(found.unfitted),
        "notes": notes(compared),
        "seconds": {**compared.seconds, **found.seconds},
    }


def _apart(apart: "Apart") -> dict[str, float | None]:
    """Equal pictures have no dB."""
    decibels = apart.psnr_db if math.isfinite(apart.psnr_db) else None
    return {"psnr_db": decibels, "ssim": apart.ssim, "rms_grey": apart.rms_grey}


def print_answer(compared: Compared, files: Mapping[str, Path | None]) -> None:
    """For people."""
    found, camera = compared.found, compared.seen.camera
    fit = found.exposure
    x, y, z = (f"{each * 1e3:.4g}" for each in camera.eye)
    ANSWERS.print(
        f"{compared.of.description.name} from ({x}, {y}, {z}) mm, {camera.width} x {camera.height} pixels; "
        f"{compared.vision.entry.level}",
        markup=False,
    )
    ANSWERS.print(f"over the object: {_in_words(found.fitted)}; before the fit: {_in_words(found.unfitted)}")
    for name, g, ge, o, oe in zip(
        ("red", "green", "blue"), fit.gain, fit.gain_error, fit.offset, fit.offset_error, strict=True
    ):
        ANSWERS.print(f"{name}: gain {g:.4f} +- {ge:.4f}, offset {o:+.4f} +- {oe:.4f} of linear light")
    ANSWERS.print(
        f"outlines overlap by {found.overlap:.1%} (found by {found.masked_by}); {fit.pixels.min()} pixels "
        f"fitted, {fit.saturated.max()} black or white, {fit.outliers.max():.1%} outliers"
    )
    ANSWERS.print(str(files["image"]), markup=False)
    took = {**compared.seconds, **found.seconds}
    ANSWERS.print(", ".join(f"{stage} {1e3 * seconds:.1f} ms" for stage, seconds in took.items()))


def _in_words(apart: "Apart") -> str:
    decibels = f"{apart.psnr_db:.1f} dB" if math.isfinite(apart.psnr_db) else "the same"
    return f"{decibels}, SSIM {apart.ssim:.3f}, {apart.rms_grey:.1f} grey levels rms"
