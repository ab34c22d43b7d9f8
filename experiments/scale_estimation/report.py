"""The report of a scale estimation: the size, and the readings of each sense next to the model."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from experiments.scale_estimation.answer import ScaleAnswering, ScoredSize, SizeAnswer
from experiments.scale_estimation.contact_planning import placed
from experiments.scale_estimation.touch.touch import Touch
from experiments.scale_estimation.unseen.spectrogram import FRAMES, bands_of, levels_of, response_of
from experiments.scale_estimation.vision.vision import Sight
from harness.basics.errors import FitRefused
from harness.basics.files.json_file import JsonObject
from harness.basics.materials import MATERIALS
from harness.basics.mesh import hull_of
from harness.experiment.compare import Comparison
from harness.experiment.report_content import (
    AnswerValue,
    CaptionedPicture,
    Missing,
    PageSection,
    RunReport,
)
from harness.picture.outline import SeenOutline, corners_of
from harness.recording.observation import IMAGE
from harness.report.figures.figures import Album
from harness.report.figures.size import (
    beliefs_figure,
    outline_figure,
    resonances_figure,
    spectrogram_figure,
    touched_figure,
)
from harness.report.wording import millimetres, show_estimates, show_value

_FROM = {"fused": "from all senses", "vision": "from vision", "audio": "from sound", "touch": "from touch"}


def create_report(scored: ScoredSize, _comparison: Comparison, folder: Path) -> RunReport:
    """Return the answer in words and numbers and the sections of the page; write their pictures.

    Args:
        scored: the run and its answer.
        folder: folder of the page and its pictures; it exists.
    """
    album, answering, found = Album(folder), scored.answering, scored.found
    sections = [_posterior(scored, album)]
    if isinstance(answering.outline, SeenOutline):
        sections.append(_vision(answering, answering.outline, found.sight, album))
    if answering.strikes:
        known = answering.shape_known
        sections.append(_sound(answering, found, album) if known else _spectrum(answering, album))
    if answering.free:
        sections.append(_touch(answering, found, album))
    return RunReport(_sentence(scored), tuple(_values(scored.result)), sections, found.seconds)


def _sentence(scored: ScoredSize) -> str:
    fused = scored.result["estimates"]["fused"]
    error = fused["error_m"]
    compared = "" if error is None else f"; it is {millimetres(error, 1)} from the true size"
    return (
        f"The longest side of the {scored.run.scene.object.name} is {millimetres(fused['size_m'], 1)} "
        f"({_interval(fused)}){compared}."
    )


def _interval(estimate: JsonObject) -> str:
    return f"90 % within {1e3 * estimate['low90_m']:.1f} to {1e3 * estimate['high90_m']:.1f} mm"


def _values(result: JsonObject) -> Iterator[AnswerValue]:
    quantities = {"size_m": "longest side", "error_m": "error of the longest side"}
    yield from show_estimates(result["estimates"], _FROM, quantities, _interval)
    yield show_value("sizes that were searched", "range_m", result["range_m"])
    speed = result["sqrt_young_over_density"]
    if speed is not None:
        within = f"90 % within {speed['low90_m_per_s']:.0f} to {speed['high90_m_per_s']:.0f} m/s"
        for name, key, known in (
            ("sqrt(E / density) from sound and the size", "value_m_per_s", within),
            ("sqrt(E / density) of the stated material", "stated_m_per_s", ""),
        ):
            yield show_value(name, key, speed[key], known)
    yield show_value("contacts", "contacts", result["contacts"])
    yield show_value("usable strikes", "strikes", result["strikes"])


def _posterior(scored: ScoredSize, album: Album) -> PageSection:
    found, sizes = scored.found, scored.answering.model.sizes
    beliefs = {
        name: np.exp(one.belief.log_density)
        for name, one in found.by_sense.items()
        if not isinstance(one, FitRefused)
    }
    beliefs["fused"] = np.exp(found.fused.log_density)
    true = None if scored.truth is None else scored.truth.differences.get("longest_side_m")
    figure = beliefs_figure(np.exp(sizes.logs), beliefs, (sizes.low, sizes.high), true)
    caption = (
        "Posterior density of each sense and of all (fused). Each sense searches twice beyond the requested "
        "range, so that an object outside is recognised. The fused density is the product of the others, "
        "each mixed with 2 % of a uniform density."
    )
    picture = CaptionedPicture(album.drawing("beliefs", figure), caption)
    return PageSection("Posterior of the size", (picture,))


def _vision(
    answering: ScaleAnswering, outline: SeenOutline, sight: Sight | None, album: Album
) -> PageSection:
    record = next(record for record in answering.run.recording.steps() if IMAGE in record.readings)
    picture = np.asarray(np.median(record.readings[IMAGE].values, axis=0)).astype(np.uint8)
    fitted, caption = None, "Outline in the camera image. It does not fit this object at any size."
    if not answering.shape_known:
        caption = "Outline in the camera image. A regression on household shapes estimates the size from it."
    if sight is not None:
        view = answering.model.view
        corners = hull_of(view.project(sight.fit.unknowns[None], view.corners)[0])
        around = np.arctan2(*(corners - corners.mean(axis=0)).T[::-1])
        fitted = np.asarray(corners[np.argsort(around)])
        caption = f"Outlines in the camera image and of the model. They differ by {sight.fit.rms:.2f} px rms."
    shown = album.photograph("outline", outline_figure(picture, corners_of(outline), fitted))
    return PageSection("Vision", (CaptionedPicture(shown, caption),))


def _sound(answering: ScaleAnswering, found: SizeAnswer, album: Album) -> PageSection:
    peaks = answering.peaks()
    if peaks is None:
        return PageSection("Sound", (Missing("no strike is usable"),))
    hearing = found.hearing
    model = answering.model.ringing(answering.accuracy)
    size = found.fused.size if hearing is None else hearing.match.size
    log_size = np.log(size / answering.model.nominal)
    levels = model.levels(np.array([log_size]), peaks.window_decay)[0]
    recorded = np.column_stack([peaks.frequencies, peaks.levels])
    modelled = np.column_stack([model.frequencies * np.exp(-log_size), levels])
    caption = f"{len(peaks.frequencies)} recorded peaks above, modes of the model below. "
    if hearing is None:
        caption += "The peaks determine no size; the model is shown at the fused size."
    else:
        caption += f"The model explains each peak with a mean log-likelihood ratio of {hearing.matched:.1f}."
    drawn = album.drawing("peaks", resonances_figure(recorded, modelled, peaks.band))
    return PageSection("Sound", (CaptionedPicture(drawn, caption),))


def _spectrum(answering: ScaleAnswering, album: Album) -> PageSection:
    """Show the input of the network of sound."""
    response = response_of(answering.strikes)
    if response is None:
        return PageSection("Sound", (Missing("no strike is usable"),))
    material = MATERIALS[answering.run.scene.object.material]
    responses, rate, band = response
    middles, inside = bands_of(band, material)
    levels = levels_of(responses, rate, inside, material)[0][:, inside]
    named = {
        f"{1e3 * a:.0f} to {1e3 * b:.0f} ms": level for (a, b), level in zip(FRAMES, levels, strict=True)
    }
    caption = (
        "Level of each frequency band, early and late. A network trained on household things of all sizes "
        "estimates the size from it and from the material."
    )
    drawn = album.drawing("spectrum", spectrogram_figure(middles[inside], named))
    return PageSection("Sound", (CaptionedPicture(drawn, caption),))


def _touch(answering: ScaleAnswering, found: SizeAnswer, album: Album) -> PageSection:
    model, touch = answering.model, found.touch
    surface = np.zeros((0, 3))
    if answering.shape_known:
        pose = np.array([np.log(found.fused.size / model.nominal), 0.0, 0.0, 0.0])
        if touch is not None:
            pose = touch.unknowns[:4]
        elif found.sight is not None:
            pose = found.sight.fit.unknowns[:4]
        surface = placed(model, model.stand.points, pose) - model.place
    contacts = np.array([patch.points.mean(axis=0) - model.place for patch in answering.patches])
    passed = [line - model.place for line, met in zip(answering.free, answering.met, strict=True) if not met]
    caption = (
        f"{len(contacts)} contacts, and {len(passed)} probe lines without contact (dotted), relative to the "
        "nominal position."
    )
    if isinstance(touch, Touch):
        caption += f" The mean cost of a contact is {touch.cost:.2f} at the size from touch."
    drawn = album.drawing("contacts", touched_figure(surface, contacts.reshape(-1, 3), passed))
    return PageSection("Touch", (CaptionedPicture(drawn, caption),))
