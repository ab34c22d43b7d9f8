"""The page of a cost curve: everything inlined, PNGs of the same beside it."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jinja2 import Environment, PackageLoader, StrictUndefined

from harness.accuracy import Level
from harness.cost import Curve, Point, front
from harness.cost_bounds import predicted_at_most, stretch
from harness.report.cost_chart import contacts_chart, cost_chart
from harness.report.figures import Album, Picture

PAGE = "cost.html"
"""Name of the page in its folder."""


@dataclass(frozen=True)
class Row:
    """One setting in words: its number on the front or "", then the cells of the table."""

    number: str
    cells: tuple[str, ...]


@dataclass(frozen=True)
class Section:
    """One condition: its drawing and its table."""

    anchor: str
    title: str
    picture: Picture
    runs: int
    rows: tuple[Row, ...]


HEADINGS = (
    "setting",
    "error",
    "median",
    "mean",
    "worst",
    "CPU",
    "wall",
    "next run at most",
    "90 % radius times",
)


def write_cost_page(curve: Curve, reasons: Sequence[str], family: str, count: str, folder: Path) -> Path:
    """Write the page and its pictures.

    Args:
        curve: what was measured.
        reasons: why it is stale; empty where it is not.
        family: the dial whose levels get a colour each.
        count: the condition that is drawn as an axis of its own: how many contacts.
        folder: made if it does not exist; files of the same names are replaced.

    Returns:
        Path of the page, which refers to nothing outside itself.
    """
    folder.mkdir(parents=True, exist_ok=True)
    album = Album(folder)
    environment = Environment(
        loader=PackageLoader("harness.report", "."),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    page = environment.get_template(PAGE).render(
        style=environment.get_template("report.css").render(),
        curve=curve,
        reasons=reasons,
        headings=HEADINGS,
        sections=[
            _section(curve.where(condition), condition, number, family, bool(reasons), album)
            for number, condition in enumerate(curve.conditions(), start=1)
        ],
        by_count=_by_count(curve, count, album),
    )
    (folder / PAGE).write_text(page, encoding="utf-8")
    return folder / PAGE


def _section(
    points: Sequence[Point],
    condition: Mapping[str, Level],
    number: int,
    family: str,
    stale: bool,
    album: Album,
) -> Section:
    title = ", ".join(f"{name} {value}" for name, value in condition.items())
    best = front(points)
    rows = [
        Row(str(best.index(point) + 1) if point in best else "", _cells(point))
        for point in sorted(points, key=lambda p: p.seconds.value)
    ]
    picture = album.drawing(f"cost_{number}", cost_chart(points, family, title, stale))
    return Section(f"c{number}", title, picture, max(len(p.samples) for p in points), tuple(rows))


def _cells(point: Point) -> tuple[str, ...]:
    factor = stretch(point)
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
        f"{factor:.2f}" if np.isfinite(factor) else "too few runs",
    )


def _by_count(curve: Curve, count: str, album: Album) -> Picture | None:
    """Settings measured with several numbers of contacts: those on the front with the most of them."""
    curves = []
    most = max(float(condition[count]) for condition in curve.conditions())
    for condition in curve.conditions():
        if float(condition[count]) != most:
            continue
        rest = {name: value for name, value in condition.items() if name != count}
        for point in front(curve.where(condition))[-2:]:
            same = sorted(
                ((int(p.condition[count]), p) for p in curve.where(rest) if p.levels == point.levels),
                key=lambda pair: pair[0],
            )
            if len(same) > 1:
                said = ", ".join(map(str, rest.values()))
                curves.append((f"{said}: {point.name}", same))
    return album.drawing("cost_by_contacts", contacts_chart(curves)) if curves else None
