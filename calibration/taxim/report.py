"""A calibration's report: figures, presses, and live pictures beside what is drawn of them."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from calibration.taxim.arm.moves import ArmScale
from calibration.taxim.arm.record import AWAY, SIGHTINGS, ArmPresses
from calibration.taxim.light_fit import depth_of, pressed_ball
from calibration.taxim.mark_free import MarkFree, UsedPress
from calibration.taxim.pictures import Pictures
from calibration.taxim.shadow import SAMPLE_STEP
from calibration.taxim.smooth_fit import distance
from harness.basics.arrays import ByteArray
from harness.experiment.report_content import Picture
from harness.report.figures.calibration import (
    LONGER,
    bins_figure,
    maps_figure,
    moves_figure,
    scores_figure,
    shadow_figure,
)
from harness.report.figures.figures import Album
from harness.report.figures.tiles import DIFFERENCE_GAIN, difference, png
from harness.report.template import write_page
from harness.sim.gel.gel import deform
from harness.sim.optics.lit_calibration import LitCalibration
from harness.sim.optics.optics import Optics

PAGE = "calibration.html"
"""Name of the page in its folder."""

_SHARES = {"worst": 0.0, "median": 0.5, "best": 1.0}
"""Of the presses sorted by their score: which are shown."""

_MARGIN = 2.0
"""Contact radii shown about a press."""


def write_report(
    made: MarkFree,
    pictures: Pictures,
    title: str,
    folder: Path,
    scale: ArmScale | None = None,
    arm: ArmPresses | None = None,
) -> Path:
    """Write the page of a calibration, which refers to nothing outside itself, and its pictures; its path.

    Args:
        made: the calibration.
        pictures: that it was made of.
        title: of the page.
        folder: made if it does not exist; files of the same names are replaced.
        scale: by the arm's moves; None where none are known.
        arm: the presses that it stands on.
    """
    folder.mkdir(parents=True, exist_ok=True)
    header, album = made.calibration.header, Album(folder)
    cards = _cards(made)
    if scale is not None:
        value, within = (
            f"{1e3 * scale.pitch.value:.4f} mm",
            f"to {1e3 * scale.pitch.within95:.4f} mm, by the arm",
        )
        cards.append(("a pixel shows", value, within))
    report = {
        "title": title,
        "cards": cards,
        "facts": [
            *vars(header).items(),
            ("sha256", made.calibration.sha256),
            ("background", made.background_from),
        ],
        "notes": [*_notes(made, scale), *([] if arm is None else [_watched(arm)])],
        "presses": made.used,
        "refused": made.refused,
    }
    circles = [(press.centre, press.radius) for press in made.used]
    maps = maps_figure(made.calibration.background, circles, made.coverage, made.left)
    scores = {
        name: np.array([vars(press.score)[name] for press in made.used]) for name in vars(made.used[0].score)
    }
    shadow = made.shadow
    dark_sides = np.array([one.dark_side for one in shadow.colours])
    step = header.pitch * SAMPLE_STEP
    shadows = shadow_figure(shadow.directions, step, shadow.typical, shadow.cells, dark_sides)
    return write_page(
        folder / PAGE,
        PAGE,
        report=report,
        maps=album.photograph("maps", maps),
        scores=album.drawing("scores", scores_figure(scores)),
        rows=list(_examples(made, pictures, album)),
        gain=f"{DIFFERENCE_GAIN:g}",
        moved=None if scale is None or arm is None else _moves(scale, arm, album),
        numbers=[] if scale is None else _numbers(scale),
        longer=f"{LONGER:g}",
        shadowed=album.drawing("shadow", shadows),
        shadows=_shadow_lines(made),
        **_believed(made.calibration, album),
    )


def _watched(arm: ArmPresses) -> str:
    waited = np.array([one.seconds for one in arm.taken])
    return (
        f"Taken by the arm: {len(arm.taken)} presses, {len(arm.backgrounds)} pictures of the untouched gel. "
        f"It moved by {arm.drift:.1f} grey levels as a whole at most, and by {arm.marked:.1f} at one place "
        f"beside that. Pictures were waited for {np.median(waited):.1f} s in the median, {waited.max():.1f} "
        "s at most."
    )


def _numbers(scale: ArmScale) -> list[tuple[str, str, str]]:
    """Name, value and what it is uncertain by, of everything that the moves tell."""
    pitch, aspect, rotation, skew = scale.pitch, scale.aspect, scale.rotation, scale.skew
    turned, askew = (
        tuple(f"{np.degrees(v):.3f} deg" for v in (one.value, one.within95)) for one in (rotation, skew)
    )
    return [
        ("a pixel shows", f"{1e3 * pitch.value:.5f} mm", f"{1e3 * pitch.within95:.5f} mm"),
        ("from column to column", f"{1e3 * scale.wide.value:.5f} mm", f"{1e3 * scale.wide.within95:.5f} mm"),
        ("from row to row", f"{1e3 * scale.high.value:.5f} mm", f"{1e3 * scale.high.within95:.5f} mm"),
        ("a pixel's height over its width", f"{aspect.value:.4f}", f"{aspect.within95:.4f}"),
        ("picture against tool", turned[0], turned[1]),
        ("rows and columns from square", askew[0], askew[1]),
        ("a press about the map", f"{1e3 * scale.scatter:.3f} mm", ""),
    ]


def _moves(scale: ArmScale, arm: ArmPresses, album: Album) -> Picture:
    used = np.zeros(len(arm.taken), np.bool_)
    used[list(scale.used)] = True
    on_gel = np.array([one.on_gel for one in arm.taken])
    return album.drawing("moves", moves_figure(on_gel, scale.residuals, used))


def _cards(made: MarkFree) -> list[tuple[str, str, str]]:
    covered = float((made.coverage > 0).mean())
    return [
        ("held out, table", f"{made.median('table'):.1f} dB", "median PSNR within the contact"),
        ("held out, smooth model", f"{made.median('smooth'):.1f} dB", "with skirt and light"),
        ("untouched gel", f"{made.median('nothing'):.1f} dB", "what predicting nothing scores"),
        (
            "presses",
            f"{len(made.used)}",
            f"{len(made.refused)} refused; {covered:.0%} of the picture reached",
        ),
    ]


def _notes(made: MarkFree, scale: ArmScale | None) -> list[str]:
    header = made.calibration.header
    steepest = np.degrees(np.arcsin(header.slope_limit))
    return [
        f"Background: {made.background_from}, corrected where at least {SIGHTINGS} presses show the gel "
        f"untouched. Slopes to {steepest:.0f} degrees are supported; "
        f"{made.calibration.support.mean():.0%} of the table's bins were reached. Took {made.seconds:.1f} s.",
        f"Pitch ({1e3 * header.pitch:g} mm a pixel) and ball ({1e3 * header.ball_radius:g} mm) were given, "
        "not measured: balls of one size cannot tell a wrong pitch, because it only relabels the slopes. "
        "Known moves of an arm tell it, with aspect and rotation; none are known of these pictures."
        if scale is None
        else f"The ball ({1e3 * header.ball_radius:g} mm) was given; {1e3 * header.pitch:.5g} mm a pixel "
        f"were taken, by the arm it is {1e3 * scale.pitch.value:.5g} mm.",
        f"The contact line of all presses is a circle of {made.contact_radius:.1f} px to within "
        f"{made.roundness:.2f} px. The gel's skirt is {header.skirt.kernels[0]} px wide, and the "
        f"balls reach {1e3 * made.depth:.2f} mm in. Slopes that an inverse starts from, which know no "
        f"dimming by a contact, lean by {np.degrees(made.lean):.1f} degrees against that line.",
        _shadow_note(made),
    ]


def _shadow_note(made: MarkFree) -> str:
    score = made.shadow_score
    if made.shadow_missing or score is None:
        return f"No shadow is drawn. {made.shadow_missing}."
    rim = 1e3 * made.calibration.header.pitch * made.shadow.rim
    return (
        f"Shadows were seen of rims {rim:.2f} mm deep; of others they are drawn by the law of the published "
        f"depths. Over their own pixels held-out presses score {score.shaded:.1f} dB with them and "
        f"{score.plain:.1f} without, and {score.better:.0%} are better."
    )


def _shadow_lines(made: MarkFree) -> list[tuple[str, ...]]:
    """Of the table under the figure, one a colour."""
    return [
        (
            one.colour,
            "" if np.isnan(one.falls) else f"{np.degrees(one.falls):.1f} deg",
            "" if np.isnan(one.falls_error) else f"{np.degrees(one.falls_error):.1f} deg",
            f"{np.degrees(one.dark_side):.1f} deg",
            f"{one.deepest:.1f}",
            "" if np.isnan(one.deepest_error) else f"{one.deepest_error:.1f}",
            f"{one.misfit:.1f}",
            one.missing or "drawn",
        )
        for one in made.shadow.colours
    ]


def _believed(calibration: LitCalibration, album: Album) -> dict[str, Any]:
    """The table's bins and their errors, with the median of those that presses reached and of the others."""
    error = np.sqrt((calibration.uncertainty.astype(np.float64) ** 2).mean(axis=2))
    steepest, support = float(np.arcsin(calibration.header.slope_limit)), calibration.support
    inside = np.zeros_like(support)
    inside[: int(np.nonzero(support.any(axis=1))[0].max(initial=0)) + 1] = True
    filled = inside & ~support
    return {
        "believed": album.drawing("bins", bins_figure(error, support, steepest)),
        "reached": float(np.median(error[support])),
        "filled": float(np.median(error[filled])) if filled.any() else None,
    }


def _examples(
    made: MarkFree, pictures: Pictures, album: Album
) -> Iterator[tuple[str, list[tuple[str, Picture]]]]:
    """From the worst press to the best its title, and it beside what the calibration draws of it."""
    order = sorted(made.used, key=lambda press: press.score.table)
    for number, (word, share) in enumerate(_SHARES.items(), start=1):
        press = order[round(share * (len(order) - 1))]
        live, drawn = _about(press, made, pictures)
        shown = (("live", live), ("drawn", drawn), ("difference", difference(live, drawn)))
        tiles = [(name, album.pixels(f"press_{number}_{name}", png(picture))) for name, picture in shown]
        yield f"{word}: {press.name}, held out {press.score.table:.1f} dB", tiles


def _about(press: UsedPress, made: MarkFree, pictures: Pictures) -> tuple[ByteArray, ByteArray]:
    """A press as it was seen, its drift taken out, and as it is drawn: RGB about its contact."""
    live = pictures.images[pictures.names.index(press.name)]
    centre = np.array(press.centre)
    change = live.astype(np.float64) - pictures.background
    far = distance((live.shape[0], live.shape[1]), centre) > AWAY * made.contact_radius
    drift = np.median(change[far], axis=0)
    header = made.calibration.header
    ball = header.ball_radius / header.pitch
    away = distance((made.calibration.rows, made.calibration.columns), centre)
    depth = depth_of(header.skirt, made.contact_radius, ball)
    surface = deform((header.pitch * pressed_ball(away, depth, ball))[None], header.skirt)
    drawn: ByteArray = Optics(made.calibration, "smooth").render(surface).images[0]
    reach = _MARGIN * made.contact_radius
    rows, columns = live.shape[:2]
    x0, y0 = np.maximum(np.floor(centre - reach).astype(int), 0)
    x1, y1 = np.minimum(np.ceil(centre + reach).astype(int), (columns, rows))
    shifted = np.clip(np.round(live - drift), 0.0, 255.0).astype(np.uint8)
    return shifted[y0:y1, x0:x1], drawn[y0:y1, x0:x1]
