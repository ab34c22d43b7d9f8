"""The pictures of a shape reconstruction's report: the surface found, what it rests on, and the truth."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from experiments.shape_reconstruction.answer import ScoredShape, ShapeAnswer
from experiments.shape_reconstruction.evidence import ShapeEvidence
from experiments.shape_reconstruction.explore.explorer import live_estimates, live_method
from experiments.shape_reconstruction.fits import SEEN, TOUCHED, ShapeEstimate
from experiments.shape_reconstruction.metric import band_held, shape_error, surfaces_apart
from experiments.shape_reconstruction.result import stem_of, true_surface
from experiments.shape_reconstruction.section import ShapeRun
from harness.basics.mesh import Mesh
from harness.bench.device import Health
from harness.experiment.compare import Comparison
from harness.experiment.lookup import named
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
from harness.report.run_page import PageSection, write_run_page
from harness.report.turned import turned_surface

_NAME = "shape-reconstruction"

_SAMPLES = 2000
"""On each surface, for an error to a tenth of a millimetre."""


def write(
    scored: ScoredShape, comparison: Comparison, health: Mapping[str, Health] | None, folder: Path
) -> Path:
    """Draw the report; the path of its page."""
    folder.mkdir(parents=True, exist_ok=True)
    album, truth = Album(folder), true_surface(scored.run, scored.truth)
    answer: ShapeAnswer = scored.found
    sections = [_surface(answer, truth, album)]
    if answer.evidence.touches:
        sections.append(_strip(scored, answer, truth, album))
    figure = sections_figure(answer.fused.mesh, truth)
    beside = "" if truth is None else ", and the true object by the same planes"
    words = f"The surface cut by three planes through its middle{beside}."
    sections.append(PageSection("Sections", words, album.drawing("sections", figure)))
    if answer.evidence.look is not None:
        recording = scored.run.recording
        records = (recording.step(index) for index in range(recording.committed))  # the look is the first
        look = next(record for record in records if IMAGE in record.readings)
        picture = np.asarray(np.median(look.readings[IMAGE].values, axis=0)).astype(np.uint8)
        words = (
            "What differs from the picture of the bare bench is taken for the object. No more of the picture "
            "is used than this outline."
        )
        outline = album.photograph("silhouette", mask_figure(picture, answer.evidence.look.mask))
        sections.append(PageSection("The silhouette", words, outline))
    return write_run_page(named(_NAME), scored, comparison, health, folder, tuple(sections))


def _surface(answer: ShapeAnswer, truth: Mesh | None, album: Album) -> PageSection:
    found, evidence = answer.fused, answer.evidence
    shown = _shown(found, evidence)
    ended, met = len(evidence.ended_by_housing), len(evidence.contacts)
    nothing = len(evidence.distinct) - met - ended
    touched, seen = (100.0 * float((found.known_by == source).mean()) for source in (TOUCHED, SEEN))
    held = ""
    if truth is not None:
        apart = surfaces_apart(found.mesh, truth, _SAMPLES)
        held = (
            f"It is {1e3 * apart.error.chamfer:.1f} mm off the truth on average, which only a mocked run "
            f"knows; {100.0 * band_held(found, apart).truth:.0f} % of the true surface lie within its 90 % "
            "band. "
        )
    words = (
        f"By all readings: {met} contact{'' if met == 1 else 's'} (white); dotted, {ended} "
        f"way{'' if ended == 1 else 's'} that the sensor's housing ended, and {nothing} that met nothing. "
        f"Of its vertices {touched:.0f} % lie under a contact and {seen:.0f} % at the silhouette's border; "
        "all others are supposed. The colour is one standard deviation of the surface along its normal: the "
        f"darker, the less sure. {held}"
        f"Beside result.json: {stem_of('fused')}.ply (deviation and source of each vertex), .obj, .glb, .npz."
    )
    picture = album.photograph("surface", surface_figure(shown))
    return PageSection("The surface", words, picture, turned_surface(shown))


def _shown(estimate: ShapeEstimate, evidence: ShapeEvidence) -> KnownSurface:
    """A surface with the readings that it is made of."""
    touches = evidence.touches
    contacts = np.array([touch.points.mean(axis=0) for touch in touches if touch.met]).reshape(-1, 3)
    passed = []
    for touch in touches:
        if not touch.met:
            end, forward = touch.stand_from_gel[:3, 3], touch.stand_from_gel[:3, 2]
            passed.append(np.array([end - touch.way * forward, end]))
    return KnownSurface(estimate.mesh, estimate.deviation, contacts, passed)


def _strip(scored: ScoredShape, answer: ShapeAnswer, truth: Mesh | None, album: Album) -> PageSection:
    method = live_method(scored.run.scene.section(ShapeRun).choose)
    found = []
    for live in live_estimates(answer.evidence, method):
        title, estimate = f"press {live.presses}", live.estimate
        if estimate is None:
            found.append(SurfaceThen(title, "not enough for a surface", None))
            continue
        known = f"known to {1e3 * float(estimate.deviation.mean()):.1f} mm"
        if truth is not None:
            known += f", {1e3 * shape_error(estimate.mesh, truth, samples=_SAMPLES).chamfer:.1f} off"
        found.append(SurfaceThen(title, known, _shown(estimate, live.evidence)))
    seen = "presses" if answer.evidence.look is None else "the picture and all presses"
    words = (
        f"The surface from {seen} until then, by the method that the arm waits for ({method}): how well it "
        "is stated to be known, and how far off the truth it is, which only a mocked run knows; means in mm. "
        "Contacts are white; colours are of one scale."
    )
    if all(one.shown is None for one in found):
        return PageSection("Press by press", f"{words} None of them said enough for a surface.")
    return PageSection("Press by press", words, album.photograph("strip", strip_figure(found)))
