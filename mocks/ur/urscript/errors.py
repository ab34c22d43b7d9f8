"""What stops a program."""

from typing import Final

PROGRAM: Final = "<URScript>"
"""The file name of a translated program, in tracebacks."""


class ScriptError(Exception):
    """A program that cannot be read or cannot go on; it stops, as on the pendant.

    Args:
        message: in words.
        line: of the text, counted from 1; 0 where it is not known.
    """

    def __init__(self, message: str, line: int = 0) -> None:
        super().__init__(f"line {line}: {message}" if line else message)
