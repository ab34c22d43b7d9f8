"""Names and files that an operator gives: refuse the missing ones, and suggest the nearest known name."""

import difflib
import os
from collections.abc import Iterable, Iterator
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


def nearest(name: str, known: Iterable[str]) -> str:
    """Suggest the known name most similar to a mistyped one, and list all known names.

    Returns:
        ``"did you mean 'x'? (there are x, y, z)"``, or the list alone where no name is similar.
    """
    names = sorted(known)
    similar = difflib.get_close_matches(name.lower(), [n.lower() for n in names], n=1, cutoff=_SIMILAR)
    match = next((n for n in names if similar and n.lower() == similar[0]), None)
    listed = f"there {'is' if len(names) == 1 else 'are'} {', '.join(names) or 'none'}"
    return f"did you mean {match!r}? ({listed})" if match else listed


_SIMILAR = 0.6
"""Lowest ``difflib`` similarity of a suggestion; at 0.5 ``nosuch`` suggests ``wrench_touch``."""


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
