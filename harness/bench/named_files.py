"""Stations, scenes and ObjectFiles by name: those that come with the program, and those here."""

from pathlib import Path

from harness.basics.errors import WrongUse
from harness.basics.toml_file import nearest

_CHECKOUT = Path(__file__).parents[2]


def named_file(name: str, kind: str) -> Path:
    """A TOML file by its path, or by its name in ``stations/`` or ``scenes/``, here or in the checkout.

    Args:
        name: a text with a slash or an ending is a path.
        kind: ``station`` or ``scene``.

    Raises:
        WrongUse: there is none.
    """
    known = _known(f"{kind}s")
    if name.endswith(".toml") or "/" in name:
        if not Path(name).is_file():
            raise WrongUse(f"no {kind} file {name!r}; give a path or a shipped name: {nearest(name, known)}")
        return Path(name).resolve()
    if name not in known:
        raise WrongUse(f"no {kind} {name!r}; {nearest(name, known)}; or give the path of a {kind} file")
    return known[name]


def _known(folder: str) -> dict[str, Path]:
    return {path.stem: path.resolve() for path in shipped_or_here(folder, "*.toml")}


def shipped_or_here(folder: str, pattern: str) -> list[Path]:
    """What matches in a folder of the checkout and then in that of the working directory, each in order."""
    places = (_CHECKOUT / folder, Path.cwd() / folder)
    return [path for place in places for path in sorted(place.glob(pattern))]
