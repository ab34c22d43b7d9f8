"""What ``touchstone calibrate taxim`` says of shadows, and what it writes in the layouts of others."""

from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from calibration.taxim.mark_free import MarkFree


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
