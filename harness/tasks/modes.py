"""The modes of an object, as ``touchstone sim modes`` gives them."""

from collections.abc import Sequence
from pathlib import Path

from harness.basics.materials import Material
from harness.basics.materials import material as named
from harness.basics.store import Store, default_folder
from harness.sim.modal.file import FileModes, modes_of_file


def modes(
    mesh: str | Path,
    material: str | Material,
    units: str | None = None,
    up_to: float | None = None,
    count: int | None = None,
    edge: float | None = None,
    up_axis: str | None = None,
    wall: float | None = None,
    envelope: float | None = None,
    fixed: Sequence[str] = (),
) -> FileModes:
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
