"""Keep control characters of file content away from the terminal: they move its cursor and forge lines."""

import re
from collections.abc import Iterable
from typing import Any

from rich.console import Console, ConsoleOptions, RenderableType
from rich.segment import Segment

_CONTROLS = re.compile(
    r"[\x00-\x08\x0b-\x1f\x7f-\x9f\u061c\u200e\u200f\u2028-\u202e\u2066-\u2069\ufeff\ud800-\udfff]"
)
"""Characters that a terminal obeys or cannot show: C0 and C1 controls, directions of writing, line separators
and halves of pairs; not the tab and the line feed."""

_LIST = re.compile(r"\n(?!  - )")
"""A line feed that does not begin an item of a list of mistakes."""


def escape_controls(text: str) -> str:
    r"""Replace the control characters in a text by their escapes, e.g. ``\x1b``; tabs and line feeds stay."""
    return _CONTROLS.sub(lambda found: ascii(found[0])[1:-1], text)


def escape_message(message: str) -> str:
    """Replace control characters and line feeds, which only lists of mistakes have, by their escapes."""
    return escape_controls(_LIST.sub(r"\\n", message))


class SafeConsole(Console):
    """A console that prints the control characters of texts as their escapes, and its own ones as they are.

    Args:
        options: as for ``rich.console.Console``.
    """

    def __init__(self, **options: Any) -> None:
        # Without emoji=False, ":wrench:" in "builtin:wrench: steel" becomes a picture of a wrench.
        super().__init__(highlight=False, soft_wrap=True, emoji=False, **options)

    def render(self, renderable: RenderableType, options: ConsoleOptions | None = None) -> Iterable[Segment]:
        """Render as the base class does, with the texts escaped."""
        for segment in super().render(renderable, options):
            if segment.control or not _CONTROLS.search(segment.text):
                yield segment
            else:
                yield Segment(escape_controls(segment.text), segment.style)
