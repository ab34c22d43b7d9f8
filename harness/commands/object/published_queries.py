"""Query files answered by an imported object: sounds, maps and pictures, named as ObjectFolder does."""

import time
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from harness.basics.errors import WrongUse

if TYPE_CHECKING:
    from harness.basics.arrays import FloatArray
    from harness.objectfile.published.folder import PublishedObject

AUDIO, TOUCH, VISION = "audio", "touch", "vision"


@dataclass(frozen=True)
class QueryFiles:
    """The query files that were given, and how they are answered.

    Attributes:
        vision: cameras and lights.
        audio_vertices: in metres.
        audio_forces: a row for each vertex.
        touch_vertices: in metres.
        touch_gelinfo: tilt, azimuth and depth, a row for each vertex; None for 1.0, which has none.
        calibration: folder of the gel's colours; None for maps alone.
        size: pixels a side of pictures.
        seconds: of sounds.
        rate: samples per second.
        compat: whether everything is as the published programs do it.
    """

    vision: Path | None
    audio_vertices: Path | None
    audio_forces: Path | None
    touch_vertices: Path | None
    touch_gelinfo: Path | None
    calibration: Path | None
    size: int
    seconds: float
    rate: float
    compat: bool


@dataclass(eq=False)
class AnsweredQueries:
    """What was written.

    Attributes:
        files: by sense, in the order of the queries.
        full_scale: of the sounds, in the sound's unit; None for each its own.
        notes: what the operator should know.
        seconds: on the clock, by sense.
    """

    files: dict[str, list[Path]] = field(default_factory=dict)
    full_scale: float | None = None
    notes: list[str] = field(default_factory=list)
    seconds: dict[str, float] = field(default_factory=dict)


def answer_queries(of: "PublishedObject", given: QueryFiles, out: Path) -> AnsweredQueries:
    """Answer every file that was given; all are read and checked before anything is computed.

    Raises:
        WrongUse: nothing was given, half of a pair, or a sense that the object has not.
        DataRefused: a file that is no such query.
        OutOfDomain: a query that a network was not trained at.
    """
    from harness.commands.object.published_sounds import sounds_of
    from harness.commands.object.published_touches import touches_of
    from harness.commands.object.published_views import views_written

    _require_pairs(of, given)
    sounds, touches = _sound_rows(given), _touch_rows(given)
    views = _view_rows(given)
    found = AnsweredQueries()
    for name, rows, write in (
        (AUDIO, sounds, sounds_of), (TOUCH, touches, touches_of), (VISION, views, views_written)
    ):  # fmt: skip
        if rows is not None:
            begun, place = time.perf_counter(), out / name
            place.mkdir(parents=True, exist_ok=True)
            write(of, rows, given, place, found)
            found.seconds[name] = time.perf_counter() - begun
    return found


def _require_pairs(of: "PublishedObject", given: QueryFiles) -> None:
    """What belongs together is there together, and the object has the sense."""
    described = of.description
    second = described.format == "ObjectFolder 2.0"
    if given.vision is None and given.audio_vertices is None and given.touch_vertices is None:
        raise WrongUse(
            "no query file was given; give --vision, --audio-vertices and --audio-forces, or --touch-vertices"
        )
    if (given.audio_vertices is None) != (given.audio_forces is None):
        raise WrongUse("--audio-vertices and --audio-forces go together: a force for each vertex")
    if given.touch_gelinfo is not None and given.touch_vertices is None:
        raise WrongUse("--touch-gelinfo needs --touch-vertices: a press for each vertex")
    if given.touch_vertices is not None and second != (given.touch_gelinfo is not None):
        raise WrongUse(
            "an object of ObjectFolder 2.0 is touched with --touch-gelinfo, tilt, azimuth and depth of each "
            "press"
            if second
            else "an object of ObjectFolder 1.0 knows one press along the normal; leave --touch-gelinfo out"
        )
    wanted = {AUDIO: given.audio_vertices, TOUCH: given.touch_vertices, VISION: given.vision}
    for sense, path in wanted.items():
        if path is not None and sense not in described.networks:
            raise WrongUse(
                f"{of.folder} has no network of {sense}; its file had none, leave those queries out"
            )


def _sound_rows(given: QueryFiles) -> "tuple[FloatArray, ...] | None":
    from harness.objectfile.published.queries import read_rows, require_pairs

    if given.audio_vertices is None or given.audio_forces is None:
        return None
    vertices = read_rows(given.audio_vertices, 3, "vertices x y z, m")
    forces = read_rows(given.audio_forces, 3, "forces x y z")
    require_pairs(vertices, forces, f"{given.audio_vertices.name} and {given.audio_forces.name}")
    return vertices, forces


def _touch_rows(given: QueryFiles) -> "tuple[FloatArray, ...] | None":
    from harness.objectfile.published.queries import read_rows, require_pairs

    if given.touch_vertices is None:
        return None
    vertices = read_rows(given.touch_vertices, 3, "vertices x y z, m")
    if given.touch_gelinfo is None:
        return (vertices,)
    gel = read_rows(given.touch_gelinfo, 3, "tilt and azimuth, rad, and depth, m")
    require_pairs(vertices, gel, f"{given.touch_vertices.name} and {given.touch_gelinfo.name}")
    return vertices, gel


def _view_rows(given: QueryFiles) -> "tuple[FloatArray, ...] | None":
    from harness.objectfile.published.queries import read_rows

    return None if given.vision is None else (read_rows(given.vision, 6, "camera x y z and light x y z"),)


def as_json(of: "PublishedObject", given: QueryFiles, found: AnsweredQueries) -> dict[str, Any]:
    """As scripts read it."""
    return {
        "schema": 1,
        "folder": str(of.folder),
        "object": of.description.name,
        "format": of.description.format,
        "objectfolder_compat": given.compat,
        "files": {sense: [str(path) for path in paths] for sense, paths in found.files.items()},
        "full_scale": found.full_scale,
        "notes": found.notes,
        "seconds": found.seconds,
    }
