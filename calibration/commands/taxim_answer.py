"""What ``touchstone calibrate taxim`` answers: numbers for programs, lines for people, and what to doubt."""

from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rich.markup import escape
from rich.table import Table

from harness.commands.output import ANSWERS, CONSOLE

if TYPE_CHECKING:
    from calibration.taxim.arm.moves import ArmScale, Uncertain
    from calibration.taxim.arm.record import ArmPresses
    from calibration.taxim.mark_free import MarkFree

NO_MOVES = (
    "no arm moves are known of these pictures: ball presses alone cannot tell millimetres per pixel, aspect "
    "or rotation, because another pitch only relabels the slopes; calibrate with --station"
)

_MARKED = 8.0


def answer_of(made: "MarkFree", artefact: Path, polycalib: Path | None, page: Path | None) -> dict[str, Any]:
    """What the calibration says of itself, by the words of the answer."""
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
        "misfit_grey": None if header.misfit is None else header.misfit.rms,
        "misfit_alike": None if header.misfit is None else header.misfit.alike,
        **shadow_answer(made),
        "background": made.background_from,
        "polycalib": None if polycalib is None else str(polycalib),
        "report": None if page is None else str(page),
        "seconds": made.seconds,
    }


def say(made: "MarkFree", answer: dict[str, Any], scale: "ArmScale | None") -> None:
    """The same for people."""
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
    if answer["misfit_grey"] is not None:
        ANSWERS.print(
            f"held-out colours are off by {answer['misfit_grey']:.1f} grey levels beside the noise, "
            f"alike over a sine of {answer['misfit_alike']:.2f} of the slope"
        )
    for line in shadow_lines(made):
        ANSWERS.print(escape(line))
    for line in [escape(answer["scale_reason"])] if scale is None else scale_lines(scale):
        ANSWERS.print(line)
    ANSWERS.print(f"background: {escape(answer['background'])}; {answer['seconds']:.1f} s")
    if answer["report"] is not None:
        ANSWERS.print(f"report: {escape(answer['report'])}")


def scale_answer(scale: "ArmScale | None", arm: "ArmPresses | None") -> dict[str, Any]:
    """What the arm's moves say, for the answer; why nothing, where there are none."""
    if scale is None or arm is None:
        return {"scale": None, "scale_reason": NO_MOVES}
    return {
        "scale": {
            **_measured("pitch", "_m", scale.pitch),
            **_measured("wide", "_m", scale.wide),
            **_measured("high", "_m", scale.high),
            **_measured("aspect", "", scale.aspect),
            **_measured("rotation", "_rad", scale.rotation),
            **_measured("skew", "_rad", scale.skew),
            "gel_from_pixels_m": scale.gel_from_pixels.tolist(),
            "scatter_m": scale.scatter,
            "presses": len(scale.used),
            "off": [arm.taken[k].name for k in scale.off],
        },
        "scale_reason": None,
        "drift_levels": arm.drift,
        "marked_levels": arm.marked,
    }


def _measured(name: str, unit: str, one: "Uncertain") -> dict[str, float]:
    return {
        f"{name}{unit}": one.value,
        f"{name}_sigma{unit}": one.sigma,
        f"{name}_within95{unit}": one.within95,
    }


def scale_lines(scale: "ArmScale") -> list[str]:
    """The arm's part of it for people."""
    degrees = 57.29577951308232
    return [
        f"by the arm: {1e3 * scale.pitch.value:.5f} mm a pixel (to {1e3 * scale.pitch.within95:.5f}; "
        f"{1e3 * scale.wide.value:.5f} from column to column, {1e3 * scale.high.value:.5f} from row to row), "
        f"aspect {scale.aspect.value:.4f} (to {scale.aspect.within95:.4f}), "
        f"rotation {degrees * scale.rotation.value:.2f} deg (to {degrees * scale.rotation.within95:.2f}), "
        "19 times of 20",
        f"{len(scale.used)} presses scatter by {1e3 * scale.scatter:.3f} mm about it",
    ]


def doubts(scale: "ArmScale", arm: "ArmPresses", squared: float) -> list[str]:
    """What the operator should know of a measured scale; pictures were made square by ``squared``."""
    said = []
    if squared != 1.0:
        said.append(
            f"a pixel is {scale.aspect.value:.4f} times as high as wide (to {scale.aspect.within95:.4f}): "
            f"the pictures were made square by {squared:.4f} before the fit, and live ones are by the same, "
            "as the artefact's made_from says"
        )
    if abs(squared - scale.aspect.value) > scale.aspect.within95:
        said.append(
            f"an aspect of {squared:.4f} was taken, and the arm measured {scale.aspect.value:.4f} to "
            f"{scale.aspect.within95:.4f}: leave --aspect out"
        )
    if abs(scale.skew.value) > scale.skew.within95:
        said.append(
            f"rows and columns stand askew by {57.3 * scale.skew.value:.2f} deg, more than the error: the "
            "gel slips sideways, or the camera looks at it from the side"
        )
    if scale.off:
        said.append(f"off the map and not used for it: {', '.join(arm.taken[k].name for k in scale.off)}")
    if arm.marked > _MARKED:
        said.append(
            f"a place of the untouched gel changed by {arm.marked:.0f} grey levels since the first "
            "background: an imprint that had not gone, dirt, or a gel that moved"
        )
    return said


def write_published(made: "MarkFree", polycalib: Path | None, shadow_table: Path | None) -> None:
    """Write the colour table, and the shadows, as Taxim publishes them, where a file is named.

    Raises:
        CalibrationRefused: the presses show no shadows to write.
    """
    from calibration.taxim.polycalib import write_polycalib
    from harness.basics.errors import CalibrationRefused
    from harness.sim.optics.lit_calibration import shadow_of
    from harness.sim.optics.shadow_file import write_shadow_table

    if polycalib is not None:
        write_polycalib(made.calibration, polycalib)
    if shadow_table is None:
        return
    table = shadow_of(made.calibration)
    if table is None:
        raise CalibrationRefused(
            f"--shadow-table {shadow_table}: these presses show no shadow to write: {made.shadow_missing}; "
            "leave it out"
        )
    write_shadow_table(table, shadow_table)


def shadow_answer(made: "MarkFree") -> dict[str, Any]:
    """What the presses show of shadows; why they are not drawn, where they are not."""
    score, pitch = made.shadow_score, made.calibration.header.pitch
    seen = [
        {
            "colour": one.colour,
            "drawn": one.missing == "" and made.shadow_missing == "",
            "missing": one.missing or None,
            "falls_rad": _finite(one.falls),
            "falls_sigma_rad": _finite(one.falls_error),
            "dark_side_rad": one.dark_side,
            "deepest_levels": one.deepest,
            "deepest_sigma_levels": _finite(one.deepest_error),
            "misfit_levels": one.misfit,
            "half_within_m": pitch * one.reach,
            "wide_rad": one.wide,
        }
        for one in made.shadow.colours
    ]
    drawn = made.shadow_missing == ""
    return {
        "shadow": {
            "rim_depth_m": pitch * made.shadow.rim,
            "colours": seen,
            "psnr_own_db": None if score is None else _finite(score.shaded),
            "psnr_own_without_db": None if score is None else _finite(score.plain),
            "gain_db": None if score is None else score.gain,
            "better_share": None if score is None else score.better,
            "presses": 0 if score is None else score.presses,
        },
        "shadow_drawn": drawn,
        "shadow_reason": None if drawn else made.shadow_missing,
    }


def _finite(value: float) -> float | None:
    return float(value) if isfinite(value) else None


def shadow_lines(made: "MarkFree") -> list[str]:
    """The shadows' part of it for people."""
    if made.shadow_missing:
        return [f"no shadow is drawn. {made.shadow_missing}"]
    score, degrees = made.shadow_score, 57.29577951308232
    assert score is not None
    words = [
        f"{one.colour} falls at {degrees * one.falls:.1f} deg (to {degrees * one.falls_error:.1f}; slopes "
        f"turn from that light at {degrees * one.dark_side:.1f}), {one.deepest:.0f} grey levels at most"
        for one in made.shadow.colours
        if not one.missing
    ]
    left = [f"{one.colour} none: {one.missing}" for one in made.shadow.colours if one.missing]
    rim = 1e3 * made.calibration.header.pitch * made.shadow.rim
    return [
        f"shadows of {rim:.2f} mm rims: {'; '.join([*words, *left])}",
        f"over the shadow's own pixels of held-out presses {score.shaded:.2f} dB with it and "
        f"{score.plain:.2f} without, {score.better:.0%} better",
    ]
