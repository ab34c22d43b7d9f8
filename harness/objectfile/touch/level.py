"""The touch of a scene's object out of its ObjectFile."""

import numpy as np

from harness.basics.errors import DataRefused, WrongUse
from harness.basics.mesh import Mesh
from harness.bench.sensor import TactileSensor
from harness.objectfile.file import ObjectFile
from harness.objectfile.same_object import require_same_shape
from harness.objectfile.touch_entries import GelEntry
from harness.sim.gel.gel import GelSkirt

INSTEAD = "touch.shapes = reference"
"""The level that needs no ObjectFile."""

_SAME = 1e-6
"""Relative, by which lengths of one gel may differ: more than JSON rounds them by."""


def require_own_touch(of: ObjectFile, surface: Mesh, sensor: TactileSensor, skirt: GelSkirt) -> None:
    """Refuse the touch of another object or of another gel than the one that is pressed.

    Args:
        of: of this object; its material is not asked for.
        surface: of the object's material, in metres, in the object's frame.
        sensor: that is pressed.
        skirt: of its gel, in its pixels.

    Raises:
        WrongUse: an ObjectFile of another object or another gel; what differs is said.
        DataRefused: it has no touch.
    """
    entry = of.description.touch
    if entry is None:
        raise DataRefused(
            f"{of.folder} has no touch; add it with `touchstone object build --only touch`, or take {INSTEAD}"
        )
    require_same_shape(of, surface, INSTEAD)
    require_gel(of, entry.gel, sensor, skirt)


def require_gel(of: ObjectFile, gel: GelEntry, sensor: TactileSensor, skirt: GelSkirt) -> None:
    """Refuse maps of another gel than the one that is pressed.

    Raises:
        WrongUse: what differs is said.
    """
    different = []
    if sensor.gel_radius is not None:
        different.append(f"its gel is flat and that of {sensor.name} a dome")
    if (gel.rows, gel.columns) != (sensor.rows, sensor.columns):
        different.append(
            f"its maps have {gel.rows} x {gel.columns} pixels and "
            f"{sensor.name} {sensor.rows} x {sensor.columns}"
        )
    lengths = (("pixels", gel.pitch_m, sensor.pitch), ("gel", gel.thickness_m, sensor.gel_thickness))
    for what, there, here in lengths:
        if not np.isclose(there, here, rtol=_SAME, atol=0.0):
            different.append(f"its {what} of {there * 1e3:g} mm, that of {sensor.name} of {here * 1e3:g} mm")
    if gel.skirt != skirt:
        different.append(f"its skirt is {gel.skirt} and that of the calibration {skirt}")
    if different:
        raise WrongUse(
            f"the touch of {of.folder} is of another gel: {'; '.join(different)}. Build it for this one, or "
            f"take {INSTEAD}"
        )
