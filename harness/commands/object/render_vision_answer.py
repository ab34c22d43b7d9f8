"""What ``touchstone object render vision`` answers: pictures, arrays, one JSON object, or prose."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from harness.commands.output import ANSWERS

if TYPE_CHECKING:
    from harness.basics.arrays import ByteArray, FloatArray
    from harness.objectfile.file import ObjectFile
    from harness.objectfile.vision.render import ObjectVision, Rendered
    from harness.picture.pinhole import DirectionalLight, Pinhole

View = tuple["Pinhole", "DirectionalLight"]

_WHITE = 255


@dataclass(frozen=True, eq=False)
class RenderedLook:
    """Pictures, and all that is said of them."""

    of: "ObjectFile"  #: the object.
    vision: "ObjectVision"  #: its look.
    views: tuple[View, ...]  #: a camera and a light for each picture.
    pictures: "tuple[Rendered, ...]"  #: of the views.
    seconds: dict[str, float]  #: s on the clock by stage.


def sheet(found: RenderedLook) -> "ByteArray":
    """All pictures before white, row by row, as square a sheet of them as can be."""
    import numpy as np

    shown = [picture.image.display() for picture in found.pictures]
    down, across = _grid(len(shown))
    rows, columns = shown[0].shape[:2]
    whole = np.full((down * rows, across * columns, 3), _WHITE, np.uint8)
    for index, picture in enumerate(shown):
        i, j = divmod(index, across)
        whole[i * rows : (i + 1) * rows, j * columns : (j + 1) * columns] = picture
    return whole


def _grid(count: int) -> tuple[int, int]:
    across = math.ceil(math.sqrt(count))
    return math.ceil(count / across), across


def write_arrays(path: Path, arrays: "Sequence[FloatArray]") -> None:
    """``(rows, columns)`` float32 of one picture; ``(pictures, rows, columns)`` of more."""
    import numpy as np

    from harness.basics.npz_file import write_array

    write_array(path, (arrays[0] if len(arrays) == 1 else np.stack(arrays)).astype(np.float32))


def as_json(found: RenderedLook, out: Path, depth_out: Path | None, alpha_out: Path | None) -> dict[str, Any]:
    """As scripts read it."""
    camera, light = found.views[0]
    entry = found.vision.entry
    return {
        "schema": 1,
        "folder": str(found.of.folder),
        "object": found.of.description.name,
        "level": "one_sample",
        "networks": entry.level,
        "image": str(out),
        "depth_out": None if depth_out is None else str(depth_out),
        "alpha_out": None if alpha_out is None else str(alpha_out),
        "rows": camera.height,
        "columns": camera.width,
        "camera": camera_as_json(camera),
        "light": {"direction": light.direction.tolist(), "irradiance": light.irradiance},
        "samples": sum(picture.samples for picture in found.pictures),
        "rays": sum(picture.rays for picture in found.pictures),
        "covered_share": float(found.pictures[0].image.alpha.mean()),
        "turntable": _turntable(found),
        "error_estimate": {"networks_measured": dict(entry.network.measured)},
        "seconds": found.seconds,
        "seconds_by_part": dict(found.pictures[0].seconds),
    }


def camera_as_json(camera: "Pinhole") -> dict[str, Any]:
    """Where a camera is in the object's frame, and what it shows."""
    return {
        "position_m": camera.eye.tolist(),
        "forward": camera.forward.tolist(),
        "object_from_camera": camera.object_from_camera.tolist(),
        "focal_px": camera.focal_px,
        "centre_px": list(camera.centre_px),
        "field_of_view_rad": camera.field_of_view,
    }


def _turntable(found: RenderedLook) -> dict[str, Any] | None:
    count = len(found.pictures)
    if count == 1:
        return None
    down, across = _grid(count)
    return {
        "pictures": count,
        "step_rad": 2.0 * math.pi / count,
        "sheet_rows": down,
        "sheet_columns": across,
        "seconds_a_picture": [picture.seconds["render"] for picture in found.pictures],
    }


def print_answer(found: RenderedLook, out: Path, depth_out: Path | None, alpha_out: Path | None) -> None:
    """For people."""
    camera, light = found.views[0]
    entry, first, count = found.vision.entry, found.pictures[0], len(found.pictures)
    x, y, z = (f"{each * 1e3:.4g}" for each in camera.eye)
    a, b, c = (f"{each:.3g}" for each in light.direction)
    many = "" if count == 1 else f", {count} of them a turn"
    ANSWERS.print(
        f"{found.of.description.name} from ({x}, {y}, {z}) mm, light towards ({a}, {b}, {c}), "
        f"{camera.width} x {camera.height} pixels{many}; {entry.level}",
        markup=False,
    )
    samples, rays = (sum(getattr(p, name) for p in found.pictures) for name in ("samples", "rays"))
    ANSWERS.print(f"{samples} samples of {rays} rays; the object covers {first.image.alpha.mean():.1%}")
    for path in (out, depth_out, alpha_out):
        if path is not None:
            ANSWERS.print(str(path), markup=False)
    took = ", ".join(f"{stage} {1e3 * seconds:.1f} ms" for stage, seconds in found.seconds.items())
    ANSWERS.print(took, markup=False)
