"""Numbers of text mesh formats, and the one sentence in which a word that is none is refused."""

import re

from harness.basics.errors import MeshRefused

MAX_ELEMENTS = 4_000_000
"""Vertices or faces of one text file: more do not fit into the memory of later stages."""

MAX_LINE = 2**20
"""Bytes of one line: a polygon of 100,000 corners has fewer."""

_MAX_SHOWN = 40
_SEPARATOR = re.compile(rb";|\xc2\xa0")
_SEPARATOR_NAMES = {b";": "semicolons", b",": "commas", b"\xc2\xa0": "no-break spaces"}
_DECIMAL_COMMA = re.compile(rb"[+-]?\d*,\d+(?:[eE][+-]?\d+)?,?")


def refuse_number(words: list[bytes], name: str, line: int, wanted: str) -> MeshRefused:
    """Describe a line whose words are not the numbers that its format wants.

    Args:
        words: words that should be numbers.
        name: name of the file.
        line: its number, from 1.
        wanted: the numbers that belong there, e.g. "3 coordinates".
    """
    text = show(b" ".join(words[:8]))
    if any(_DECIMAL_COMMA.fullmatch(word) for word in words):
        return MeshRefused(f"{name}, line {line}: {text!r} has decimal commas; export it with decimal points")
    if (found := _SEPARATOR.search(b" ".join(words))) is not None:
        return refuse_separator(found[0], name, line)
    return MeshRefused(
        f"{name}, line {line}: expected {wanted}, found {text!r}; the file is cut short or damaged, "
        "export it again"
    )


def refuse_separator(separator: bytes, name: str, line: int) -> MeshRefused:
    """Describe a line whose words are not separated by spaces.

    Args:
        separator: what is between its words.
        name: name of the file.
        line: its number, from 1.
    """
    shown = _SEPARATOR_NAMES.get(separator, show(separator))
    return MeshRefused(f"{name}, line {line}: words are separated by {shown}; export it with spaces")


def show(text: bytes) -> str:
    """Convert bytes of a file to a short string for a message."""
    shown = text.decode("utf-8", "replace")
    return shown if len(shown) <= _MAX_SHOWN else f"{shown[:_MAX_SHOWN]}..."


def require_few(count: int, what: str, name: str) -> None:
    """Refuse more vertices or faces than later stages have memory for.

    Raises:
        MeshRefused: more than ``MAX_ELEMENTS``.
    """
    if count > MAX_ELEMENTS:
        raise MeshRefused(
            f"{name} has more than {MAX_ELEMENTS:,} {what}; reduce its resolution and export it again"
        )
