"""What a row of the tables is measured by: the queries of one sense, and one way to render them."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Literal, Protocol

import numpy as np

from harness.authoring.training import Report
from harness.basics.arrays import AnyArray
from harness.basics.store import Store
from harness.picture.image_metrics import mean_square, ssim

Sense = Literal["vision", "audio", "touch"]
SENSES: tuple[Sense, ...] = ("vision", "audio", "touch")

Column = Literal["1.0 here", "2.0 here", "ours, smallest", "ours", "ours, largest", "other"]
COLUMNS: tuple[Column, ...] = ("1.0 here", "2.0 here", "ours, smallest", "ours", "ours, largest")
"""Rows of tables 1 and 2 that are measured; ``"other"`` stands in a sense's own table alone."""

Render = Callable[[int], AnyArray]
"""From a query's number to what is rendered for it: a sound, or a picture of 8 bits."""

ROUNDING = 1.0 / 12.0
"""Squared grey levels: pictures of whole greys are known no better, so that no PSNR is above 58.9 dB."""

PEAK = 255.0


class RenderingBench(Protocol):
    """The queries of one sense with their reference."""

    @property
    def sense(self) -> Sense:
        """Of the queries."""

    @property
    def identity(self) -> str:
        """A digest of the object, the queries and the reference."""

    @property
    def count(self) -> int:
        """Queries."""

    def scores(self, number: int, rendered: AnyArray) -> Mapping[str, float]:
        """The paper's metrics of what was rendered for one query."""


@dataclass(frozen=True, eq=False)
class MadeMethod:
    """A method ready to render.

    Attributes:
        render: renders one query.
        seconds: CPU s of fitting or training; 0 where nothing was made here.
    """

    render: Render
    seconds: float = 0.0


@dataclass(frozen=True, eq=False)
class RenderingMethod:
    """One way from a query to an observation.

    Attributes:
        name: of its row.
        column: the row of tables 1 and 2 that it fills.
        identity: of all that it depends on beside the bench; a digest takes it.
        make: fits, trains or opens it; raises ``TorchMissing`` where it cannot be trained.
        note: what a reader has to know of it.
    """

    name: str
    column: Column
    identity: tuple[object, ...]
    make: Callable[[], MadeMethod]
    note: str = ""


@dataclass(frozen=True)
class RenderingWork:
    """Where results lie and who is informed.

    Attributes:
        store: of reference solutions, networks and measured cells.
        report: takes what is being done and the share of it that is done.
    """

    store: Store
    report: Report


def picture_scores(rendered: AnyArray, reference: AnyArray) -> dict[str, float]:
    """PSNR in dB and SSIM of two ``(rows, columns, 3)`` pictures of 8 bits, over whole pictures."""
    error = max(mean_square(rendered, reference), ROUNDING)
    return {"psnr_db": float(10.0 * np.log10(PEAK**2 / error)), "ssim": ssim(rendered, reference)}
