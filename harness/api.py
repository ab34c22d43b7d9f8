"""Touchstone from Python: the modes of a mesh, the tactile image of a press, an answer from a recording.

Lengths are metres, angles radians, frequencies hertz. What a function returns says what it took in seconds.
``examples/`` shows each of them in a script.
"""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from harness.basics.materials import Material
    from harness.effects.touch_press import Press
    from harness.sim.modal.file import FileModes

__all__ = ["answer", "modes", "tactile_image"]


def modes(
    mesh: str | Path,
    material: "str | Material",
    units: str | None = None,
    up_to: float | None = None,
    count: int | None = None,
    edge: float | None = None,
    up_axis: str | None = None,
    wall: float | None = None,
    envelope: float | None = None,
    fixed: Sequence[str] = (),
) -> "FileModes":
    """Solve the free vibration of an object.

    Args:
        mesh: file of a closed surface or of tetrahedra, or ``"builtin:mug"``.
        material: name such as ``"steel"``, ``"ceramic"`` or ``"glass"``, or a ``Material``.
        units: unit of the file's coordinates, ``"m"``, ``"cm"``, ``"mm"`` or ``"in"``; None to detect it.
        up_to: highest frequency in Hz; None for the upper limit of hearing, or for ``count`` alone.
        count: number of modes, the lowest.
        edge: longest edge of an element in m; chosen by the shortest wavelength if None.
        up_axis: axis of the file that points up, "x", "y" or "z"; None for the one that it declares, else z.
        wall: wall thickness in m of a hollow object of which the file has the outside; not for tetrahedra.
        envelope: largest distance in m of an element from the surface; not for tetrahedra.
        fixed: sides of the object ("x-min", ..., "z-max") or sets of nodes that the file names, held in all
            axes or, e.g. "z-min:z", in the axes after the colon.

    Returns:
        Frequencies in Hz and dampings in 1/s, whether it is certain that none is missing (``certified``), the
        modes with their shapes (``solution``), and ``seconds`` by stage. Tetrahedra are kept in the cache.

    Raises:
        MeshRefused: the surface cannot be filled.
        WrongUse: an unknown material, no such file, units that are not clear, or options that conflict.
    """
    from harness.basics.materials import material as named
    from harness.basics.store import Store, default_folder
    from harness.sim.modal.file import modes_of_file

    return modes_of_file(
        str(mesh),
        named(material) if isinstance(material, str) else material,
        units,
        wall=wall,
        limit=up_to,
        count=count,
        edge=edge,
        fixed=fixed,
        store=Store(default_folder()),
        envelope=envelope,
        up_axis=up_axis,
    )


def tactile_image(
    mesh: str | Path,
    contact: Sequence[float],
    depth: float = 1e-3,
    tilt: float = 0.0,
    units: str | None = None,
    sensor: str | None = None,
    calibration: str | None = None,
    up_axis: str | None = None,
) -> "Press":
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
    from harness.bench.scene import scene_from_options
    from harness.effects.scene_object import known_object
    from harness.effects.touch_press import press_mesh
    from harness.objects.builtin import BUILTIN
    from harness.sim.gel.press_pose import contact_place, gel_from_object
    from harness.sim.optics.known_gel import known_gel

    material = None if str(mesh).startswith(BUILTIN) else "steel"  # touch does not depend on it
    scene = scene_from_options(str(mesh), material, units, up_axis=up_axis)
    gel, known = known_gel(sensor, calibration), known_object(scene)
    place = contact_place(known.mesh, np.asarray(contact, dtype=np.float64))
    pose = gel_from_object(place, depth, tilt, 0.0, 0.0, gel.sensor.gel_thickness)
    return press_mesh({"object.mesh": known.mesh, "contact.gel_from_object": pose[None]}, gel, scene)


def answer(run: str | Path, levels: Sequence[str] = ()) -> dict[str, Any]:
    """What a recorded run says; no bench is opened and nothing is written.

    Args:
        run: its folder.
        levels: dials turned from their defaults, ``"localization.method=particle"``.

    Returns:
        The result as ``result.json`` has it, without the report.

    Raises:
        WrongUse: no run, a calibration's run, or an unknown dial.
        RecordingDamaged: a step or a file of it is not what was recorded.
        FitRefused: nothing explains the readings.
    """
    from harness.experiment.answer import common, score
    from harness.experiment.levels import chosen_levels
    from harness.experiment.lookup import experiment_of
    from harness.recording.recording import Recording
    from harness.recording.run_folder import RunFiles

    recording = Recording(Path(run))
    experiment = experiment_of(recording)
    accuracy = chosen_levels(experiment.knobs, levels, RunFiles(recording).network_levels)
    scored = score(experiment, recording, accuracy)
    return {**common(experiment, scored), **scored.result}
