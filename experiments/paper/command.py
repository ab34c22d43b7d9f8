"""``touchstone tables rendering``: the paper's tables 1 and 2, with its 1.0 trained and measured here."""

from pathlib import Path
from typing import Annotated

import typer

from harness.commands import options
from harness.commands.output import CONSOLE, emit, share_progress, warn


def rendering(
    object_: Annotated[
        list[str] | None,
        typer.Option(
            "--object",
            help="An ObjectFile: its folder, or the name of one that comes with the program; may be given "
            "again.",
        ),
    ] = None,
    sense: Annotated[list[str] | None, typer.Option(help="vision, audio or touch; all if left out.")] = None,
    views: Annotated[int, typer.Option(help="Pictures that vision is measured on.", min=1, max=100)] = 4,
    strikes: Annotated[int, typer.Option(help="Places that are struck.", min=2, max=1000)] = 30,
    presses: Annotated[int, typer.Option(help="Presses that are drawn.", min=2, max=1000)] = 60,
    out: Annotated[
        Path,
        typer.Option(help="Folder of networks and measured cells; a stopped table resumes there."),
    ] = Path("runs/tables/rendering"),
    json: options.Json = False,
) -> int:
    """Time and quality of rendering per sense: quoted of the paper, measured of 1.0, 2.0 and ours.

    The networks of ObjectFolder 1.0 and the layers of 2.0 are trained here on the same object, which needs
    the extra `author`; without it their rows say so. Ours are the ObjectFile's own and those of other
    profiles. All are measured against the reference simulation at places, views and presses that none has
    learned from, by the paper's metrics. Cells are stored as they are measured; rows.csv lies beside them.

    Seconds are CPU seconds of one thread for one observation: methods of one sense render in turn.

    Try: touchstone tables rendering --object mug
    """
    options.require_folders(("--out", out))
    from experiments.paper.rendering import SENSES, RenderingWork
    from experiments.paper.rendering_table import (
        RenderingCounts,
        as_csv,
        machine_text,
        measured_rows,
        plain_rendering,
        quoted_rows,
    )
    from harness.basics.errors import WrongUse
    from harness.basics.files.named_file import nearest
    from harness.basics.store import Store
    from harness.basics.whole_file import write_text_whole
    from harness.bench.scene_objectfile import objectfile_folder, require_objectfile
    from harness.objectfile.file import ObjectFile

    for name in sense or []:
        if name not in SENSES:
            raise WrongUse(f"--sense {name} is none; {nearest(name, SENSES)}")
    senses = [each for each in SENSES if not sense or each in sense]  # in the tables' order
    counts, opened = RenderingCounts(views, strikes, presses), []
    for name in object_ or ["mug"]:
        folder = objectfile_folder(name, Path.cwd())
        require_objectfile(folder, f"--object {name}")
        opened.append(ObjectFile.open(folder))
    rows = quoted_rows()
    with share_progress(quiet=json) as report:
        work = RenderingWork(Store(out / "cells"), report)
        for of in opened:
            rows += measured_rows(of, senses, counts, work)
    for row in rows:
        if not row.metrics:
            warn(f"{row.method}: {row.note}")
    write_text_whole(out / "rows.csv", as_csv(rows))
    if json:
        emit({"schema": 1, "machine": machine_text(), "rows": [plain_rendering(row) for row in rows]})
        return 0
    from experiments.paper.rendering_table import print_tables

    print_tables(rows, machine_text())
    CONSOLE.print(f"rows: {out / 'rows.csv'}", markup=False)
    return 0
