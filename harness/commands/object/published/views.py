"""Pictures of an imported object as files."""

from pathlib import Path
from typing import TYPE_CHECKING

from harness.commands.object.published.files import VISION, AnsweredQueries, QueryFiles

if TYPE_CHECKING:
    from harness.basics.arrays import FloatArray
    from harness.objectfile.published.folder import PublishedObject

_CENTRE = 0.5


def views_written(
    of: "PublishedObject", rows: "tuple[FloatArray, ...]", given: QueryFiles, out: Path, into: AnsweredQueries
) -> None:
    """Write ``000.png`` and so on; ``rows`` are cameras and lights."""
    import numpy as np

    from harness.objectfile.published.camera import views_of
    from harness.objectfile.published.look import open_look
    from harness.picture.image_file import write_png

    entry = of.description.vision
    assert entry is not None
    cube = None if entry.cells is None else np.array([entry.cells.low, entry.cells.high])
    reach = entry.near if cube is None else float(np.linalg.norm(np.abs(cube).max(axis=0)))
    views, look, written = views_of(rows[0], reach, given.compat), open_look(of, entry), []
    for number, view in enumerate(views):
        picture = look.picture(view, given.size, 0.0 if given.compat else _CENTRE)
        written.append(out / f"{number:03d}.png")
        write_png(written[-1], picture.truncated() if given.compat else picture.rounded())
    into.files[VISION] = written
