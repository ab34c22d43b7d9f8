"""Options that several commands take, each described once, and how one with a unit is read.

Names and paths are checked as the command line is read, before a command imports what it computes with: a
mistyped name is refused at once.
"""

from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, overload

import typer

from harness.basics.errors import WrongUse
from harness.bench import scene_objectfile
from harness.bench.experiments import require_experiment
from harness.bench.named_files import named_file, require_run
from harness.bench.scene_objectfile import (
    require_object,
)

if TYPE_CHECKING:
    from harness.basics.quantities import Dimension


def check_station(name: str | None) -> str | None:
    """Refuse a station that does not exist."""
    if name is not None:
        named_file(name, "station")
    return name


def check_scene(path: Path | None) -> Path | None:
    """Refuse a scene that does not exist."""
    if path is not None:
        named_file(str(path), "scene")
    return path


def _named(parameter: typer.CallbackParam) -> str:
    """Return the name of an option, or the metavar of an argument, for messages."""
    option = parameter.opts[0]
    return option if option.startswith("-") else str(parameter.metavar)


def check_object(parameter: typer.CallbackParam, name: str | None) -> str | None:
    """Refuse an object that is neither a file, a built-in object nor an ObjectFile."""
    if name is not None:
        require_object(name, Path.cwd(), _named(parameter))
    return name


def check_objectfile(name: str | None) -> str | None:
    """Refuse an ``--objectfile`` that does not exist."""
    if name is not None:
        scene_objectfile.find_objectfile(name, "--objectfile")
    return name


def check_mesh(name: str | None) -> str | None:
    """Refuse a MESH that is neither a file nor a built-in object."""
    if name is not None:
        require_object(name, Path.cwd(), "MESH", objectfiles=False)
    return name


def check_experiment(name: str | None) -> str | None:
    """Refuse an experiment that does not exist."""
    if name is not None:
        require_experiment(name)
    return name


def check_run(folder: Path | None) -> Path | None:
    """Refuse a folder that is not a run."""
    if folder is not None:
        require_run(folder)
    return folder


def find_objectfile(parameter: typer.CallbackParam, folder: Path | None) -> Path | None:
    """Return the folder of an ObjectFile that is named by its path, or by its name in ``objects/``.

    Raises:
        WrongUse: there is none.
    """
    return None if folder is None else scene_objectfile.find_objectfile(folder, _named(parameter))


Station = Annotated[
    str,
    typer.Option(
        "--station",
        help="A bench: a name under stations/, or a station file.",
        metavar="NAME",
        callback=check_station,
    ),
]
StationOrOwn = Annotated[
    str | None,
    typer.Option(
        "--station",
        help="A bench: a name under stations/, or a station file; mock if left out.",
        metavar="NAME",
        callback=check_station,
    ),
]
SceneOption = Annotated[
    Path | None,
    typer.Option(
        "--scene",
        help="A name under scenes/, e.g. mug_touch, or a scene file.",
        metavar="NAME",
        callback=check_scene,
    ),
]
Object = Annotated[
    str | None,
    typer.Option(
        "--object",
        help="A mesh file, builtin:mug and so on, or an ObjectFile: its folder, or the name of one that "
        "comes with the program, e.g. mug.",
        metavar="FILE",
        callback=check_object,
    ),
]
Material = Annotated[
    str | None, typer.Option("--material", help="What the object is made of (with --object).", metavar="M")
]
Units = Annotated[
    str | None,
    typer.Option("--units", help="Unit of the mesh coordinates: m, cm, mm, um, in or ft.", metavar="U"),
]
UpAxis = Annotated[
    str | None,
    typer.Option(
        "--up-axis",
        help="Axis of the mesh file that points up: x, y or z; the file is rotated until that is z. By the "
        "file if left out (glTF: y; COLLADA: its up_axis), else z.",
        metavar="AXIS",
    ),
]
Wall = Annotated[
    str | None,
    typer.Option("--wall", help="Wall of a hollow object scanned as a solid, e.g. 2mm.", metavar="L"),
]
ObjectFileOption = Annotated[
    str | None,
    typer.Option(
        "--objectfile",
        help="The object's ObjectFile (with --object): its folder, or the name of one that comes with the "
        "program.",
        metavar="FOLDER",
        callback=check_objectfile,
    ),
]
MeshArgument = Annotated[
    str,
    typer.Argument(help="A mesh file, or builtin:mug and so on.", metavar="MESH", callback=check_mesh),
]
ObjectFolder = Annotated[
    Path,
    typer.Argument(
        help="An ObjectFile: its folder, or the name of one that comes with the program, e.g. mug.",
        metavar="OBJECT",
        callback=find_objectfile,
    ),
]
RunFolder = Annotated[
    Path,
    typer.Argument(help="A run folder, e.g. runs/20260101-120000-...", metavar="RUN", callback=check_run),
]


class BenchKind(StrEnum):
    """Kind of a mocked bench."""

    WIRES = "wires"
    IN_PROCESS = "in-process"


BenchOption = Annotated[
    BenchKind | None,
    typer.Option(
        "--bench",
        help="How a mocked station runs. in-process: the same world without cables, in simulated time; "
        "wires: each instrument at the far end of its cable, in real time. in-process if left out.",
    ),
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
WhereOption = Annotated[
    list[str] | None,
    typer.Option(
        help="Only this level of a condition, as spacing=close; may be given again.", metavar="NAME=LEVEL"
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
    if text is None:
        return None
    try:
        return kind.parse(text)
    except ValueError as refused:
        raise WrongUse(f"{option}: {refused}") from None


@overload
def positive(option: str, text: str, kind: "Dimension") -> float: ...


@overload
def positive(option: str, text: str | None, kind: "Dimension") -> float | None: ...


def positive(option: str, text: str | None, kind: "Dimension") -> float | None:
    """As ``quantity``, of what has to be above zero; ``WrongUse`` where it is not."""
    value = quantity(option, text, kind)
    if value is not None and value <= 0.0:
        raise WrongUse(f"{option} {text}: it must be above zero")
    return value


def require_files(*files: tuple[str, Path | None, str]) -> None:
    """Refuse output files that cannot be written, before anything is computed.

    Args:
        files: option, its path or None, and the required ending of the name, "" for any.

    Raises:
        WrongUse: a name with another ending, one name for two files, or a folder that does not exist.
    """
    named: dict[Path, str] = {}
    for option, path, suffix in files:
        if path is None:
            continue
        if suffix and path.suffix != suffix:
            raise WrongUse(f"{option} {path} would be a {suffix} file; let its name end in {suffix}")
        if path in named:
            raise WrongUse(f"{named[path]} and {option} are both {path}; give them two names")
        if path.is_dir():
            raise WrongUse(f"{option} {path} is a folder; give the name of a file")
        if not path.parent.is_dir():
            raise WrongUse(
                f"{option} {path}: there is no folder {path.parent}; make it with "
                f"`mkdir -p {path.parent}`, or name a file in another folder"
            )
        named[path] = option


def require_folders(*folders: tuple[str, Path | None]) -> None:
    """Refuse output folders that cannot be made, before anything is computed.

    Args:
        folders: option, and its path or None; missing folders above it are made with it.

    Raises:
        WrongUse: a file is in the way.
    """
    for option, folder in folders:
        if folder is None:
            continue
        for path in (folder, *folder.parents):
            if path.exists():
                if not path.is_dir():
                    raise WrongUse(f"{option} {folder}: {path} is a file; name a folder")
                break
