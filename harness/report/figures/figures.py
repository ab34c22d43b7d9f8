"""Every picture of a report, drawn, written beside the page and kept for inlining."""

import base64
from io import BytesIO
from pathlib import Path
from typing import Literal

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.image import imsave

from harness.basics.arrays import AnyArray
from harness.basics.whole_file import write_bytes_whole
from harness.experiment.report_content import Picture
from harness.report.figures.style import styled


class Album:
    """Writes PNG files into a folder and hands back their inlined form.

    Args:
        folder: exists.
    """

    def __init__(self, folder: Path) -> None:
        self._folder = folder

    def photograph(self, name: str, figure: Figure) -> Picture:
        """A picture without sharp lines: JPEG in the page, PNG beside it."""
        canvas = FigureCanvasAgg(figure)
        with styled():
            canvas.draw()  # type: ignore[no-untyped-call]
        drawn = np.asarray(canvas.buffer_rgba())[..., :3]  # type: ignore[no-untyped-call]
        return Picture(
            _address("image/jpeg", _encoded(drawn, "jpeg")), self._beside(name, _encoded(drawn, "png"))
        )

    def drawing(self, name: str, figure: Figure) -> Picture:
        """A chart: vector graphics in the page, PNG beside it."""
        file = self._beside(name, _saved(figure, "png"))
        return Picture(_address("image/svg+xml", _saved(figure, "svg")), file)

    def pixels(self, name: str, png: bytes) -> Picture:
        """A small picture shown pixel for pixel."""
        return Picture(_address("image/png", png), self._beside(name, png))

    def _beside(self, name: str, content: bytes) -> str:
        file = f"{name}.png"
        write_bytes_whole(self._folder / file, content)
        return file


def _encoded(drawn: AnyArray, kind: str) -> bytes:
    file = BytesIO()
    imsave(file, drawn, format=kind, pil_kwargs={"quality": 88} if kind == "jpeg" else {"compress_level": 6})
    return file.getvalue()


def _saved(figure: Figure, kind: Literal["png", "svg"]) -> bytes:
    file = BytesIO()
    # No dates: the same data gives the same bytes.
    metadata = {"Date": None} if kind == "svg" else {"Software": None}
    with styled():
        figure.savefig(file, format=kind, metadata=metadata)
    return file.getvalue()


def _address(kind: str, content: bytes) -> str:
    return f"data:{kind};base64,{base64.b64encode(content).decode('ascii')}"
