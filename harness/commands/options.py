"""Options that several commands take, each described once, and how one with a unit is read."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, overload

import typer

if TYPE_CHECKING:
    from harness.basics.quantities import Dimension

Station = Annotated[
    str, typer.Option("--station", help="A bench: a name under stations/, or a station file.", metavar="NAME")
]
StationOrOwn = Annotated[
    str | None,
    typer.Option(
        "--station",
        help="A bench: a name under stations/, or a station file; mock if left out.",
        metavar="NAME",
    ),
]
SceneOption = Annotated[
    Path | None,
    typer.Option("--scene", help="A name under scenes/, as mug_touch, or a scene file.", metavar="NAME"),
]
Object = Annotated[
    str | None,
    typer.Option(
        "--object",
        help="A mesh file, builtin:mug and so on, or an ObjectFile: its folder, or the name of one that "
        "comes with the program, as mug.",
        metavar="FILE",
    ),
]
Material = Annotated[
    str | None, typer.Option("--material", help="What the object is made of (with --object).", metavar="M")
]
Units = Annotated[
    str | None,
    typer.Option(
        "--units", help="Of the mesh file's numbers: m, cm, mm, um, in or ft (with --object).", metavar="U"
    ),
]
Wall = Annotated[
    str | None,
    typer.Option("--wall", help="Wall of a hollow thing scanned as a solid, as 2mm.", metavar="LENGTH"),
]
ObjectFileOption = Annotated[
    str | None,
    typer.Option("--objectfile", help="Folder of the object's ObjectFile (with --object).", metavar="FOLDER"),
]
Seed = Annotated[
    int | None,
    typer.Option("--seed", help="Of everything random; the scene's own where none is given.", min=0),
]
GapOption = Annotated[
    str | None,
    typer.Option(
        "--gap",
        help="Reality gap of a mocked bench: a shipped one, as default or none, or a gap file.",
        metavar="NAME",
    ),
]
UpTo = Annotated[str, typer.Option("--up-to", help="Modes up to this frequency.", metavar="F")]
MostModes = Annotated[int, typer.Option("--modes", help="Modes at most, the lowest.", min=1, max=4096)]
LongestEdge = Annotated[
    str | None,
    typer.Option("--edge", help="Longest edge of an element, as 3mm; by the wave if left out.", metavar="L"),
]
LevelOption = Annotated[
    list[str] | None,
    typer.Option(
        "--level", help="Turn one dial, as localization.rounds=1; may be given again.", metavar="D=L"
    ),
]
Budget = Annotated[
    str | None,
    typer.Option(
        "--budget",
        help="Seconds for the estimate, as 2s or 50ms, from readings to answer: the best levels that "
        "keep it. Motion, the object's own preparation and the report are not counted.",
        metavar="TIME",
    ),
]
ErrorWanted = Annotated[
    str | None,
    typer.Option(
        "--error",
        help="How far off the answer may be in 19 of 20 runs, as 5mm: the cheapest levels that promise it.",
        metavar="LENGTH",
    ),
]
Json = Annotated[
    bool, typer.Option("--json", help="One JSON object on standard output; the rest on standard error.")
]


@overload
def quantity(option: str, text: str, kind: "Dimension") -> float: ...


@overload
def quantity(option: str, text: str | None, kind: "Dimension") -> float | None: ...


def quantity(option: str, text: str | None, kind: "Dimension") -> float | None:
    """The SI value of an option written with its unit; None where it was left out.

    Raises:
        WrongUse: naming the option, where the text is no such quantity.
    """
    from harness.basics.errors import WrongUse

    if text is None:
        return None
    try:
        return kind.parse(text)
    except ValueError as refused:
        raise WrongUse(f"{option}: {refused}") from None


def positive(option: str, text: str | None, kind: "Dimension") -> float | None:
    """As ``quantity``, of what has to be above zero; ``WrongUse`` where it is not."""
    from harness.basics.errors import WrongUse

    value = quantity(option, text, kind)
    if value is not None and value <= 0.0:
        raise WrongUse(f"{option} {text}: it must be above zero")
    return value


def require_files(*files: tuple[str, Path | None, str]) -> None:
    """Refuse names of files that say another kind, or one name for two of them.

    Args:
        files: option, its path or None, and how the name must end.

    Raises:
        WrongUse: naming the option.
    """
    from harness.basics.errors import WrongUse

    named: dict[Path, str] = {}
    for option, path, suffix in files:
        if path is None:
            continue
        if path.suffix != suffix:
            raise WrongUse(f"{option} {path} would be a {suffix} file; let its name end in {suffix}")
        if path in named:
            raise WrongUse(f"{named[path]} and {option} are both {path}; give them two names")
        named[path] = option
