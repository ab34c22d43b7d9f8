"""The modes of a scene's object out of its ObjectFile: levels of what finite elements solve for.

What is handed on is what ``harness.sim.modal.modal.modes_of`` would have found for the same object: the
lowest modes asked for, up to the limit of hearing, their shapes at the nodes of a surface fine enough
to be linear between them. Nothing is meshed and nothing is solved.
"""

import time
from dataclasses import replace

import numpy as np

from harness.basics.errors import DataRefused, WrongUse
from harness.basics.materials import Material
from harness.basics.mesh import Mesh
from harness.objectfile.audio.audio import AudioLevel, open_audio
from harness.objectfile.entries import AudioEntry
from harness.objectfile.file import ObjectFile
from harness.objectfile.same_object import require_same
from harness.objectfile.surface_file import mesh_from_ply
from harness.sim.modal.modal import default_edge
from harness.sim.modal.modes import Modes, dampings
from harness.sim.solid.filled import with_edges_below

_SAME = 5e-5
"""Relative distance of frequencies that are not parted: as the solver has it of their squares, 1e-4."""

_SPARE = 8
"""Modes that a solver may have left out of those asked for, so as not to part one frequency."""

_DAMPING = 1e-6
"""Relative, by which dampings may differ from those of alpha and beta: more than JSON rounds them by."""


def modes_from(
    of: ObjectFile, level: AudioLevel, surface: Mesh, material: Material, most: int, limit: float
) -> Modes:
    """The modes of an object, as its ObjectFile has them.

    Args:
        of: of this object.
        level: where the shapes come from.
        surface: of the object's material, in metres.
        material: it is made of.
        most: modes at most, the lowest; fewer where that would part modes of one frequency.
        limit: Hz; modes above it are left out.

    Raises:
        WrongUse: an ObjectFile of another object or material, or of fewer modes; what differs is said.
        DataRefused: it has no sound, or not at that level; or a file of it is damaged.
    """
    begun, entry = time.perf_counter(), of.description.audio
    if entry is None:
        raise DataRefused(
            f"{of.folder} has no sound; add it with `touchstone object build --only audio`, or take "
            "sound.shapes = elements"
        )
    require_same(of, surface, material)
    _require_dampings(of, entry, material)
    count = _count(of, entry, most, limit)
    sound = open_audio(of, level)
    nodes: Mesh | None = None
    # A network is evaluated at the table's nodes, which are those of the elements; without a table at the
    # vertices of the object's mesh, whose faces are divided as finely as elements would be.
    if level == "network" and entry.table is not None:
        nodes = mesh_from_ply(of.read(entry.table.surface), entry.table.surface.file)
    elif level == "network":
        nodes = with_edges_below(of.mesh, default_edge(of.mesh, of.material, entry.frequencies_hz[-1]))
    modes = sound.as_modes(nodes)
    reached = min(modes.limit, limit)
    if count < len(modes.frequencies) and modes.frequencies[count] <= limit:
        reached = float(0.5 * (modes.frequencies[count - 1] + modes.frequencies[count]))
    lowest = np.ascontiguousarray(modes.shapes[:, :count])
    seconds = {"objectfile": time.perf_counter() - begun}
    return replace(
        modes, frequencies=modes.frequencies[:count], shapes=lowest, limit=reached, seconds=seconds
    )


def _require_dampings(of: ObjectFile, entry: AudioEntry, material: Material) -> None:
    wanted = dampings(np.array(entry.frequencies_hz), material)
    apart = np.abs(np.array(entry.dampings_per_s) - wanted) > _DAMPING * np.maximum(wanted, 1e-12)
    if apart.any():
        first = int(np.argmax(apart))
        raise WrongUse(
            f"{of.folder}: mode {first + 1} of {entry.frequencies_hz[first]:.5g} Hz decays at "
            f"{entry.dampings_per_s[first]:.5g} 1/s, and with the alpha and beta of {material.name} at "
            f"{wanted[first]:.5g}; a scene has the dampings of its material: build the object again, or "
            "take sound.shapes = elements"
        )


def _count(of: ObjectFile, entry: AudioEntry, most: int, limit: float) -> int:
    """Return the number of modes to use; ``WrongUse`` if the object was built with fewer than requested."""
    frequencies = np.array(entry.frequencies_hz)
    heard = int(np.count_nonzero(frequencies <= limit))
    if heard == len(frequencies) and entry.complete_up_to_hz < limit and heard + _SPARE < most:
        raise WrongUse(
            f"{of.folder} has {heard} modes, complete up to {entry.complete_up_to_hz:.5g} Hz, where {most} "
            f"up to {limit:g} Hz are asked for; take sound.modes of at most {heard}, or build it again "
            f"with --modes {most}"
        )
    count = min(most, heard)
    while 0 < count < len(frequencies) and (
        frequencies[count] - frequencies[count - 1] <= _SAME * frequencies[count]
    ):
        count -= 1
    return count or min(most, heard)
