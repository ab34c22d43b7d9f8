"""The tactile image of a press on a mesh."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from harness.bench.scene import scene_from_options
from harness.effects.scene_object import known_object
from harness.effects.touch_press import Press, press_gel
from harness.objects.builtin import BUILTIN
from harness.sim.gel.press_pose import contact_place, gel_from_object
from harness.sim.optics.known_gel import known_gel


def tactile_image(
    mesh: str | Path,
    contact: Sequence[float],
    depth: float = 1e-3,
    tilt: float = 0.0,
    units: str | None = None,
    sensor: str | None = None,
    calibration: str | None = None,
    up_axis: str | None = None,
) -> Press:
    """What a tactile camera sees of a press.

    Args:
        mesh: a file, or ``"builtin:mug"``.
        contact: x, y, z in m in the object's frame, on its surface or within a few mm.
        depth: m that the object reaches into the gel.
        tilt: rad of the tool away from the surface's normal.
        units: of the file's numbers.
        sensor: a make, or the path of a sensor's own file; ``"gelsight-r1.5"`` if None.
        calibration: of its colours; the make's own if None.
        up_axis: axis of the file that points up; None for the one that it declares, else z.

    Returns:
        ``image`` ``(rows, columns, 3)`` RGB, ``surface`` of the gel in m, ``evaluation.seconds`` by effect.

    Raises:
        OutOfDomain: the contact is off the surface, or the press is deeper than the gel.
        CalibrationRefused: there is no calibration for this sensor.
    """
    material = None if str(mesh).startswith(BUILTIN) else "steel"  # touch does not depend on it
    scene = scene_from_options(str(mesh), material, units, up_axis=up_axis)
    gel, known = known_gel(sensor, calibration), known_object(scene)
    place = contact_place(known.mesh, np.asarray(contact, dtype=np.float64))
    pose = gel_from_object(place, depth, tilt, 0.0, 0.0, gel.sensor.gel_thickness)
    return press_gel({"object_mesh": known.mesh, "contact_gel_from_object": pose[None]}, gel, scene)
