"""A file that an operator names: there, or wrong use."""

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from harness.basics.errors import DataRefused, WrongUse


def require_file(path: Path, what: str, advice: str = "check the path") -> None:
    """Refuse a path at which there is no file.

    Args:
        path: that was named.
        what: is expected there, as "mesh file".
        advice: what to do next.

    Raises:
        WrongUse: there is none.
    """
    if not path.is_file():
        raise WrongUse(f"there is no {what} {path}; {advice}")


def real_path(path: Path) -> Path:
    """Absolute, through every link; one that leads to itself stays, and whoever opens it is refused."""
    return Path(os.path.realpath(path))


@contextmanager
def refusals_name(*paths: Path) -> Iterator[None]:
    """Whoever reads what files hold does not know the files: where a refusal names none, they precede it.

    Args:
        paths: that were read; the first and their number stand for more than two.
    """
    try:
        yield
    except DataRefused as error:
        if any(str(path) in str(error) for path in paths):
            raise
        named = ", ".join(map(str, paths)) if len(paths) <= 2 else f"{paths[0]} and {len(paths) - 1} more"
        raise type(error)(f"{named}: {error}") from error
