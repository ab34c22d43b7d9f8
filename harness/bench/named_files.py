"""Stations, scenes, ObjectFiles and runs by name: those that come with the program, and a project's own."""

import difflib
from pathlib import Path

from harness.basics.errors import WrongUse
from harness.basics.files.named_file import nearest

SHIPPED = Path(__file__).parents[1] / "shipped"
"""The folders ``stations``, ``scenes`` and ``objects`` that come with the program."""


def named_file(name: str, kind: str) -> Path:
    """Find a TOML file by its path, or by its name in ``stations/`` or ``scenes/``, here or shipped.

    The path of a shipped file, e.g. ``scenes/mug_touch.toml``, is found from any folder.

    Args:
        name: a text with a slash or an ending is a path.
        kind: ``station`` or ``scene``.

    Raises:
        WrongUse: there is none.
    """
    path, is_path = Path(name), name.endswith(".toml") or "/" in name
    if is_path and path.is_file():
        return path.resolve()
    known = known_files(f"{kind}s", "*.toml")
    wanted = name_in(path, f"{kind}s") if is_path else f"{name}.toml"
    if wanted in known:
        return known[wanted]
    listed = nearest(path.stem, [file.removesuffix(".toml") for file in known])
    raise WrongUse(
        f"there is no {kind} file {name!r}; give a path or a known name: {listed}"
        if is_path
        else f"there is no {kind} {name!r}; {listed}; or give the path of a {kind} file"
    )


def known_files(folder: str, pattern: str) -> dict[str, Path]:
    """Return what matches in a shipped folder and in that of the working directory, which comes first.

    Args:
        folder: ``stations``, ``scenes`` or ``objects``.
        pattern: of names in it.

    Returns:
        Absolute paths by file name.
    """
    places = (SHIPPED / folder, Path.cwd() / folder)
    return {path.name: path.resolve() for place in places for path in sorted(place.glob(pattern))}


def name_in(path: Path, folder: str) -> str:
    """Return the file name of a relative path into a folder of known files; empty for any other path."""
    return path.name if path.parent == Path(folder) else ""


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
