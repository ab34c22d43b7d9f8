"""The report of a shape reconstruction: the surface, its readings, and the truth."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from experiments.shape_reconstruction.answer import ScoredShape, ShapeAnswer
from experiments.shape_reconstruction.evidence import ShapeEvidence
from experiments.shape_reconstruction.explore.explorer import get_running_shape, live_estimates, live_method
from experiments.shape_reconstruction.fits import ShapeEstimate
from experiments.shape_reconstruction.methods import METHOD
from experiments.shape_reconstruction.metric import (
    F_SCORE_WITHIN,
    band_held,
    shape_error,
    surfaces_apart,
)
from experiments.shape_reconstruction.result import stem_of, true_surface
from experiments.shape_reconstruction.section import ShapeRun
from harness.basics.files.json_file import JsonObject
from harness.basics.mesh import Mesh
from harness.experiment.compare import Comparison
from harness.experiment.report_content import (
    AnswerValue,
    CaptionedPicture,
    Missing,
    PageBlock,
    PageSection,
    RunReport,
)
from harness.recording.observation import IMAGE
from harness.report.figures.figures import Album
from harness.report.figures.shape import (
    KnownSurface,
    SurfaceThen,
    mask_figure,
    sections_figure,
    strip_figure,
    surface_figure,
)
from harness.report.turned import turned_surface
from harness.report.wording import millimetres, show_estimates, show_value

_SAMPLES = 2000
"""Number of samples on each surface; they determine an error to a tenth of a millimetre."""

_FROM = {"fused": "from all readings", "vision": "from the camera image", "touch": "from touch"}


def create_report(scored: ScoredShape, _comparison: Comparison, folder: Path) -> RunReport:
    """Return the answer in words and numbers and the sections of the page; write their pictures.

    Args:
        scored: the run and its answer.
        folder: folder of the page and its pictures; it exists.
    """
    album, truth, answer = Album(folder), true_surface(scored.run, scored.truth), scored.found
    sections = [PageSection("The surface", _surface(answer, truth, album))]
    if answer.evidence.touches:
        sections.append(PageSection("Press by press", (_strip(scored, truth, album),)))
    compared = "" if truth is None else ", and of the true object"
    cut = CaptionedPicture(
        album.drawing("sections", sections_figure(answer.fused.mesh, truth)),
        f"Cross-sections of the surface{compared} in three planes through the centre of the surface.",
    )
    sections.append(PageSection("Cross-sections", (cut,)))
    if answer.evidence.look is not None:
        recording = scored.run.recording
        records = (recording.step(index) for index in range(recording.committed))  # the image is the first
        record = next(record for record in records if IMAGE in record.readings)
        picture = np.asarray(np.median(record.readings[IMAGE].values, axis=0)).astype(np.uint8)
        outline = CaptionedPicture(
            album.photograph("silhouette", mask_figure(picture, answer.evidence.look.mask)),
            "Pixels that differ from the image of the bare bench belong to the object. Only this outline of "
            "the image is used.",
        )
        sections.append(PageSection("The silhouette", (outline,)))
    sentence = _sentence(scored.run.scene.object.name, scored.result)
    return RunReport(sentence, tuple(_values(scored.result)), sections, answer.seconds)


def _sentence(name: str, result: JsonObject) -> str:
    sides = " x ".join(f"{1e3 * side:.0f}" for side in result["extents_m"])
    error = result["error_m"]
    compared = "" if error is None else f"; it is {millimetres(error, 1)} from the true surface on average"
    return (
        f"The {name} measures {sides} mm along x, y and z. The standard deviation of its surface is "
        f"{millimetres(result['deviation_m'], 1)} on average{compared}."
    )


def _values(result: JsonObject) -> Iterator[AnswerValue]:
    quantities = {"extents_m": "size along x, y and z", "chamfer_m": "mean distance to the true surface"}
    yield from show_estimates(
        result["estimates"],
        _FROM,
        quantities,
        lambda estimate: f"standard deviation {millimetres(estimate['deviation_m'], 1)} on average",
    )
    for name, key in (
        (f"F-score at {1e3 * F_SCORE_WITHIN:g} mm", "f_score"),
        ("vertices under a contact", "touched"),
        ("vertices at the border of the silhouette", "seen"),
    ):
        fraction = result["estimates"]["fused"][key]
        if fraction is not None:
            yield AnswerValue(name, f"{100.0 * fraction:.0f}", "%")
    for name, key in (
        ("presses", "presses"),
        ("contacts", "contacts"),
        ("presses that repeat an earlier one", "repeated"),
        ("presses that the sensor's housing ended", "ended_by_housing"),
    ):
        yield show_value(name, key, result[key])


def _surface(answer: ShapeAnswer, truth: Mesh | None, album: Album) -> tuple[PageBlock, ...]:
    found, evidence = answer.fused, answer.evidence
    shown = _show_surface(found, evidence)
    contacts, ended = len(evidence.contacts), len(evidence.ended_by_housing)
    nothing = len(evidence.distinct) - contacts - ended
    caption = (
        f"The surface from all readings: {_count(contacts, 'contact')} (white); dotted, "
        f"{_count(ended, 'probe line')} that the sensor's housing ended and {nothing} without contact. "
        "Surface that is neither under a contact nor at the border of the silhouette is predicted by the "
        "prior. The colour is the standard deviation of the surface along its normal."
    )
    if truth is not None:
        held = band_held(found, surfaces_apart(found.mesh, truth, _SAMPLES)).truth
        caption += f" {100.0 * held:.0f} % of the true surface are within its 90 % band."
    return (
        CaptionedPicture(album.photograph("surface", surface_figure(shown)), caption),
        turned_surface(shown),
        f"Files next to result.json: {stem_of('fused')}.ply (standard deviation and source of each vertex), "
        ".obj, .glb and .npz.",
    )


def _count(count: int, noun: str) -> str:
    return f"{count} {noun}" if count == 1 else f"{count} {noun}s"


def _show_surface(estimate: ShapeEstimate, evidence: ShapeEvidence) -> KnownSurface:
    """Return a picture of a surface with its readings."""
    touches = evidence.touches
    contacts = np.array([touch.points.mean(axis=0) for touch in touches if touch.met]).reshape(-1, 3)
    passed = []
    for touch in touches:
        if not touch.met:
            end, forward = touch.stand_from_gel[:3, 3], touch.stand_from_gel[:3, 2]
            passed.append(np.array([end - touch.way * forward, end]))
    return KnownSurface(estimate.mesh, estimate.deviation, contacts, passed)


def _strip(scored: ScoredShape, truth: Mesh | None, album: Album) -> CaptionedPicture:
    answer, method = scored.found, live_method(scored.run.scene.section(ShapeRun).choose)
    last = answer.fused if scored.accuracy[METHOD.name] == method else None
    shown = []
    for evidence, estimate in live_estimates(answer.evidence, get_running_shape(scored.run, method), last):
        title = f"press {len(evidence.touches)}"
        if estimate is None:
            shown.append(SurfaceThen(title, "not enough for a surface", None))
            continue
        known = f"known to {1e3 * float(estimate.deviation.mean()):.1f} mm"
        if truth is not None:
            known += f", {1e3 * shape_error(estimate.mesh, truth, samples=_SAMPLES).chamfer:.1f} off"
        shown.append(SurfaceThen(title, known, _show_surface(estimate, evidence)))
    drawn = any(one.shown is not None for one in shown)
    readings = "presses" if answer.evidence.look is None else "the camera image and the presses"
    return CaptionedPicture(
        album.photograph("strip", strip_figure(shown)) if drawn else Missing("no press gave a surface"),
        f"The surface from {readings} so far, by the method between two presses ({method}), with its mean "
        "standard deviation and its mean distance from the truth of a mocked run, in mm. Contacts are white; "
        "all share one colour scale.",
    )
