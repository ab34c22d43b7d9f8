"""Stations, scenes, ObjectFiles and runs by name: those that come with the program, and those here."""

import difflib
from pathlib import Path

from harness.basics.errors import WrongUse
from harness.basics.files.named_file import nearest

_CHECKOUT = Path(__file__).parents[2]


def named_file(name: str, kind: str) -> Path:
    """A TOML file by its path, or by its name in ``stations/`` or ``scenes/``, here or in the checkout.

    Args:
        name: a text with a slash or an ending is a path.
        kind: ``station`` or ``scene``.

    Raises:
        WrongUse: there is none.
    """
    known = {path.stem: path.resolve() for path in shipped_or_here(f"{kind}s", "*.toml")}
    if name.endswith(".toml") or "/" in name:
        if not Path(name).is_file():
            raise WrongUse(
                f"there is no {kind} file {name!r}; give a path or a shipped name: {nearest(name, known)}"
            )
        return Path(name).resolve()
    if name not in known:
        raise WrongUse(
            f"there is no {kind} {name!r}; {nearest(name, known)}; or give the path of a {kind} file"
        )
    return known[name]


def shipped_or_here(folder: str, pattern: str) -> list[Path]:
    """What matches in a folder of the checkout and then in that of the working directory, each in order."""
    places = (_CHECKOUT / folder, Path.cwd() / folder)
    return [path for place in places for path in sorted(place.glob(pattern))]


HEADER = "run.json"
"""The file that makes a folder a run."""


def require_run(folder: Path) -> None:
    """Refuse a folder that is not a run; ``WrongUse`` lists the runs next to it with a similar name."""
    if (folder / HEADER).exists():
        return
    if folder.exists():
        raise WrongUse(f"{folder} is not a run: it has no {HEADER}; give the folder that a run wrote")
    runs = [path.parent.name for path in folder.parent.glob(f"*/{HEADER}")]
    similar = difflib.get_close_matches(folder.name, runs, n=1)
    suggested = f"did you mean {str(folder.with_name(similar[0]))!r}? or " if similar else ""
    advice = f"{suggested}give the folder that a run wrote"
    raise WrongUse(f"there is no run {folder}: no folder with {HEADER} in it; {advice}")
