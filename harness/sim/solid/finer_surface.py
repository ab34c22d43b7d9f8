"""A surface with shorter edges, for fields that are linear between its vertices."""

from harness.basics.errors import WrongUse
from harness.basics.mesh import Mesh

_HALVINGS = 12
"""Of one edge at most: 4096 parts of it, finer than any field here needs."""


def with_edges_below(mesh: Mesh, longest: float) -> Mesh:
    """The same surface, its edges halved until none is longer; a watertight surface stays watertight.

    Args:
        mesh: in metres.
        longest: m, of any edge; above zero, and no less than 1/4096 of the longest one there is.

    Returns:
        The mesh itself where all its edges are short enough.

    Raises:
        WrongUse: a length outside of that range.
    """
    greatest = _longest_edge(mesh)
    if not longest > greatest * 2.0**-_HALVINGS:
        raise WrongUse(
            f"edges of {greatest:.3g} m cannot be divided into parts of {longest!r} m; give a length above "
            f"{greatest * 2.0**-_HALVINGS:.3g} m"
        )
    if greatest <= longest:
        return mesh
    # Loaded by those alone whose mesh is too coarse.
    from trimesh.remesh import subdivide_to_size

    vertices, faces = subdivide_to_size(  # type: ignore[no-untyped-call]
        mesh.vertices, mesh.faces, longest, max_iter=2 * _HALVINGS
    )
    return Mesh(vertices, faces)


def _longest_edge(mesh: Mesh) -> float:
    ahead = mesh.corners[:, (1, 2, 0)]
    return float(((ahead - mesh.corners) ** 2).sum(axis=2).max() ** 0.5)
