"""A calibration's report: figures, presses, and live pictures beside what is drawn of them."""

import numpy as np

from calibration.taxim.arm.moves import ArmScale
from calibration.taxim.arm.record import ArmPresses
from calibration.taxim.arm.rest import AWAY, SIGHTINGS
from calibration.taxim.light_fit import depth_of, pressed_ball
from calibration.taxim.mark_free import MarkFree, UsedPress
from calibration.taxim.pictures import Pictures
from calibration.taxim.shadow.polar import SAMPLE_STEP
from calibration.taxim.smooth_fit import distance
from harness.basics.arrays import ByteArray, FloatArray
from harness.report.calibration_page import CalibrationReport, Example, MovesFigure, PressLine
from harness.report.figures.bins import BinsFigure
from harness.report.figures.shadow import ShadowFigure
from harness.sim.gel.gel import deform
from harness.sim.optics.lit_calibration import LitCalibration
from harness.sim.optics.optics import Optics
from harness.sim.optics.tactile_calibration import TactileCalibration

_SHARES = (0.0, 0.5, 1.0)
"""Of the presses sorted by their score: which are shown."""

_MARGIN = 2.0
"""Contact radii shown about a press."""


def report_of(
    made: MarkFree,
    pictures: Pictures,
    title: str,
    scale: ArmScale | None = None,
    arm: ArmPresses | None = None,
) -> CalibrationReport:
    """What the page of a calibration shows.

    Args:
        made: the calibration.
        pictures: that it was made of.
        title: of the page.
        scale: by the arm's moves; None where none are known.
        arm: the presses that it stands on.
    """
    header = made.calibration.header
    return CalibrationReport(
        title,
        [*_cards(made), *([] if scale is None else [_pitch_card(scale)])],
        [(name, str(value)) for name, value in vars(header).items()]
        + [("sha256", made.calibration.sha256), ("background", made.background_from)],
        [*_notes(made, scale), *([] if arm is None else [_watched(arm)])],
        [
            PressLine(press.name, press.centre, press.radius, press.depth, **vars(press.score))
            for press in made.used
        ],
        [(one.name, one.kind, one.reason) for one in made.refused],
        made.calibration.background,
        made.coverage,
        made.left,
        _examples(made, pictures),
        None if scale is None or arm is None else _moves(scale, arm),
        _shadow_figure(made),
        bins_of(made.calibration),
    )


def _pitch_card(scale: ArmScale) -> tuple[str, str, str]:
    pitch = scale.pitch
    return ("a pixel shows", f"{1e3 * pitch.value:.4f} mm", f"to {1e3 * pitch.within95:.4f} mm, by the arm")


def _watched(arm: ArmPresses) -> str:
    waited = np.array([one.seconds for one in arm.taken])
    return (
        f"Taken by the arm: {len(arm.taken)} presses, {len(arm.backgrounds)} pictures of the untouched gel. "
        f"It moved by {arm.drift:.1f} grey levels as a whole at most, and by {arm.marked:.1f} at one place "
        f"beside that. Pictures were waited for {np.median(waited):.1f} s in the median, {waited.max():.1f} "
        "s at most."
    )


def _moves(scale: ArmScale, arm: ArmPresses) -> MovesFigure:
    used = np.zeros(len(arm.taken), np.bool_)
    used[list(scale.used)] = True
    pitch, aspect, rotation, skew = scale.pitch, scale.aspect, scale.rotation, scale.skew
    turned, askew = (
        tuple(f"{np.degrees(v):.3f} deg" for v in (one.value, one.within95)) for one in (rotation, skew)
    )
    numbers = [
        ("a pixel shows", f"{1e3 * pitch.value:.5f} mm", f"{1e3 * pitch.within95:.5f} mm"),
        ("from column to column", f"{1e3 * scale.wide.value:.5f} mm", f"{1e3 * scale.wide.within95:.5f} mm"),
        ("from row to row", f"{1e3 * scale.high.value:.5f} mm", f"{1e3 * scale.high.within95:.5f} mm"),
        ("a pixel's height over its width", f"{aspect.value:.4f}", f"{aspect.within95:.4f}"),
        ("picture against tool", turned[0], turned[1]),
        ("rows and columns from square", askew[0], askew[1]),
        ("a press about the map", f"{1e3 * scale.scatter:.3f} mm", ""),
    ]
    return MovesFigure(numbers, np.array([one.on_gel for one in arm.taken]), scale.residuals, used)


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


def _shadow_figure(made: MarkFree) -> ShadowFigure:
    pitch, shadow = made.calibration.header.pitch, made.shadow
    lines = [
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
        for one in shadow.colours
    ]
    dark_sides = np.array([one.dark_side for one in shadow.colours])
    return ShadowFigure(
        lines, shadow.directions, pitch * SAMPLE_STEP, shadow.typical, shadow.cells, dark_sides
    )


def bins_of(calibration: TactileCalibration) -> BinsFigure | None:
    """The table's bins and their errors; None of a calibration that does not say these."""
    if not (isinstance(calibration, LitCalibration) and calibration.uncertainty.size):
        return None
    error = np.sqrt((calibration.uncertainty.astype(np.float64) ** 2).mean(axis=2))
    steepest, support = float(np.arcsin(calibration.header.slope_limit)), calibration.support
    inside = np.zeros_like(support)
    inside[: int(np.nonzero(support.any(axis=1))[0].max(initial=0)) + 1] = True
    filled = inside & ~support
    return BinsFigure(
        error,
        support,
        steepest,
        float(np.median(error[support])),
        float(np.median(error[filled])) if filled.any() else np.nan,
    )


def _examples(made: MarkFree, pictures: Pictures) -> list[Example]:
    order = sorted(made.used, key=lambda press: press.score.table)
    chosen = [order[round(share * (len(order) - 1))] for share in _SHARES]
    return [
        _example(word, press, made, pictures)
        for word, press in zip(("worst", "median", "best"), chosen, strict=True)
    ]


def _example(word: str, press: UsedPress, made: MarkFree, pictures: Pictures) -> Example:
    live = pictures.images[pictures.names.index(press.name)]
    centre = np.array(press.centre)
    change = live.astype(np.float64) - pictures.background
    far = distance((live.shape[0], live.shape[1]), centre) > AWAY * made.contact_radius
    drift = np.median(change[far], axis=0)
    drawn = draw_press(made.calibration, centre, made.contact_radius)
    reach = _MARGIN * made.contact_radius
    rows, columns = live.shape[:2]
    x0, y0 = np.maximum(np.floor(centre - reach).astype(int), 0)
    x1, y1 = np.minimum(np.ceil(centre + reach).astype(int), (columns, rows))
    shifted = np.clip(np.round(live - drift), 0.0, 255.0).astype(np.uint8)
    title = f"{word}: {press.name}, held out {press.score.table:.1f} dB"
    return Example(title, shifted[y0:y1, x0:x1], drawn[y0:y1, x0:x1])


def draw_press(calibration: TactileCalibration, centre: FloatArray, radius: float) -> ByteArray:
    """``(rows, columns, 3)`` RGB of a ball in the gel at a centre (column, row), drawn as anything is drawn.

    The smooth level, with the gel's skirt; ``radius`` in pixels is the contact line's.
    """
    header = calibration.header
    ball = header.ball_radius / header.pitch
    away = distance((calibration.rows, calibration.columns), centre)
    reached = header.pitch * pressed_ball(away, depth_of(header.skirt, radius, ball), ball)
    drawn: ByteArray = Optics(calibration, "smooth").render(deform(reached[None], header.skirt)).images[0]
    return drawn
