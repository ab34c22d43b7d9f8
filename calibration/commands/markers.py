"""``touchstone calibrate markers``: the dots printed on a gel, from pictures of it at rest."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.markup import escape
from rich.table import Table

from harness.commands import options
from harness.commands.output import ANSWERS, emit

if TYPE_CHECKING:
    from harness.basics.arrays import ByteArray


def markers(
    source: Annotated[
        Path,
        typer.Argument(
            help="A picture of the marked gel at rest, or a folder of several of the same.", metavar="PICTURE"
        ),
    ],
    pitch: Annotated[
        str | None,
        typer.Option(
            help="Length of gel that a pixel shows, as 0.05mm; or give --spacing.", metavar="LENGTH"
        ),
    ] = None,
    spacing: Annotated[
        str | None,
        typer.Option(
            help="From dot to dot of the print, as its maker says: tells millimetres a pixel, aspect and "
            "rotation.",
            metavar="LENGTH",
        ),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option(help="The artefact to write; PICTURE_markers.json if left out.", metavar="FILE"),
    ] = None,
    report: Annotated[
        Path | None, typer.Option(help="Write a page with pictures into this folder.", metavar="DIR")
    ] = None,
    sensor: Annotated[str, typer.Option(help="Make of the sensor.", metavar="NAME")] = "tactile camera",
    serial: Annotated[str, typer.Option(help="Of the very gel.", metavar="NAME")] = "unknown",
    json: options.Json = False,
) -> int:
    """Find every printed dot of a resting gel to a hundredth of a pixel, and the grid that they are on.

    Nobody marks anything. A gel without dots, dots on no grid, a gel that something touches and pictures of
    which one moved are refused with the reason. The artefact has every dot; simulators draw and move them
    where they are, not where a centred grid would have them.

    Try: touchstone calibrate markers rest.png --spacing 1.5mm --report page/
    """
    import numpy as np

    from calibration.markers.at_rest import Printed, markers_at_rest
    from calibration.markers.result import answer_of, file_of
    from calibration.taxim.pictures import set_digest
    from harness.basics.files.json_file import write_model
    from harness.basics.files.named_file import refusals_name
    from harness.basics.quantities import LENGTH

    options.require_files(("--out", out, ""))
    options.require_folders(("--report", report))
    pictures = _pictures(source)
    printed = Printed(
        sensor,
        serial,
        options.positive("--pitch", pitch, LENGTH),
        options.positive("--spacing", spacing, LENGTH),
    )
    with refusals_name(source):
        made = markers_at_rest(pictures, printed)
    rest = np.stack(pictures[1:]) if len(pictures) > 1 else np.zeros((0, 0, 0, 3), np.uint8)
    file = file_of(made, printed, f"sha256 {set_digest(pictures[0], rest)}, {len(pictures)} pictures")
    artefact = out if out is not None else Path(f"{source.resolve().stem}_markers.json")
    write_model(file, artefact)
    answer = {**answer_of(made, file), "artefact": str(artefact), "report": None}
    if report is not None:
        from calibration.markers.result import write_report

        page = write_report(made, file, answer, f"{sensor}, {source.name}", report)
        answer["report"] = str(page)
    if json:
        emit(answer)
    else:
        _say(answer)
    return 0


def _pictures(source: Path) -> "list[ByteArray]":
    from calibration.taxim.pictures import SUFFIXES
    from harness.basics.errors import DataRefused
    from harness.picture.image_file import read_image

    if not source.is_dir():
        return [read_image(source)]
    files = [file for file in sorted(source.iterdir()) if file.suffix.lower() in SUFFIXES]
    if not files:
        raise DataRefused(
            f"{source} holds no pictures ({', '.join(SUFFIXES)}); put some of the resting gel there"
        )
    return [read_image(file) for file in files]


def _say(answer: dict[str, Any]) -> None:
    degrees = 57.29577951308232
    drawn = Table(
        title=f"{answer['artefact']}: {answer['dots']} dots in {answer['rows']} x {answer['columns']}"
    )
    drawn.add_column("what")
    drawn.add_column("value", justify="right")
    drawn.add_row("a dot's place, one standard uncertainty", f"{answer['sigma_px']:.3f} px")
    if answer["wander_px"] is not None:
        drawn.add_row("a dot from picture to picture", f"{answer['wander_px']:.3f} px rms")
    drawn.add_row("from dot to dot", f"{answer['spacing_px']:.3f} px")
    drawn.add_row("radius", f"{answer['radius_px']:.2f} px")
    drawn.add_row("rows of dots turned by", f"{degrees * answer['turned_rad']:.3f} deg")
    drawn.add_row("off the straight grid", f"{answer['bend_px']:.3f} px rms")
    drawn.add_row("off a smoothly bent grid", f"{answer['misprint_px']:.3f} px rms")
    scale = answer["scale"]
    if scale is not None:
        drawn.add_row("a pixel shows, by the print", f"{1e3 * scale['pitch_m']['value']:.5f} mm")
        drawn.add_row("a pixel's height over its width", f"{scale['aspect']['value']:.4f}")
    ANSWERS.print(drawn)
    if answer["missing"] or answer["misprinted"]:
        ANSWERS.print(f"{len(answer['missing'])} missing, {len(answer['misprinted'])} off their grid")
    if answer["report"] is not None:
        ANSWERS.print(f"report: {escape(answer['report'])}")
