"""The content of a run's report as plain values: the answer in words and numbers, and page sections."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TypeAlias

COUNT = "count"
"""Unit of a number of things, which has no dimension."""


@dataclass(frozen=True)
class AnswerValue:
    """One row of the answer's table."""

    quantity: str  #: name of the quantity.
    value: str  #: its number, or several in brackets.
    unit: str  #: unit of the value, ``COUNT`` for a dimensionless number.
    uncertainty: str = ""  #: interval with its probability and unit; empty if none is stated.


@dataclass(frozen=True)
class Missing:
    """A part of the report that is not available."""

    reason: str  #: reason, as the end of a sentence.


@dataclass(frozen=True)
class Notice:
    """A warning."""

    text: str  #: one or more sentences.


@dataclass(frozen=True)
class Picture:
    """A rendered picture."""

    source: str  #: a ``data:`` address that holds all of it.
    file: str  #: name of the PNG next to the page.


@dataclass(frozen=True)
class CaptionedPicture:
    """A picture with its caption."""

    picture: Picture | Missing  #: the picture, or the reason why there is none.
    caption: (
        str  #: explanation below it; its first sentence describes the picture to readers who cannot see it.
    )


@dataclass(frozen=True)
class Tiles:
    """Small pictures in a row, shown pixel for pixel."""

    tiles: Sequence[tuple[str, Picture | Missing]]  #: title and picture of each tile.


@dataclass(frozen=True)
class Bar:
    """A cell of a table that shows a number as a bar."""

    percent: float  #: length, 0 to 100 % of the longest bar of the column.
    is_negative: bool  #: whether the number is below zero.


@dataclass(frozen=True)
class ReportTable:
    """A table."""

    headings: Sequence[str]  #: heading of each column; empty for a table of names and values.
    rows: Sequence[Sequence[str | Bar]]  #: cells of each row.
    align: str  #: ``"l"`` or ``"r"`` for each column; columns to the right hold numbers.


@dataclass(frozen=True)
class TurnedSurface:
    """A surface that a reader rotates: base64 arrays, little endian, relative to the surface's centre."""

    places: str  #: int16, three per vertex, in equal steps; z is up.
    faces: str  #: uint16, the three vertices of each.
    colours: str  #: uint8, red, green and blue of each vertex.
    marks: str  #: int16, three of each contact, in the same steps.


@dataclass(frozen=True)
class PageSection:
    """A part of the page under a heading."""

    title: str  #: heading of the section.
    blocks: Sequence["PageBlock"]  #: paragraphs, tables, pictures and subsections, from top to bottom.


PageBlock: TypeAlias = (
    str | Missing | Notice | CaptionedPicture | Tiles | ReportTable | TurnedSurface | PageSection
)
"""A paragraph of text, or one of the classes above."""


@dataclass(frozen=True)
class RunReport:
    """An experiment's part of a run's report."""

    sentence: str  #: the answer in words.
    values: Sequence[AnswerValue]  #: the answer in numbers.
    sections: Sequence[PageSection] = ()  #: readings and estimates in pictures.
    seconds: Mapping[str, float] = field(default_factory=dict)  #: duration of the answer in s, by stage.
