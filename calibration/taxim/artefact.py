"""What a fit of ball presses hands on: the calibration of its model."""

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from calibration.taxim.held_out import FittedModel
from calibration.taxim.light_fit import per_metre
from harness.basics.arrays import ByteArray
from harness.sim.optics.lit_calibration import LitCalibration
from harness.sim.optics.tactile_calibration import CalibrationHeader, Float32Array

if TYPE_CHECKING:
    from calibration.taxim.mark_free import Identity


def calibration_of(
    background: ByteArray,
    model: FittedModel,
    identity: "Identity",
    made_from: str,
    error: Float32Array | None = None,
) -> LitCalibration:
    """The artefact of a model, which says nothing of its quality yet.

    Args:
        background: ``(rows, columns, 3)`` RGB of the untouched gel, before the presses corrected it.
        model: of the presses.
        identity: pitch, ball and names.
        made_from: in words.
        error: of the table's colours, see ``table_error``; None where it was not asked for.
    """
    header = CalibrationHeader(
        sensor=identity.sensor,
        serial=identity.serial,
        date=identity.date,
        made_from=made_from,
        licence=identity.licence,
        pitch=identity.pitch,
        ball_radius=identity.ball_radius,
        slope_limit=model.plain.edge / identity.ball,
        held_out_db=0.0,
        held_out_table_db=0.0,
        residual_rms=model.plain.residual_rms,
        condition=model.plain.condition,
        skirt=model.light.skirt,
    )
    seen = np.clip(np.round(background + model.rest), 0.0, 255.0).astype(np.uint8)
    lit = per_metre(model.light.lit, identity.pitch)
    made = LitCalibration(header, seen, model.table, model.support, model.plain.colours, lit)
    return made if error is None else replace(made, uncertainty=error)
