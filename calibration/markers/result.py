"""What a calibration of dots hands on: the file, the answer and the page, of the same numbers."""

from pathlib import Path
from typing import Any

import numpy as np

from calibration.markers.at_rest import Printed, RestingMarkers
from calibration.markers.dots import Dots
from harness.basics.arrays import FloatArray
from harness.picture.dot_lattice import DotLattice
from harness.report.figures.calibration import found_figure, off_figure
from harness.report.figures.figures import Album
from harness.report.template import write_page
from harness.sim.gel.markers import MarkerDot, MarkerFile

PAGE = "markers.html"
"""Name of the page in its folder."""


def file_of(made: RestingMarkers, printed: Printed, made_from: str) -> MarkerFile:
    """The artefact; only dots on the grid are in it."""
    dots, lattice = made.dots, made.lattice
    order = [k for k in np.lexsort((lattice.index[:, 0], lattice.index[:, 1])) if lattice.on[k]]
    across = lattice.step[:, 0]
    return MarkerFile(
        schema=1,
        sensor=printed.sensor,
        serial=printed.serial,
        made_from=made_from,
        picture_rows=made.picture.shape[0],
        picture_columns=made.picture.shape[1],
        pitch_m=made.pitch,
        ink=float(np.median(dots.ink)),
        rows=lattice.rows,
        columns=lattice.columns,
        spacing_px=lattice.spacing,
        turned_rad=float(np.arctan2(across[1], across[0])),
        dots=[
            MarkerDot(
                row=int(lattice.index[k, 1]),
                column=int(lattice.index[k, 0]),
                x_px=float(dots.places[k, 0]),
                y_px=float(dots.places[k, 1]),
                sigma_px=float(dots.sigma[k]),
                radius_px=float(dots.radius[k]),
            )
            for k in order
        ],
    )


def answer_of(made: RestingMarkers, file: MarkerFile) -> dict[str, Any]:
    """The numbers, for programs."""
    lattice, on = made.lattice, made.lattice.on
    scale = made.scale
    # A straight grid of the same spacing, centred in the picture.
    rows, columns = made.picture.shape[:2]
    middle = 0.5 * np.array([columns - 1.0, rows - 1.0])
    size = np.array([lattice.columns, lattice.rows])
    centred = middle + (lattice.index[on] - (size - 1) / 2.0) * lattice.spacing
    return {
        "schema": 1,
        "dots": int(on.sum()),
        "rows": lattice.rows,
        "columns": lattice.columns,
        "missing": [{"row": int(row), "column": int(column)} for column, row in lattice.missing],
        "misprinted": [
            {"row": int(lattice.index[k, 1]), "column": int(lattice.index[k, 0])} for k in made.misprinted
        ],
        "cut_by_the_border": made.dots.cut,
        "off_the_grid": int((~on).sum()) + len(made.dots.odd),
        "sigma_px": float(np.median(made.dots.sigma[on])),
        "wander_px": made.wander,
        "spacing_px": file.spacing_px,
        "radius_px": file.radius,
        "turned_rad": file.turned_rad,
        "ink": file.ink,
        "bend_px": _rms(lattice.affine[on]),
        "misprint_px": _rms(lattice.local[on]),
        "from_a_centred_grid_px": float(np.hypot(*(made.dots.places[on] - centred).T).max()),
        "pitch_m": made.pitch,
        "spacing_m": None if made.pitch is None else made.pitch * file.spacing_px,
        "scale": None
        if scale is None
        else {
            name: {"value": one.value, "sigma": one.sigma, "within95": one.within95}
            for name, one in (
                ("pitch_m", scale.pitch),
                ("wide_m", scale.wide),
                ("high_m", scale.high),
                ("aspect", scale.aspect),
                ("rotation_rad", scale.rotation),
                ("skew_rad", scale.skew),
            )
        },
        "seconds": made.seconds,
    }


def write_report(
    made: RestingMarkers, file: MarkerFile, answer: dict[str, Any], title: str, folder: Path
) -> Path:
    """Write the page and its pictures into a folder, which is made if it does not exist; the page's path."""
    folder.mkdir(parents=True, exist_ok=True)
    album, dots, lattice = Album(folder), made.dots, made.lattice
    rows, columns = made.picture.shape[:2]
    return write_page(
        folder / PAGE,
        PAGE,
        report={
            "title": title,
            "cards": _cards(answer),
            "facts": [pair for pair in file.model_dump(by_alias=True).items() if pair[0] != "dots"],
            "notes": _notes(answer),
        },
        found=album.photograph("found", found_figure(made.picture, dots.places, dots.radius, lattice)),
        off=album.drawing("off", off_figure(rows, columns, dots.places, lattice)),
        dots=_lines(dots, lattice),
    )


def _lines(dots: Dots, lattice: DotLattice) -> list[tuple[str, ...]]:
    order = np.lexsort((lattice.index[:, 0], lattice.index[:, 1]))
    return [
        (
            f"{lattice.index[k, 1]}, {lattice.index[k, 0]}" if lattice.on[k] else "none",
            f"{dots.places[k, 0]:.3f}, {dots.places[k, 1]:.3f}",
            f"{dots.sigma[k]:.3f}",
            f"{dots.radius[k]:.2f}",
            f"{np.hypot(*lattice.affine[k]):.3f}" if lattice.on[k] else "",
            f"{np.hypot(*lattice.local[k]):.3f}" if lattice.on[k] else "",
        )
        for k in order
    ]


def _cards(answer: dict[str, Any]) -> list[tuple[str, str, str]]:
    pitch = answer["pitch_m"]
    spacing = f"{answer['spacing_px']:.3f} px" if pitch is None else f"{1e3 * answer['spacing_m']:.4f} mm"
    return [
        ("dots", f"{answer['dots']}", f"{answer['rows']} rows, {answer['columns']} columns"),
        ("a dot's place", f"{answer['sigma_px']:.3f} px", "one standard uncertainty, median"),
        ("from dot to dot", spacing, f"radius {answer['radius_px']:.2f} px"),
        ("turned by", f"{np.degrees(answer['turned_rad']):.3f} deg", "rows of dots against the picture's"),
    ]


def _notes(answer: dict[str, Any]) -> list[str]:
    wander, scale = answer["wander_px"], answer["scale"]
    notes = [
        f"Off the straight grid by {answer['bend_px']:.3f} px rms, off a smoothly bent one by "
        f"{answer['misprint_px']:.3f}. A centred, straight grid, all that a sensor's description can hold, "
        f"is off by up to {answer['from_a_centred_grid_px']:.1f} px: simulators are given this file "
        "instead.",
        f"{len(answer['missing'])} places of the grid have no dot, {answer['cut_by_the_border']} dots are "
        f"cut by the border and not used, {answer['off_the_grid']} dark places are on no grid. A dot gives "
        f"back {answer['ink']:.0%} of the light.",
        "From picture to picture a dot wanders by "
        + (f"{wander:.3f} px rms." if wander is not None else "an amount that one picture cannot tell."),
    ]
    if scale is not None:
        notes.append(
            f"By the print a pixel shows {1e3 * scale['pitch_m']['value']:.5f} mm, is "
            f"{scale['aspect']['value']:.4f} times as high as wide (to {scale['aspect']['within95']:.4f}), "
            "and the picture is turned against the dots by "
            f"{np.degrees(scale['rotation_rad']['value']):.3f} deg. No error shows what the print's own "
            "spacing is off by: one that is wrong by a hundredth is a pitch that is wrong by a hundredth."
        )
    return notes


def _rms(off: FloatArray) -> float:
    return float(np.sqrt(np.mean(np.sum(off**2, axis=1))))
