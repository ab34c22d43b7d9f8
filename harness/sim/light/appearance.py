"""How an object's surface looks under light: matt, of a colour at every place, smooth where meant so."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from harness.basics.arrays import ByteArray, FloatArray, IntArray, read_only
from harness.basics.compiled import compiled
from harness.basics.errors import DataRefused, MeshRefused, OutOfDomain
from harness.basics.mesh import Mesh
from harness.picture.srgb import LINEAR_OF_BYTE

CREASE = float(np.radians(35.0))
"""rad: faces that meet at less are facets of one smooth surface, as rounded rims are; at more, an edge."""

NO_TEXTURE = -1


@dataclass(frozen=True, eq=False)
class Appearance:
    """A surface in metres and the share of light that it reflects, the same to all sides (Lambert).

    The albedo of a place is the corners' tints, interpolated, times the texture there, interpolated
    between texel centres in linear light. Textures repeat.
    """

    mesh: Mesh  #: in metres, in the object's frame; need not be closed.
    normals: FloatArray  #: ``(m, 3, 3)`` unit, of each face's corners, outward: what the shading follows.
    tints: FloatArray  #: ``(m, 3, 3)`` linear red, green, blue of each face's corners, 0 to 1.
    places: FloatArray
    """``(m, 3, 2)`` (u, v) in the texture of each face's corners: u right, v up, 1 is its side."""
    texture_of: IntArray  #: ``(m,)`` index of each face's texture; -1 where it has none.
    textures: tuple[ByteArray, ...] = ()  #: ``(rows, columns, 3)`` sRGB of 8 bits.
    remarks: tuple[str, ...] = ()  #: what was assumed, and what in the file was not followed.

    def __post_init__(self) -> None:
        count = len(self.mesh.faces)
        for name, shape in (("normals", (3, 3)), ("tints", (3, 3)), ("places", (3, 2)), ("texture_of", ())):
            dtype = np.int64 if name == "texture_of" else np.float64
            given = np.array(self.__dict__[name], dtype=dtype)
            if given.shape != (count, *shape) or not np.all(np.isfinite(given)):
                raise DataRefused(
                    f"{name} of an appearance are {given.shape}, and its mesh has {count} faces; "
                    f"give finite {(count, *shape)}"
                )
            object.__setattr__(self, name, read_only(given))
        if self.tints.size and not (self.tints.min() >= 0.0 and self.tints.max() <= 1.0):
            raise DataRefused(
                f"tints are from {self.tints.min():g} to {self.tints.max():g}; a surface reflects 0 to 1"
            )
        named = self.texture_of
        if named.size and not (named.min() >= NO_TEXTURE and named.max() < len(self.textures)):
            raise DataRefused(
                f"faces name textures {named.min()} to {named.max()}, of {len(self.textures)} there are"
            )
        for texture in self.textures:
            if texture.ndim != 3 or texture.shape[2] != 3 or texture.dtype != np.uint8 or texture.size == 0:
                raise DataRefused(
                    f"a texture is {texture.dtype} {texture.shape}; give uint8 (rows, columns, 3)"
                )

    def albedo(self, faces: IntArray, weights: FloatArray) -> FloatArray:
        """The share of light that places of the surface reflect.

        Args:
            faces: ``(n,)`` indices.
            weights: ``(n, 2)`` of the second and third corner.

        Returns:
            ``(n, 3)`` linear, 0 to 1.

        Raises:
            OutOfDomain: a face that there is not.
        """
        self.require_faces(faces)
        texels, table = self._packed
        return albedo_at(
            faces, weights, self.tints, self.places, self.texture_of, texels, table, LINEAR_OF_BYTE
        )

    def require_faces(self, faces: IntArray) -> None:
        """Raise ``OutOfDomain`` where one of ``(n,)`` indices is of no face."""
        count = len(self.mesh.faces)
        if faces.size and not (faces.min() >= 0 and faces.max() < count):
            raise OutOfDomain(
                f"faces {faces.min()} to {faces.max()} were asked for, of {count}; "
                "leave out rays that met none"
            )

    @cached_property
    def _packed(self) -> tuple[ByteArray, IntArray]:
        """All texels one after the other, and where each texture begins, its rows and its columns."""
        sizes = [(texture.shape[0], texture.shape[1]) for texture in self.textures]
        starts = np.cumsum([0, *(rows * columns for rows, columns in sizes)])[:-1]
        table = np.array([(s, *size) for s, size in zip(starts, sizes, strict=True)], np.int64).reshape(-1, 3)
        texels = [texture.reshape(-1, 3) for texture in self.textures]
        return np.vstack([np.zeros((0, 3), np.uint8), *texels]), table


def smooth_normals(mesh: Mesh, crease: float = CREASE) -> FloatArray:
    """Normals of every face's corners: the mean of the neighbours' that are no edge away.

    Neighbours share the corner's place, so that a seam of a texture does not show. They count by their
    area times their angle there: a large flat face beside a narrow fillet stays flat.

    Args:
        mesh: any.
        crease: rad; zero leaves every face flat.

    Returns:
        ``(m, 3, 3)`` unit; zero for a face without area.

    Raises:
        OutOfDomain: an angle outside 0 to pi.
        MeshRefused: a corner that is not finite.
    """
    if not np.all(np.isfinite(mesh.corners)):
        raise MeshRefused(
            f"a mesh of {len(mesh.faces)} faces has corners that are not finite numbers; repair it first"
        )
    if not 0.0 <= crease <= np.pi:
        raise OutOfDomain(f"a crease of {np.degrees(crease):g} deg was asked for; give 0 to 180 deg")
    if crease == 0.0:
        return np.repeat(mesh.face_normals[:, None], 3, axis=1)
    _, place_of = np.unique(mesh.vertices, axis=0, return_inverse=True)
    at = place_of.reshape(-1)[mesh.faces]
    order = np.argsort(at.ravel(), kind="stable")
    starts = np.searchsorted(at.ravel()[order], np.arange(at.max() + 2))
    edges = np.roll(mesh.corners, -1, axis=1) - mesh.corners
    back = -np.roll(edges, 1, axis=1)
    sine = np.linalg.norm(np.cross(edges, back), axis=2)
    angle = np.arctan2(sine, np.einsum("mcx,mcx->mc", edges, back))
    weights: FloatArray = mesh.face_areas[:, None] * angle
    return smoothed_normals(at, order // 3, starts, mesh.face_normals, weights, float(np.cos(crease)))


def plain(mesh: Mesh, albedo: tuple[float, float, float], crease: float = CREASE) -> Appearance:
    """A surface of one linear albedo; errors as of ``Appearance`` and ``smooth_normals``."""
    count = len(mesh.faces)
    return Appearance(
        mesh,
        smooth_normals(mesh, crease),
        np.broadcast_to(np.array(albedo, np.float64), (count, 3, 3)),
        np.zeros((count, 3, 2)),
        np.full(count, NO_TEXTURE),
    )


@compiled
def smoothed_normals(
    at: IntArray,
    faces_at: IntArray,
    starts: IntArray,
    normals: FloatArray,
    weights: FloatArray,
    least_cosine: float,
) -> FloatArray:
    """Mean normals at every face's corners.

    Args:
        at: ``(m, 3)`` the place of each corner.
        faces_at: faces by place: place p has those of ``starts[p]`` to ``starts[p + 1]``.
        starts: ``(places + 1,)``.
        normals: ``(m, 3)`` unit, of faces.
        weights: ``(m, 3)`` how much a face counts at each of its corners.
        least_cosine: of the angle between two faces that are one surface.

    Returns:
        ``(m, 3, 3)`` unit; the face's own where the mean has no direction.
    """
    smooth = np.empty((len(at), 3, 3))
    for f in range(len(at)):
        for corner in range(3):
            total = np.zeros(3)
            place = at[f, corner]
            for k in range(starts[place], starts[place + 1]):
                g = faces_at[k]
                if g != f and np.sum(normals[f] * normals[g]) < least_cosine:
                    continue
                for other in range(3):
                    if at[g, other] == place:
                        total += weights[g, other] * normals[g]
            length = np.sqrt(np.sum(total * total))
            smooth[f, corner] = total / length if length > 0.0 else normals[f]
    return smooth


@compiled
def albedo_at(
    faces: IntArray,
    weights: FloatArray,
    tints: FloatArray,
    places: FloatArray,
    texture_of: IntArray,
    texels: ByteArray,
    table: IntArray,
    linear: FloatArray,
) -> FloatArray:
    """Tint times texture at places of the surface; see ``Appearance``.

    Args:
        faces: ``(n,)``.
        weights: ``(n, 2)`` of the second and third corner.
        tints: of the appearance, and so are ``places`` and ``texture_of``.
        places: see ``Appearance``.
        texture_of: see ``Appearance``.
        texels: ``(texels, 3)`` of all textures, one after the other.
        table: ``(textures, 3)`` first texel, rows, columns.
        linear: ``(256,)`` light of each grey level.

    Returns:
        ``(n, 3)`` linear.
    """
    out = np.empty((len(faces), 3))
    for n in range(len(faces)):
        f = faces[n]
        b, c = weights[n, 0], weights[n, 1]
        a = 1.0 - b - c
        for channel in range(3):
            out[n, channel] = a * tints[f, 0, channel] + b * tints[f, 1, channel] + c * tints[f, 2, channel]
        texture = texture_of[f]
        if texture >= 0:
            u = a * places[f, 0, 0] + b * places[f, 1, 0] + c * places[f, 2, 0]
            v = a * places[f, 0, 1] + b * places[f, 1, 1] + c * places[f, 2, 1]
            _tint(out[n], u, v, texels, table[texture], linear)
    return out


@compiled
def _tint(
    colour: FloatArray, u: float, v: float, texels: ByteArray, where: IntArray, linear: FloatArray
) -> None:
    """Multiply by the texture at (u, v): between the four nearest texel centres, repeated beyond the edge."""
    first, rows, columns = where
    x = (u - np.floor(u)) * columns - 0.5
    y = (1.0 - (v - np.floor(v))) * rows - 0.5
    left, top = int(np.floor(x)), int(np.floor(y))
    right_share, low_share = x - left, y - top
    for channel in range(3):
        total = 0.0
        for i in range(2):
            row = (top + i) % rows
            for j in range(2):
                texel = first + row * columns + (left + j) % columns
                share = (low_share if i else 1.0 - low_share) * (right_share if j else 1.0 - right_share)
                total += share * linear[texels[texel, channel]]
        colour[channel] *= total
