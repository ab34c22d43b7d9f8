"""The pictures of a shape reconstruction's report: the surface found, what it rests on, and the truth."""

from collections.abc import Iterator, Mapping
from pathlib import Path

import numpy as np

from experiments.shape_reconstruction.answer import ShapeAnswer
from experiments.shape_reconstruction.result import true_surface
from harness.basics.arrays import FloatArray
from harness.bench.device import Health
from harness.experiment.compare import Comparison
from harness.experiment.experiment import Scored
from harness.experiment.lookup import named
from harness.report.figures.figures import Album
from harness.report.figures.shape import KnownSurface, mask_figure, sections_figure, surface_figure
from harness.report.run_page import PageSection, write_run_page
from harness.skills.look import IMAGE

_NAME = "shape-reconstruction"


def write(scored: Scored, comparison: Comparison, health: Mapping[str, Health] | None, folder: Path) -> Path:
    """Draw the report; the path of its page."""
    folder.mkdir(parents=True, exist_ok=True)
    sections = tuple(_sections(scored, Album(folder)))
    return write_run_page(named(_NAME), scored, comparison, health, folder, sections)


def _sections(scored: Scored, album: Album) -> Iterator[PageSection]:
    answer: ShapeAnswer = scored.found
    yield _surface(answer, album)
    yield _cuts(scored, answer, album)
    if answer.evidence.look is not None:
        yield _seen(scored, answer, album)


def _surface(answer: ShapeAnswer, album: Album) -> PageSection:
    touches = answer.evidence.touches
    contacts = np.array([touch.points.mean(axis=0) for touch in touches if touch.met]).reshape(-1, 3)
    passed = [_way(touch.stand_from_gel, touch.way) for touch in touches if not touch.met]
    shown = KnownSurface(answer.fused.mesh, answer.fused.deviation, contacts, passed)
    words = (
        f"By all readings: {len(contacts)} contacts (white), {len(passed)} ways that met nothing (dotted). "
        "The colour is how well the surface is known there."
    )
    return PageSection("The surface", words, album.photograph("surface", surface_figure(shown)))


def _way(stand_from_gel: FloatArray, length: float) -> FloatArray:
    """``(2, 3)`` m, from and to."""
    end, forward = stand_from_gel[:3, 3], stand_from_gel[:3, 2]
    return np.array([end - length * forward, end])


def _cuts(scored: Scored, answer: ShapeAnswer, album: Album) -> PageSection:
    truth = None if scored.truth is None else true_surface(scored.run)
    beside = "" if truth is None else ", and the true object by the same planes"
    figure = sections_figure(answer.fused.mesh, truth)
    words = f"The surface cut through its middle{beside}."
    return PageSection("Sections", words, album.drawing("sections", figure))


def _seen(scored: Scored, answer: ShapeAnswer, album: Album) -> PageSection:
    look = next(record for record in scored.run.recording.steps() if IMAGE in record.readings)
    picture = np.asarray(np.median(look.readings[IMAGE].values, axis=0)).astype(np.uint8)
    assert answer.evidence.look is not None
    words = "What differs from the picture of the bare bench is taken for the object."
    figure = mask_figure(picture, answer.evidence.look.mask)
    return PageSection("The silhouette", words, album.photograph("silhouette", figure))
