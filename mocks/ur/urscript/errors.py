"""What stops a program."""


class ScriptError(Exception):
    """A program that cannot be read or cannot go on; it stops, as on the pendant.

    Attributes:
        line: of the text, counted from 1; 0 where it is not known.
    """

    def __init__(self, message: str, line: int = 0) -> None:
        super().__init__(f"line {line}: {message}" if line else message)
        self.line = line
