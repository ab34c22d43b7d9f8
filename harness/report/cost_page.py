"""The page of a cost curve: everything inlined, PNGs of the same beside it."""

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from harness.cost.bounds import predicted_at_most
from harness.cost.curve import Curve, Point, front
from harness.cost.promise import MET, doubts, promises
from harness.effects.accuracy import Level
from harness.experiment.report_content import CaptionedPicture, PageSection, ReportTable
from harness.report.figures.charts import contacts_chart, cost_chart
from harness.report.figures.figures import Album
from harness.report.template import write_page

PAGE = "cost.html"
"""Name of the page in its folder."""


_HEADINGS = (
    "front",
    "setting",
    "error",
    "median",
    "mean",
    "worst",
    "CPU",
    "wall",
    "next run at most",
    "promised to all",
    "to the surer half",
)


def write_cost_page(
    curve: Curve, reasons: Sequence[str], families: Sequence[str], count: str, folder: Path
) -> Path:
    """Write the page and its pictures.

    Args:
        curve: what was measured.
        reasons: why it is stale; empty where it is not.
        families: the dials each combination of whose levels gets a colour.
        count: the condition that is drawn as an axis of its own: how many contacts.
        folder: made if it does not exist; files of the same names are replaced.

    Returns:
        Path of the page, which refers to nothing outside itself.
    """
    folder.mkdir(parents=True, exist_ok=True)
    album = Album(folder)
    # Settings measured with several numbers of contacts: those of least error with the most.
    curves = []
    most = max(float(condition[count]) for condition in curve.conditions())
    for condition in curve.conditions():
        if float(condition[count]) != most:
            continue
        rest = {name: value for name, value in condition.items() if name != count}
        several = [p for p in curve.where(condition) if len(_alike(curve, rest, p)) > 1]
        for point in sorted(several, key=lambda p: p.error.value)[:_DRAWN]:
            same = sorted(
                ((int(p.condition[count]), p) for p in _alike(curve, rest, point)), key=lambda pair: pair[0]
            )
            said = ", ".join(map(str, rest.values()))
            curves.append((f"{said}: {point.name}", same))
    sections = [
        _section(curve.where(condition), condition, number, families, bool(reasons), album)
        for number, condition in enumerate(curve.conditions(), start=1)
    ]
    if curves:
        caption = (
            "Error and seconds of the settings of least error that were measured so, from the first contacts "
            "of the same runs. Bars are 90 % bootstrap intervals."
        )
        by_count = CaptionedPicture(album.drawing("cost_by_contacts", contacts_chart(curves)), caption)
        sections.append(PageSection("Number of contacts", (by_count,)))
    return write_page(folder / PAGE, PAGE, curve=curve, reasons=reasons, sections=sections)


def _section(
    points: Sequence[Point],
    condition: Mapping[str, Level],
    number: int,
    families: Sequence[str],
    stale: bool,
    album: Album,
) -> PageSection:
    title = ", ".join(f"{name} {value}" for name, value in condition.items())
    best = front(points)
    rows = [
        (str(best.index(point) + 1) if point in best else "", *_cells(point))
        for point in sorted(points, key=lambda p: p.seconds.value)
    ]
    picture = album.drawing(f"cost_{number}", cost_chart(points, families, title, stale))
    caption = (
        "Error against seconds. Each mark is one setting, answered on the same "
        f"{max(len(point.samples) for point in points)} runs. Filled and numbered: on the Pareto front, no "
        "other setting is both cheaper and better. Hollow: dominated."
    )
    table = ReportTable(_HEADINGS, rows, "l" * len(_HEADINGS))
    return PageSection(title, (CaptionedPicture(picture, caption), table))


def _cells(point: Point) -> tuple[str, ...]:
    several = len(point.samples) > 1
    return (
        point.name,
        f"{1e3 * point.error.value:.2f} [{1e3 * point.error.low:.2f}, {1e3 * point.error.high:.2f}] mm",
        f"{1e3 * point.median_error.value:.2f} mm",
        f"{1e3 * float(point.errors.mean()):.2f} mm",
        f"{1e3 * float(point.errors.max()):.1f} mm",
        f"{point.seconds.value:.3f} [{point.seconds.low:.3f}, {point.seconds.high:.3f}] s",
        f"{float(np.median(point.wall_seconds)):.3f} s",
        f"{predicted_at_most(point.cpu_seconds):.2f} s" if several else "one run",
        _promised(point, 1.0),
        _promised(point, 0.5),
    )


def _promised(point: Point, share: float) -> str:
    """The error promised to the run that is as sure as this share of the measured ones."""
    sure = np.sort(doubts(point, point.samples))
    limits, promised = promises(point, MET)
    if not len(limits):
        return "too few runs"
    at = sure[max(1, int(np.ceil(share * len(sure)))) - 1]
    return f"{1e3 * float(promised[np.searchsorted(limits, at)]):.1f} mm"


_DRAWN = 4


def _alike(curve: Curve, rest: Mapping[str, Level], point: Point) -> list[Point]:
    return [p for p in curve.where(rest) if p.levels == point.levels]
