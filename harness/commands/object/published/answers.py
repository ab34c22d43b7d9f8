"""Query files answered by an imported object: sounds, maps and pictures, named as ObjectFolder does."""

import time
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from harness.basics.errors import WrongUse
from harness.commands.object.published.built import (
    built_sounds,
    built_touches,
    built_views,
    require_built,
)
from harness.commands.object.published.files import AUDIO, TOUCH, VISION, AnsweredQueries, QueryFiles
from harness.commands.object.published.imported import sounds_written, touches_written, views_written

if TYPE_CHECKING:
    from harness.basics.arrays import FloatArray
    from harness.objectfile.file import ObjectFile
    from harness.objectfile.published.folder import PublishedObject

    Rows = tuple[FloatArray, ...]
    Writer = tuple[str, Rows | None, Callable[[Rows, QueryFiles, Path, AnsweredQueries], None]]


def answer_queries(of: "PublishedObject", given: QueryFiles, out: Path) -> AnsweredQueries:
    """Answer every file that was given; all are read and checked before anything is computed.

    Raises:
        WrongUse: nothing was given, half of a pair, or a sense that the object has not.
        DataRefused: a file that is no such query.
        OutOfDomain: a query that a network was not trained at.
    """
    require_files(given)
    _require_senses(of, given)
    sounds, touches = _sound_rows(given), _touch_rows(given)
    views = _view_rows(given)
    writers: list[Writer] = [
        (AUDIO, sounds, partial(sounds_written, of)),
        (TOUCH, touches, partial(touches_written, of)),
        (VISION, views, partial(views_written, of)),
    ]
    return _written(writers, given, out)


def answer_built(of: "ObjectFile", given: QueryFiles, out: Path) -> AnsweredQueries:
    """The same by an object that was built from its mesh; errors as ``answer_queries``."""
    require_files(given)
    require_built(given)
    writers: list[Writer] = [
        (AUDIO, _sound_rows(given), partial(built_sounds, of)),
        (TOUCH, _touch_rows(given), partial(built_touches, of)),
        (VISION, _view_rows(given), partial(built_views, of)),
    ]
    return _written(writers, given, out)


def _written(writers: "list[Writer]", given: QueryFiles, out: Path) -> AnsweredQueries:
    found = AnsweredQueries()
    for name, rows, write in writers:
        if rows is not None:
            begun, place = time.perf_counter(), out / name
            place.mkdir(parents=True, exist_ok=True)
            write(rows, given, place, found)
            found.seconds[name] = time.perf_counter() - begun
    return found


def require_files(given: QueryFiles) -> None:
    """Refuse half of a pair of files, or none at all, with ``WrongUse``."""
    if (given.audio_vertices is None) != (given.audio_forces is None):
        raise WrongUse("--audio-vertices and --audio-forces go together: a force for each vertex")
    if given.touch_gelinfo is not None and given.touch_vertices is None:
        raise WrongUse("--touch-gelinfo needs --touch-vertices: a press for each vertex")
    if given.vision is None and given.audio_vertices is None and given.touch_vertices is None:
        raise WrongUse(
            "no query file was given; give --vision, --audio-vertices and --audio-forces, or --touch-vertices"
        )


def _require_senses(of: "PublishedObject", given: QueryFiles) -> None:
    """What was given is what the object's version takes, and the object has the sense."""
    if given.metres_per_unit is not None:
        raise WrongUse(
            "--metres-per-unit is for objects built from a mesh; an imported one has no known size"
        )
    described = of.description
    second = described.format == "ObjectFolder 2.0"
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
    from harness.objectfile.published.query import read_rows, require_pairs

    if given.audio_vertices is None or given.audio_forces is None:
        return None
    vertices = read_rows(given.audio_vertices, 3, "vertices x y z, m")
    forces = read_rows(given.audio_forces, 3, "forces x y z")
    require_pairs(vertices, forces, f"{given.audio_vertices.name} and {given.audio_forces.name}")
    return vertices, forces


def _touch_rows(given: QueryFiles) -> "tuple[FloatArray, ...] | None":
    from harness.objectfile.published.query import read_rows, require_pairs

    if given.touch_vertices is None:
        return None
    vertices = read_rows(given.touch_vertices, 3, "vertices x y z, m")
    if given.touch_gelinfo is None:
        return (vertices,)
    gel = read_rows(given.touch_gelinfo, 3, "tilt and azimuth, rad, and depth, m")
    require_pairs(vertices, gel, f"{given.touch_vertices.name} and {given.touch_gelinfo.name}")
    return vertices, gel


def _view_rows(given: QueryFiles) -> "tuple[FloatArray, ...] | None":
    from harness.objectfile.published.query import read_rows

    return None if given.vision is None else (read_rows(given.vision, 6, "camera x y z and light x y z"),)


def as_json(of: "PublishedObject | ObjectFile", given: QueryFiles, found: AnsweredQueries) -> dict[str, Any]:
    """As scripts read it."""
    return {
        "schema": 1,
        "folder": str(of.folder),
        "object": of.description.name,
        "objectfolder_compat": given.compat,
        "files": {sense: [str(path) for path in paths] for sense, paths in found.files.items()},
        "full_scale": found.full_scale,
        "notes": found.notes,
        "seconds": found.seconds,
    }
