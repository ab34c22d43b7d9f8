"""``touchstone calibrate taxim``: a tactile camera's colours from ball presses, without marks."""

from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, get_args

import typer
from rich.markup import escape
from rich.table import Table

from harness import options
from harness.output import ANSWERS, CONSOLE, emit

if TYPE_CHECKING:
    from calibration.taxim.mark_free import Identity, MarkFree
    from calibration.taxim.pictures import Channels


def taxim(
    folder: Annotated[
        Path,
        typer.Argument(
            help="Pictures of one ball pressed all over the gel, one a press; or a dataPack.npz.",
            metavar="FOLDER",
        ),
    ],
    ball_radius: Annotated[
        str, typer.Option("--ball-radius", help="Radius of the ball, as 2mm.", metavar="LENGTH")
    ],
    pitch: Annotated[
        str,
        typer.Option(
            help="Length of gel that a pixel shows, as 0.0295mm; presses cannot tell it.", metavar="LENGTH"
        ),
    ] = "0.1245mm",
    out: Annotated[
        Path | None,
        typer.Option(help="The artefact to write; <folder>_calibration.npz if left out.", metavar="FILE"),
    ] = None,
    polycalib: Annotated[
        Path | None,
        typer.Option(help="Write the colour table in Taxim's own layout too.", metavar="FILE"),
    ] = None,
    report: Annotated[
        Path | None, typer.Option(help="Write a page with pictures into this folder.", metavar="DIR")
    ] = None,
    background: Annotated[
        Path | None,
        typer.Option(
            help="Picture of the untouched gel; found by its name in the folder, or made of the presses.",
            metavar="FILE",
        ),
    ] = None,
    channels: Annotated[
        str | None,
        typer.Option(
            help="Order of the colours in the files, rgb or bgr; by default as the formats say.",
            metavar="ORDER",
        ),
    ] = None,
    like: Annotated[
        Path | None,
        typer.Option(
            help="A calibration of the same make, mounted alike: the order of the colours is held to it.",
            metavar="FILE",
        ),
    ] = None,
    marks: Annotated[
        bool, typer.Option("--marks", help="Start from the circles that came with a data pack.")
    ] = False,
    sensor: Annotated[str, typer.Option(help="Make of the sensor.", metavar="NAME")] = "GelSight",
    serial: Annotated[str, typer.Option(help="Of the very sensor.", metavar="NAME")] = "unknown",
    licence: Annotated[str, typer.Option(help="Of the pictures.", metavar="NAME")] = "not stated",
    json: options.Json = False,
) -> int:
    """Calibrate a tactile camera from pictures of ball presses. Nobody marks anything.

    Presses are found, damaged ones refused with the reason, colours and centres fitted in turns, and the
    result scored on presses held out of the fit: eight folds, only the centre refitted on a held-out press.

    Try: touchstone calibrate taxim presses/ --ball-radius 2mm --pitch 0.1245mm --report page/
    """
    from calibration.taxim.mark_free import calibrate
    from calibration.taxim.pictures import read_pictures
    from calibration.taxim.polycalib import write_polycalib
    from harness.sim.tactile_calibration import load_calibration, save_calibration

    who = _identity(sensor, serial, licence, pitch, ball_radius)
    pictures = read_pictures(folder, background, _channels(channels))
    known = None if like is None else load_calibration(like)
    made = calibrate(pictures, who, use_marks=marks, like=known)
    artefact = out if out is not None else Path(f"{folder.resolve().stem}_calibration.npz")
    save_calibration(made.calibration, artefact)
    if polycalib is not None:
        write_polycalib(made.calibration, polycalib)
    page = None
    if report is not None:
        from calibration.taxim.report import report_of
        from harness.report.calibration_page import write_calibration_page

        page = write_calibration_page(report_of(made, pictures, f"{sensor}, {folder.name}"), report)
    answer = _answer(made, artefact, polycalib, page)
    if json:
        emit(answer)
    else:
        _say(made, answer)
    return 0


def _identity(sensor: str, serial: str, licence: str, pitch: str, ball_radius: str) -> "Identity":
    from calibration.taxim.mark_free import Identity

    return Identity(
        sensor=sensor,
        serial=serial,
        licence=licence,
        date=datetime.now(UTC).date().isoformat(),
        pitch=_length("--pitch", pitch),
        ball_radius=_length("--ball-radius", ball_radius),
    )


def _length(option: str, text: str) -> float:
    from harness.errors import WrongUse
    from harness.quantities import LENGTH

    length = options.quantity(option, text, LENGTH)
    if length <= 0.0:
        raise WrongUse(f"{option} {text}: it must be above zero")
    return length


def _channels(text: str | None) -> "Channels | None":
    from calibration.taxim.pictures import Channels
    from harness.errors import WrongUse

    if text is None:
        return None
    for order in get_args(Channels):
        if text == order:
            known: Channels = order
            return known
    raise WrongUse(f"--channels: no order {text!r}; there are {' and '.join(get_args(Channels))}")


def _answer(made: "MarkFree", artefact: Path, polycalib: Path | None, page: Path | None) -> dict[str, Any]:
    header = made.calibration.header
    return {
        "schema": 1,
        "artefact": str(artefact),
        "sha256": made.calibration.sha256,
        "psnr_contact_db": made.median("table"),
        "psnr_contact_smooth_db": made.median("smooth"),
        "psnr_contact_unrefitted_db": made.median("unrefitted"),
        "psnr_untouched_db": made.median("nothing"),
        "presses": len(made.used),
        "refused": [vars(one) for one in made.refused],
        "per_press": [
            {
                "name": press.name,
                "centre_px": list(press.centre),
                "radius_px": press.radius,
                "depth_m": press.depth,
                **{f"psnr_{name}_db": value for name, value in vars(press.score).items()},
            }
            for press in made.used
        ],
        "contact_radius_px": made.contact_radius,
        "contact_line_scatter_px": made.roundness,
        "smooth_lean_rad": made.lean,
        "covered": float((made.coverage > 0).mean()),
        "steepest": header.slope_limit,
        "background": made.background_from,
        "polycalib": None if polycalib is None else str(polycalib),
        "report": None if page is None else str(page),
        "seconds": made.seconds,
    }


def _say(made: "MarkFree", answer: dict[str, Any]) -> None:
    for one in made.refused:
        CONSOLE.print(f"[yellow]refused:[/] {escape(one.name)}: {escape(one.reason)}")
    drawn = Table(title=f"{answer['artefact']}: {len(made.used)} presses, {len(made.refused)} refused")
    for heading in ("held-out PSNR within the contact", "median dB"):
        drawn.add_column(heading, justify="right" if heading.endswith("dB") else "left")
    drawn.add_row("table, centre refitted (levels exact and fast)", f"{answer['psnr_contact_db']:.2f}")
    drawn.add_row("smooth model, centre refitted", f"{answer['psnr_contact_smooth_db']:.2f}")
    drawn.add_row("table, centre as detected", f"{answer['psnr_contact_unrefitted_db']:.2f}")
    drawn.add_row("untouched gel", f"{answer['psnr_untouched_db']:.2f}")
    ANSWERS.print(drawn)
    ANSWERS.print(f"background: {escape(answer['background'])}; {answer['seconds']:.1f} s")
    if answer["report"] is not None:
        ANSWERS.print(f"report: {escape(answer['report'])}")
