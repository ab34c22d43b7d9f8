"""The force of a press, as effects and of a reading."""

from dataclasses import dataclass

import numpy as np

from harness.basics.arrays import FloatArray
from harness.basics.errors import WrongUse
from harness.bench.sensor import TactileSensor
from harness.effects.accuracy import Knob
from harness.sim.gel.contact_force import PARTS, ContactForce, ForceLevel, contact_force, require_depths
from harness.sim.gel.elastic import GelElastic
from harness.sim.gel.force_table import ForceTable
from harness.sim.optics.depth_reading import DepthReading

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

OF_GEL = 0.1
"""Share of the deepest pixel from which the surface of a gel is taken to be pressed."""

_OTHER_SHARES = (0.05, 0.2)
"""Of the deepest pixel, from which the gel might be taken to be pressed as well."""


@dataclass(frozen=True, eq=False)
class ReadForce:
    """The force of one reading."""

    pressed: ContactForce  #: all but the reading's own error, of one press.
    reading: float  #: share of the force, one standard deviation: what the reading is off by.
    newtons: float  #: exactly 0 where nothing was seen to press.
    uncertainty: float  #: N, one standard deviation.


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
    """Look the force up in a measured table.

    Raises:
        WrongUse: there is no table.
    """
    if sensor_forces is None:
        raise WrongUse("touch.force=table needs forces that were measured; say --force-table FILE.json")
    return table_force(touch_height_map, sensor.pitch, sensor.gel_thickness, sensor_forces)


def pressed_of_gel(surface: FloatArray, share: float = OF_GEL) -> FloatArray:
    """How deep a gel is pressed where only its surface is known: what is deeper than a share of its deepest.

    The surface of a gel that is pressed lies where the object is, and what hangs beside it asks for no force;
    a drawn skirt would (``docs/explanation/touch_force.md`` has what the tenth costs).

    Args:
        surface: ``(rows, columns)`` metres of indentation.
        share: of the deepest pixel.
    """
    kept: FloatArray = np.where(surface > share * surface.max(), np.maximum(surface, 0.0), 0.0)
    return kept


def table_force(depth: FloatArray, pitch: float, thickness: float, table: ForceTable) -> ContactForce:
    """The force of each press by what was measured; where it acts is the middle of the volume taken.

    Args:
        depth: ``(n, rows, columns)`` metres, 0 or more: how deep the object reaches into the untouched gel.
        pitch: metres a pixel.
        thickness: metres of the gel.
        table: of that gel.

    Raises:
        OutOfDomain: as ``contact_force``, or a press beyond the table.
    """
    require_depths(depth, thickness)
    found = np.array([table.at(table.measure(each, pitch)) for each in depth]).reshape(-1, 2)
    newtons, sigma = found.T
    volume = depth.sum(axis=(1, 2)) * pitch**2
    # A table says how much, not where: as springs of one stiffness would share it.
    springs = np.divide(newtons, volume, out=np.zeros_like(newtons), where=volume > 0.0)
    shares = np.zeros((len(depth), len(PARTS)))
    scatter = np.divide(sigma, newtons, out=np.zeros_like(newtons), where=newtons > 0.0)
    shares[:, PARTS.index("theory")] = scatter
    return ContactForce.of(depth, springs[:, None, None] * depth, shares, pitch, thickness)


def read_force(
    read: DepthReading, thickness: float, gel: GelElastic, level: ForceLevel = "layer"
) -> ReadForce:
    """The force of a press that was read.

    Args:
        read: surface and error.
        thickness: metres of the gel.
        gel: how stiff it is.
        level: how it is computed; what the reading adds is computed by springs.

    Raises:
        OutOfDomain: the reading is deeper than the gel is thick.
    """
    surface = read.height if read.contact.any() else np.zeros_like(read.height)
    pressed = contact_force(pressed_of_gel(surface)[None], read.pitch, thickness, gel, level)
    newtons = float(pressed.newtons[0])
    if newtons == 0.0:
        return ReadForce(pressed, 0.0, 0.0, 0.0)

    def springs(depth: FloatArray) -> float:
        held = np.clip(depth, 0.0, thickness)
        return float(contact_force(held[None], read.pitch, thickness, gel, "winkler").newtons[0])

    middle = pressed_of_gel(surface)
    here = springs(middle)
    high, low = (springs(np.where(middle > 0.0, surface + by * read.sigma, 0.0)) for by in (1.0, -1.0))
    by_error = (high - low) / (2.0 * here)
    more, less = (springs(pressed_of_gel(surface, share)) for share in _OTHER_SHARES)
    reading = float(np.hypot(by_error, (more - less) / (2.0 * here)))
    return ReadForce(pressed, reading, newtons, float(np.hypot(pressed.uncertainty[0], newtons * reading)))
