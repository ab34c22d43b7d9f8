"""The report's one page: everything inlined, PNGs of the same beside it."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np

from harness.basics.arrays import AnyArray, ByteArray, FloatArray
from harness.report import wording
from harness.report.agreement_part import agreement_part
from harness.report.data import AnswerRow, ContactRow, ErrorCurve, ReportData
from harness.report.figures.charts import error_chart
from harness.report.figures.figures import Album, Picture
from harness.report.figures.pictures import (
    Sides,
    bench_figure,
    close_up,
    contacts_figure,
    object_sides,
    posterior_figure,
    posterior_strip,
)
from harness.report.figures.sound import senses_figure, spectrogram_pair
from harness.report.figures.tiles import DIFFERENCE_GAIN, difference, png
from harness.report.template import write_page
from harness.report.values import Missing, Posterior

PAGE = "report.html"
"""Name of the page in a report's folder."""

_SIDE_PIXELS = 460
_LEAST_ACROSS = 0.03


@dataclass(frozen=True)
class Tile:
    """A small picture under its title, or the reason why there is none."""

    title: str
    picture: Picture | Missing


def write_report(data: ReportData, folder: Path) -> Path:
    """Write the page and its pictures.

    Args:
        data: everything shown; what is ``Missing`` is said to be, with its reason.
        folder: made if it does not exist; files of the same names are replaced.

    Returns:
        Path of the page, which refers to nothing outside itself.
    """
    folder.mkdir(parents=True, exist_ok=True)
    return write_page(folder / PAGE, PAGE, **_content(data, Album(folder)))


def _content(data: ReportData, album: Album) -> dict[str, Any]:
    bench = data.bench
    # The object is shown if a contact was located or posed, or a sense has something to show.
    shown = [
        one
        for contact in data.contacts
        for one in (contact.posterior, contact.object_from_gel)
        if not isinstance(one, Missing)
    ]
    is_shown = bool(shown) or not isinstance(data.sound, Missing)
    sides = object_sides(data.mesh, _towards(data), _SIDE_PIXELS) if is_shown else None
    return {
        "data": data,
        "say": wording,
        "is_missing": lambda value: isinstance(value, Missing),
        "headline": wording.headline(data),
        "cards": wording.cards(data.answer) if isinstance(data.answer, AnswerRow) else [],
        "bench": bench if isinstance(bench, Missing) else album.photograph("bench", bench_figure(bench)),
        **_on_the_object(data, album, sides),
        **_sound(data, album, sides),
        "tiles": {contact.number: _tiles(contact, album) for contact in data.contacts},
        "fits": {contact.number: _fit(contact) for contact in data.contacts},
        "gain": f"{DIFFERENCE_GAIN:g}",
        "agreement": agreement_part(data.agreement, album),
        "by_contact": _chart(data.error_by_contact, "error_by_contact", "contacts used", False, album),
        "by_seconds": _chart(data.error_by_seconds, "error_by_seconds", "seconds a contact", True, album),
    }


def _on_the_object(data: ReportData, album: Album, sides: Sides | None) -> dict[str, Any]:
    """Contacts and posteriors on the object."""
    located = [contact for contact in data.contacts if isinstance(contact.posterior, Posterior)]
    posed = any(not isinstance(contact.object_from_gel, Missing) for contact in data.contacts)
    shown: dict[str, Any] = {
        "contacts_picture": Missing("no contact was located"),
        "strip": Missing("no contact has a posterior"),
        "last": Missing("no contact has a posterior"),
        "last_contact": located[-1] if located else None,
    }
    if sides is None:
        return shown
    if posed:
        shown["contacts_picture"] = album.photograph("contacts", contacts_figure(sides, data.contacts))
    if located:
        shown["strip"] = album.photograph("posterior_by_contact", posterior_strip(sides, data.contacts))
        shown["last"] = album.photograph("posterior", posterior_figure(sides, located[-1]))
    return shown


def _sound(data: ReportData, album: Album, sides: Sides | None) -> dict[str, Any]:
    """Each sense on the object, and a strike beside the model's."""
    sound = data.sound
    if isinstance(sound, Missing) or sides is None:
        return {}
    pair = sound.pair
    truth = data.contacts[-1].truth if data.contacts else None
    found = [one.posterior for one in sound.senses if not isinstance(one.posterior, Missing)]
    around = _towards(data)
    # The close-up spans the area that every sense's posterior covers, and at most the object.
    reach = [one.credible90 + float(np.linalg.norm(one.estimate - around)) for one in found]
    across = min(max(_LEAST_ACROSS, 3.0 * max(reach, default=0.0)), data.mesh.diagonal)
    # It looks from where the tool came from at the last contact, or outwards where that is unknown.
    posed = data.contacts[-1].object_from_gel if data.contacts else Missing("there is no contact")
    to_the_tool = (
        np.asarray(_towards(data) - data.mesh.bounds.mean(axis=0))
        if isinstance(posed, Missing)
        else np.asarray(-posed[:3, 2])
    )
    near = close_up(data.mesh, _towards(data), to_the_tool, across, _SIDE_PIXELS)
    counted = [] if isinstance(sound.peaks, Missing) else [abs(peak.counted) for peak in sound.peaks]
    longest = max(counted, default=0.0)
    believed = {wording.SENSES[sense.name]: sense.posterior for sense in sound.senses}
    return {
        # Each in per cent of the longest.
        "bars": [100.0 * one / longest if longest > 0.0 else 0.0 for one in counted],
        "across": across,
        "senses": album.photograph("senses", senses_figure((*sides.shots, near), believed, truth)),
        "spectrograms": pair
        if isinstance(pair, Missing)
        else album.photograph(
            "spectrograms",
            spectrogram_pair(pair.times, pair.frequencies, pair.recorded, pair.simulated),
        ),
    }


def _towards(data: ReportData) -> FloatArray:
    """The point of the object to look at: the answer, else its front."""
    if isinstance(data.answer, AnswerRow):
        return data.answer.position
    return np.asarray(data.mesh.bounds.mean(axis=0))


def _tiles(contact: ContactRow, album: Album) -> list[Tile]:
    """Live, simulated and difference; then the two height maps on one scale."""
    prefix = f"contact_{contact.number}"
    live, simulated = contact.live, contact.simulated
    heights = [contact.live_height, contact.simulated_height]
    highest = max([float(h.max()) for h in heights if not isinstance(h, Missing)], default=0.0)
    apart: Picture | Missing
    if isinstance(live, Missing) or isinstance(simulated, Missing):
        apart = live if isinstance(live, Missing) else Missing("there is no simulated image")
    else:
        apart = album.pixels(f"{prefix}_difference", png(difference(live, simulated)))
    tiles = [
        Tile("live", _image(live, f"{prefix}_live", album)),
        Tile("simulated", _image(simulated, f"{prefix}_simulated", album)),
        Tile("difference", apart),
    ]
    for name, height in zip(("live", "simulated"), heights, strict=True):
        title = f"height, {name}: 0 to {highest * 1e3:.2f} mm"
        if isinstance(height, Missing):
            tiles.append(Tile(f"height, {name}", height))
        else:
            picture = png(height_picture(height, highest))
            tiles.append(Tile(title, album.pixels(f"{prefix}_height_{name}", picture)))
    return tiles


def _image(image: AnyArray | Missing, name: str, album: Album) -> Picture | Missing:
    return image if isinstance(image, Missing) else album.pixels(name, png(image))


def _fit(contact: ContactRow) -> str:
    """How far live and simulated readings lie apart, in words."""
    said = []
    if not isinstance(contact.live, Missing) and not isinstance(contact.simulated, Missing):
        grey_levels = contact.live.astype(np.float64) - contact.simulated.astype(np.float64)
        said.append(f"images differ by {float(np.sqrt(np.mean(grey_levels**2))):.1f} grey levels rms")
    if not isinstance(contact.live_height, Missing) and not isinstance(contact.simulated_height, Missing):
        apart = float(np.sqrt(np.mean((contact.live_height - contact.simulated_height) ** 2)))
        said.append(f"height maps by {apart * 1e3:.3f} mm rms")
    return ", ".join(said)


def _chart(
    curves: tuple[ErrorCurve, ...] | Missing, name: str, x_label: str, logarithmic_x: bool, album: Album
) -> Picture | Missing:
    if isinstance(curves, Missing):
        return curves
    if not any(curve.x for curve in curves):
        return Missing("no errors were given")
    return album.drawing(name, error_chart(curves, x_label, logarithmic_x))


def height_picture(height: FloatArray, highest: float) -> ByteArray:
    """Colour an indentation map in m as ``(rows, columns, 3)``, dark at 0 and bright at ``highest``."""
    level = np.clip(height / highest, 0.0, 1.0) if highest > 0.0 else np.zeros_like(height)
    colours = mpl.colormaps["viridis"](level)[..., :3]
    return np.asarray(np.round(255.0 * colours), dtype=np.uint8)
