"""A file that an operator names: there, or wrong use."""

import os
from pathlib import Path

from harness.basics.errors import WrongUse


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
