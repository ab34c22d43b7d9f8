"""The pictures of a scale estimation's report: what each sense read, beside the model at the size found."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from experiments.scale_estimation.answer import ScaleAnswering, ScoredSize, SizeAnswer
from experiments.scale_estimation.contact_planning import placed
from experiments.scale_estimation.touch.touch import Touch
from experiments.scale_estimation.unseen.spectrogram import FRAMES, bands_of, levels_of, response_of
from experiments.scale_estimation.vision.vision import Sight
from harness.basics.errors import FitRefused
from harness.basics.materials import MATERIALS
from harness.basics.mesh import hull_of
from harness.bench.device import Health
from harness.experiment.compare import Comparison
from harness.experiment.lookup import named
from harness.picture.outline import SeenOutline, corners_of
from harness.recording.observation import IMAGE
from harness.report.figures.figures import Album
from harness.report.figures.size import (
    Resonances,
    TouchedObject,
    beliefs_figure,
    outline_figure,
    resonances_figure,
    spectrogram_figure,
    touched_figure,
)
from harness.report.run_page import PageSection, write_run_page

_NAME = "scale-estimation"


def write(
    scored: ScoredSize, comparison: Comparison, health: Mapping[str, Health] | None, folder: Path
) -> Path:
    """Draw the report; the path of its page."""
    folder.mkdir(parents=True, exist_ok=True)
    album = Album(folder)
    answering: ScaleAnswering = scored.answering
    found: SizeAnswer = scored.found
    sections = [_believed(scored, album)]
    if isinstance(answering.outline, SeenOutline):
        sections.append(_seen(answering, answering.outline, found.sight, album))
    if answering.strikes:
        known = answering.shape_known
        sections.append(_heard(answering, found, album) if known else _spectrum(answering, album))
    if answering.free:
        sections.append(_touched(answering, found, album))
    return write_run_page(named(_NAME), scored, comparison, health, folder, tuple(sections))


def _believed(scored: ScoredSize, album: Album) -> PageSection:
    found: SizeAnswer = scored.found
    sizes = scored.answering.model.sizes
    beliefs = {
        name: np.exp(one.belief.log_density)
        for name, one in found.by_sense.items()
        if not isinstance(one, FitRefused)
    }
    beliefs["fused"] = np.exp(found.fused.log_density)
    true = None if scored.truth is None else scored.truth.differences.get("longest_side_m")
    figure = beliefs_figure(np.exp(sizes.logs), beliefs, (sizes.low, sizes.high), true)
    return PageSection(
        "What is believed of the size",
        "Each sense searches twice beyond the range that was asked about, so that an object outside is "
        "recognised as such. The fused belief is their product, each with a floor of 2 %.",
        album.drawing("beliefs", figure),
    )


def _seen(answering: ScaleAnswering, outline: SeenOutline, sight: Sight | None, album: Album) -> PageSection:
    look = next(record for record in answering.run.recording.steps() if IMAGE in record.readings)
    picture = np.asarray(np.median(look.readings[IMAGE].values, axis=0)).astype(np.uint8)
    fitted, words = None, "The outline is at no size this object's; see the warnings."
    if not answering.shape_known:
        words = "The size is told from how far the outline reaches, by what household things look like."
    if sight is not None:
        view = answering.model.view
        corners = hull_of(view.project(sight.fit.unknowns[None], view.corners)[0])
        around = np.arctan2(*(corners - corners.mean(axis=0)).T[::-1])
        fitted = np.asarray(corners[np.argsort(around)])
        words = f"The two leave each other by {sight.fit.rms:.2f} px (rms)."
    return PageSection(
        "By sight", words, album.photograph("outline", outline_figure(picture, corners_of(outline), fitted))
    )


def _heard(answering: ScaleAnswering, found: SizeAnswer, album: Album) -> PageSection:
    peaks = answering.peaks()
    if peaks is None:
        return PageSection("By sound", "No strike may be used.", None)
    hearing = found.hearing
    model = answering.model.ringing(answering.accuracy)
    size = found.fused.size if hearing is None else hearing.match.size
    log_size = np.log(size / answering.model.nominal)
    levels = model.levels(np.array([log_size]), peaks.window_decay)[0]
    shown = Resonances(
        np.column_stack([peaks.frequencies, peaks.levels]),
        np.column_stack([model.frequencies * np.exp(-log_size), levels]),
        peaks.band,
    )
    words = f"{len(peaks.frequencies)} peaks were heard"
    if hearing is None:
        words += ", and are no answer; the model is drawn at the fused size."
    else:
        words += f"; the model explains them by {hearing.matched:.1f} nats each over chance."
    return PageSection("By sound", words, album.drawing("peaks", resonances_figure(shown)))


def _spectrum(answering: ScaleAnswering, album: Album) -> PageSection:
    """What the network of sound is given."""
    heard = response_of(answering.strikes)
    if heard is None:
        return PageSection("By sound", "No strike may be used.", None)
    material = MATERIALS[answering.run.scene.object.material]
    responses, rate, band = heard
    middles, inside = bands_of(band, material)
    levels = levels_of(responses, rate, inside, material)[0][:, inside]
    named = {
        f"{1e3 * a:.0f} to {1e3 * b:.0f} ms": level for (a, b), level in zip(FRAMES, levels, strict=True)
    }
    words = (
        "How loudly bands ring, early and late. The size is told from it and from the material, by what "
        "household things of all sizes sound like."
    )
    return PageSection(
        "By sound", words, album.drawing("spectrum", spectrogram_figure(middles[inside], named))
    )


def _touched(answering: ScaleAnswering, found: SizeAnswer, album: Album) -> PageSection:
    model, touch = answering.model, found.touch
    surface = np.zeros((0, 3))
    if answering.shape_known:
        stand = np.array([np.log(found.fused.size / model.nominal), 0.0, 0.0, 0.0])
        if touch is not None:
            stand = touch.unknowns[:4]
        elif found.sight is not None:
            stand = found.sight.fit.unknowns[:4]
        surface = placed(model, model.stand.points, stand) - model.place
    contacts = np.array([patch.points.mean(axis=0) - model.place for patch in answering.patches])
    passed = [line - model.place for line, met in zip(answering.free, answering.met, strict=True) if not met]
    words = (
        f"{len(contacts)} contacts, {len(passed)} ways that met nothing (dotted), round the nominal place."
    )
    if isinstance(touch, Touch):
        words += f" The contacts cost {touch.cost:.2f} each at the size found by touch."
    shown = TouchedObject(surface, contacts.reshape(-1, 3), passed)
    return PageSection("By touch", words, album.drawing("contacts", touched_figure(shown)))
