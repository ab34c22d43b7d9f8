"""One page of all objects of a build: a picture, modes and quality of each."""

import base64
from collections import Counter
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from harness.authoring.catalogue.summary import QUALITY, ObjectSummary
from harness.basics.errors import TouchstoneError
from harness.objectfile.vision.view import camera_for, light_for
from harness.picture.image_file import png_bytes
from harness.report.template import write_page
from harness.sim.light.appearance import plain
from harness.sim.light.direct_image import LitObject

PAGE = "catalogue.html"
"""Name of the page in the folder of a build."""

_SIDE = 96
"""Pixels of a picture."""

_GREY = (0.5, 0.5, 0.5)


def write_catalogue_page(
    found: Sequence[ObjectSummary], excluded: Sequence[tuple[str, str]], catalogue: str, path: Path
) -> Path:
    """Write the page; its path.

    Args:
        found: the objects, in their order.
        excluded: names and reasons of rows that were not built.
        catalogue: where the rows come from.
        path: of the page; a file of that name is replaced.
    """
    counts = Counter(each.outcome for each in found)
    return write_page(
        path,
        PAGE,
        catalogue=catalogue,
        counts=[f"{count} {outcome}" for outcome, count in counts.most_common()],
        cards=[(each, _picture(each), _lines(each)) for each in found],
        excluded=excluded,
    )


def _picture(each: ObjectSummary) -> str:
    """As a data URI; "" where there is none."""
    if each.object is None:
        return ""
    try:
        # Matt grey on white, from the front, the right and above.
        camera = camera_for(each.object.mesh, _SIDE, _SIDE)
        image = LitObject(plain(each.object.mesh, _GREY)).render(camera, [light_for(camera)], samples=2).image
        return "data:image/png;base64," + base64.b64encode(png_bytes(image.display())).decode()
    except TouchstoneError:
        return ""


def _lines(each: ObjectSummary) -> list[str]:
    if each.object is None:
        return []
    description = each.object.description
    low, high = np.array(description.mesh.low_m), np.array(description.mesh.high_m)
    size = " x ".join(f"{side * 1e3:.3g}" for side in high - low)
    lines = [f"{description.material.name}, {size} mm"]
    audio = description.audio
    if audio is not None:
        lines.append(
            f"{len(audio.frequencies_hz)} modes, {audio.frequencies_hz[0]:.4g} to "
            f"{audio.frequencies_hz[-1]:.4g} Hz; {audio.mass_kg:.3g} kg"
        )
    lines += [f"{QUALITY[key][1]} {value:.3g}" for key, value in each.quality.items()]
    return lines
