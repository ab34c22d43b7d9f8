"""The effects of force: how hard a gel is pressed, at three levels."""

import numpy as np

from harness.basics.arrays import FloatArray
from harness.basics.errors import WrongUse
from harness.bench.sensor import TactileSensor
from harness.effects.accuracy import Knob
from harness.sim.gel.contact_force import PARTS, ContactForce, ForceTable, contact_force, require_depths
from harness.sim.gel.elastic import GelElastic

FORCE = Knob(
    "touch.force",
    ("table", "winkler", "layer"),
    "",
    "method",
    "layer",
    "measured forces, springs under each contact, or the elastic layer",
)
CELLS = Knob(
    "touch.force_cells", (4, 2, 1), "pixels", "number", 1, "pixels to a square that presses, each way"
)


def press_layer(
    touch_height_map: FloatArray, sensor: TactileSensor, sensor_elastic: GelElastic, *, touch_force_cells: int
) -> ContactForce:
    """Compute the force of an elastic layer."""
    cells = touch_force_cells
    return contact_force(touch_height_map, sensor.pitch, sensor.gel_thickness, sensor_elastic, "layer", cells)


def press_springs(
    touch_height_map: FloatArray, sensor: TactileSensor, sensor_elastic: GelElastic
) -> ContactForce:
    """Compute the force of springs under the contact."""
    return contact_force(touch_height_map, sensor.pitch, sensor.gel_thickness, sensor_elastic, "winkler")


def look_up_force(
    touch_height_map: FloatArray, sensor: TactileSensor, sensor_forces: ForceTable | None
) -> ContactForce:
    """Look each force up in a measured table; it acts at the centre of the volume that the object takes.

    Raises:
        WrongUse: there is no table.
        OutOfDomain: as ``contact_force``, or a press beyond the table.
    """
    if sensor_forces is None:
        raise WrongUse("touch.force=table needs forces that were measured; say --force-table FILE.json")
    depth, pitch = touch_height_map, sensor.pitch
    require_depths(depth, sensor.gel_thickness)
    found = np.array([sensor_forces.at(sensor_forces.measure(each, pitch)) for each in depth])
    newtons, sigma = found.reshape(-1, 2).T
    volume = depth.sum(axis=(1, 2)) * pitch**2
    # A table has the total force alone: it is shared as by springs of one stiffness.
    springs = np.divide(newtons, volume, out=np.zeros_like(newtons), where=volume > 0.0)
    shares = np.zeros((len(depth), len(PARTS)))
    scatter = np.divide(sigma, newtons, out=np.zeros_like(newtons), where=newtons > 0.0)
    shares[:, PARTS.index("theory")] = scatter
    return ContactForce.of(depth, springs[:, None, None] * depth, shares, pitch, sensor.gel_thickness)
