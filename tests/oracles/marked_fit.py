"""The shipped calibrations' fit, from marks: ``python -m tests.oracles.marked_fit PACK --out FILE``."""

import argparse
import sys
from datetime import UTC, datetime
from pathlib import Path

import numpy as np

from calibration.taxim.held_out import decibels
from calibration.taxim.pictures import PressPack, read_pack
from calibration.taxim.smooth_fit import (
    Manner,
    SmoothFit,
    aligned,
    changes,
    contact_pixels,
    refined_centre,
    residual,
    settled,
)
from calibration.taxim.table import fit_table, table_shades
from harness.basics.arrays import IntArray
from harness.basics.errors import CalibrationRefused, WrongUse
from harness.sim.optics.tactile_calibration import (
    CalibrationHeader,
    TactileCalibration,
    save_calibration,
)

LEAST_DB = 28.4
"""Median held-out PSNR inside the contact below which a fit is refused: what the table that
ObjectFolder published for this sensor scores on the very presses it was fitted to."""

_LEAST_PRESSES = 15
_FOLDS = 5


def fit_calibration(
    pack: PressPack, *, sensor: str, serial: str, pitch: float, ball_radius: float, licence: str, date: str
) -> TactileCalibration:
    """Fit table and smooth model, and hold presses out to say how good they are.

    Args:
        pack: the presses.
        sensor: make.
        serial: of the sensor.
        pitch: metres a pixel.
        ball_radius: metres.
        licence: of the presses.
        date: ISO 8601.

    Raises:
        CalibrationRefused: too few presses, marks that contradict the ball, or a bad fit.
    """
    if len(pack.images) < _LEAST_PRESSES:
        raise CalibrationRefused(
            f"{len(pack.images)} presses were given; take at least {_LEAST_PRESSES}, all over the gel"
        )
    ball = ball_radius / pitch
    fit = fit_smooth(pack, ball)
    table, support = fit_table(pack, fit, ball, changes(pack))
    smooth_db, table_db = held_out(pack, ball)
    if smooth_db < LEAST_DB:
        raise CalibrationRefused(
            f"presses left out are predicted at {smooth_db:.1f} dB, less than {LEAST_DB:g}; "
            "check marks, ball radius and pitch, clean the gel, and take the presses again"
        )
    numbers = ",".join(str(n) for n in pack.number)
    header = CalibrationHeader(
        sensor=sensor,
        serial=serial,
        date=date,
        made_from=f"sha256 {pack.sha256}, presses {numbers}",
        licence=licence,
        pitch=pitch,
        ball_radius=ball_radius,
        slope_limit=fit.edge / ball,
        held_out_db=smooth_db,
        held_out_table_db=table_db,
        residual_rms=fit.residual_rms,
        condition=fit.condition,
    )
    return TactileCalibration(header, pack.background, table, support, fit.colours)


def fit_smooth(pack: PressPack, ball: float) -> SmoothFit:
    """Colours and centres of presses, in turns from the marks; ``ball`` in pixels.

    Raises:
        CalibrationRefused: the presses contradict the ball.
    """
    change = changes(pack)
    centres, edge = aligned(pack, change, ball, Manner())
    return settled(pack, change, centres, edge, ball, Manner())


def held_out(pack: PressPack, ball: float) -> tuple[float, float]:
    """Median PSNR in dB inside the contact, smooth model and table, over presses each left out of its fit."""
    smooth_db, table_db = [], []
    for fold in range(_FOLDS):
        out = np.arange(len(pack.images)) % _FOLDS == fold
        taught, kept = pack.of(np.nonzero(~out)[0]), pack.of(np.nonzero(out)[0])
        fit = fit_smooth(taught, ball)
        table, _ = fit_table(taught, fit, ball, changes(taught))
        change, bias = changes(kept), (fit.centres - taught.centres).mean(axis=0)
        for k in range(len(change)):
            centre = refined_centre(
                kept, change[k], kept.centres[k] + bias, fit.colours, fit.edge, ball, steps=8
            )
            smooth_db.append(decibels(residual(kept, change[k], centre, fit.colours, fit.edge, ball)))
            place = contact_pixels(kept.shape, centre, fit.edge, 1)
            shown = table_shades(table, centre, place, ball)
            table_db.append(decibels(shown - change[k][place[:, 0], place[:, 1]]))
    return float(np.median(smooth_db)), float(np.median(table_db))


def chosen(presses: int, subset: str) -> IntArray:
    """Which presses a subset names, counted from 0: ``even``, ``odd`` or ``all``.

    Raises:
        WrongUse: another word.
    """
    starts = {"even": (0, 2), "odd": (1, 2), "all": (0, 1)}
    if subset not in starts:
        raise WrongUse(f"no subset {subset!r}; there are {', '.join(starts)}")
    first, step = starts[subset]
    return np.arange(first, presses, step)


def main(arguments: list[str]) -> int:
    """Fit, write, and say how good it is; returns the exit code."""
    options = _parser().parse_args(arguments)
    pack = read_pack(options.pack)
    calibration = fit_calibration(
        pack.of(chosen(len(pack.images), options.subset)),
        sensor=options.sensor,
        serial=options.serial,
        pitch=options.pitch_mm * 1e-3,
        ball_radius=options.ball_radius_mm * 1e-3,
        licence=options.licence,
        date=options.date,
    )
    save_calibration(calibration, options.out)
    header = calibration.header
    sys.stdout.write(
        f"{options.out}: held out {header.held_out_db:.2f} dB smooth, "
        f"{header.held_out_table_db:.2f} dB table; residual {header.residual_rms:.2f} grey levels rms; "
        f"slopes to {np.degrees(np.arcsin(header.slope_limit)):.1f} deg; "
        f"{calibration.support.mean():.0%} of bins reached; "
        f"condition {header.condition:.2g}; sha256 {calibration.sha256[:12]}\n"
    )
    return 0


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="python -m tests.oracles.marked_fit", description=__doc__)
    parser.add_argument("pack", type=Path, help="dataPack.npz of Taxim or ObjectFolder")
    parser.add_argument("--out", type=Path, required=True, help="the calibration to write, .npz")
    parser.add_argument("--subset", default="all", help="even, odd or all presses")
    parser.add_argument("--sensor", default="GelSight R1.5 (ObjectFolder 2.0)")
    parser.add_argument("--serial", default="ObjectFolder 2.0")
    parser.add_argument("--licence", default="CC BY 4.0, rhgao/ObjectFolder")
    parser.add_argument("--pitch-mm", type=float, default=0.1245, help="millimetres a pixel")
    parser.add_argument("--ball-radius-mm", type=float, default=2.0)
    parser.add_argument(
        "--date", default=datetime.now(UTC).date().isoformat(), help="of the presses or the fit"
    )
    return parser


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
