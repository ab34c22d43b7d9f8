"""Touches of an imported object as files: maps in metres, and pictures where there are colours."""

from pathlib import Path
from typing import TYPE_CHECKING

from harness.commands.object.published.files import TOUCH, AnsweredQueries, QueryFiles

if TYPE_CHECKING:
    from harness.basics.arrays import FloatArray
    from harness.objectfile.published.entries import PublishedColoursEntry, PublishedDepthEntry
    from harness.objectfile.published.folder import PublishedObject


def touches_written(
    of: "PublishedObject", rows: "tuple[FloatArray, ...]", given: QueryFiles, out: Path, into: AnsweredQueries
) -> None:
    """Write ``1.npy`` and ``1.png`` and so on; ``rows`` are vertices and, of 2.0, presses."""
    depth, colours = of.description.touch_depth, of.description.touch_colours
    if depth is not None:
        into.files[TOUCH] = _maps(of, depth, rows, given, out, into)
    else:
        assert colours is not None
        into.files[TOUCH] = _pictures(of, colours, rows[0], given, out, into)


def _maps(
    of: "PublishedObject",
    entry: "PublishedDepthEntry",
    rows: "tuple[FloatArray, ...]",
    given: QueryFiles,
    out: Path,
    into: AnsweredQueries,
) -> list[Path]:

    from harness.basics.npz_file import write_array
    from harness.objectfile.published.taxim_picture import TaximPicture
    from harness.objectfile.published.touch import open_depths
    from harness.picture.image_file import write_png

    vertices, gel = rows
    size = (entry.rows, entry.columns)
    optics = None if given.calibration is None else TaximPicture.open(given.calibration, size)
    if optics is None:
        into.notes.append(
            "maps alone, metres from the gel's camera: for pictures give --calibration, the folder `calibs` "
            "that "
            "ObjectFolder 2.0 publishes"
        )
    written = []
    for number, (depth, press) in enumerate(
        zip(open_depths(of, entry).maps(vertices, gel), gel, strict=True), start=1
    ):
        written.append(out / f"{number}.npy")
        write_array(written[-1], depth)
        if optics is not None:
            draw = optics.compat_image if given.compat else optics.image
            written.append(out / f"{number}.png")
            write_png(written[-1], draw(depth, float(press[2])))
    return written


def _pictures(
    of: "PublishedObject",
    entry: "PublishedColoursEntry",
    vertices: "FloatArray",
    given: QueryFiles,
    out: Path,
    into: AnsweredQueries,
) -> list[Path]:
    from harness.objectfile.published.touch import open_colours
    from harness.picture.image_file import write_png

    if given.compat:
        into.notes.append(
            "coordinates were normalised by the least and greatest of these vertices, as the program of "
            "ObjectFolder 1.0 does: a vertex looks otherwise in other company"
        )
    written = []
    for number, image in enumerate(open_colours(of, entry).images(vertices, given.compat), start=1):
        written.append(out / f"{number}.png")
        write_png(written[-1], image)
    return written
