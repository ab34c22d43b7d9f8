"""Codes of an object's surface: heights around its nodes, and the linear basis that keeps most of them.

The basis is that of the principal components. For a linear decoder and squared error no training can
find a better one (Eckart and Young, Psychometrika 1, 1936), and finding it takes seconds, so there is
nothing here to descend on.
"""

from dataclasses import dataclass

import numpy as np

from harness.authoring.touch.data import MOST_TILT
from harness.basics.arrays import BoolArray, ByteArray, FloatArray, IntArray
from harness.basics.errors import WrongUse
from harness.basics.geometry import inverse
from harness.bench.sensor import TactileSensor
from harness.objectfile.touch.graph import PatchCodes
from harness.objectfile.touch.nodes import BEND, SurfaceNodes
from harness.sim.gel.height_map import RasterMesh, height_maps

_MARGIN = 1.5e-3
"""m beyond window and spacing that a patch reaches: a leant ray wanders that far."""

_VISIBLE = 1e-4
"""m by which a node may lie behind what is met first: more, and something hides it."""

_RAYS = 3
"""Along each side of a patch's pixel, that say how much of it is covered; odd, so one is its middle."""

_CONTINUED = 2
"""Pixels that a surface is continued beyond its edge, so that a look-up at the edge mixes in nothing else."""

_CHUNK = 16


@dataclass(frozen=True)
class PatchSpec:
    """How surfaces are coded.

    Attributes:
        spacing: m between nodes.
        pitch: m, of a patch's pixels.
        width: numbers of a code; None for the heights themselves.
        learned: patches that the basis is found from, at most.
    """

    spacing: float
    pitch: float
    width: int | None = None
    learned: int = 2000


@dataclass(frozen=True, eq=False)
class CodedSurface:
    """Codes and where they belong.

    Attributes:
        nodes: those of a surface that a gel can come to.
        patches: their codes.
        kept: share of the variance of heights that the basis keeps.
    """

    nodes: SurfaceNodes
    patches: PatchCodes
    kept: float


def code_surface(
    raster: RasterMesh, nodes: SurfaceNodes, sensor: TactileSensor, spec: PatchSpec, seed: int
) -> CodedSurface:
    """Look at a surface from its nodes, and code what is seen.

    Args:
        raster: of the object.
        nodes: of its surface (``touch_data.choose_nodes`` with the same spacing).
        sensor: whose window the patches cover, however it is turned.
        spec: of patches and codes.
        seed: of the patches that the basis is found from.

    Raises:
        WrongUse: no node is to be seen.
    """
    viewer = _Viewer(raster, sensor, spec)
    seen = visible(raster, nodes)
    nodes = nodes[seen]
    if len(nodes) == 0:
        raise WrongUse("no place of the surface can be touched from outside; is the mesh inside out?")
    if spec.width is None:
        heights, cover = viewer.seen(nodes, np.arange(len(nodes)))
        mean = heights.mean(axis=0)
        return CodedSurface(nodes, viewer.patches(heights - mean, None, mean, cover), 1.0)
    chosen = np.sort(np.random.default_rng([seed, 7]).permutation(len(nodes))[: spec.learned])
    learned = viewer.seen(nodes, chosen)[0]
    mean = learned.mean(axis=0)
    basis, kept = principal(learned - mean, spec.width)
    codes = np.empty((len(nodes), len(basis)))
    cover = np.empty((len(nodes), len(mean)), np.uint8)
    for first in range(0, len(nodes), _CHUNK):
        part = np.arange(first, min(first + _CHUNK, len(nodes)))
        heights, cover[part] = viewer.seen(nodes, part)
        codes[part] = (heights - mean) @ basis.T
    return CodedSurface(nodes, viewer.patches(codes, basis, mean, cover), kept)


def patch_bytes(sensor: TactileSensor, spec: PatchSpec) -> float:
    """Bytes of one code in a file, in half precision; a basis is counted with the codes that share it."""
    pixels = np.pi * (_radius(sensor, spec) / spec.pitch) ** 2
    heights = pixels if spec.width is None else spec.width * (1.0 + pixels / spec.learned)
    return float(2.0 * heights + pixels)


def visible(raster: RasterMesh, nodes: SurfaceNodes) -> BoolArray:
    """``(n,)``: straight from outside, nothing of the object is in front of the node."""
    probe = TactileSensor("probe", 1, 1, 1e-6, 1.0)
    gap = height_maps(raster, inverse(nodes.object_from_node), probe)[:, 0, 0]
    seen: BoolArray = np.abs(gap) < _VISIBLE
    return seen


def principal(rows: FloatArray, width: int) -> tuple[FloatArray, float]:
    """``(k, pixels)`` orthonormal directions of greatest variance, and the share of it that they keep."""
    gram = rows @ rows.T
    values, vectors = np.linalg.eigh(gram)
    values = np.maximum(values[::-1], 0.0)
    k = max(1, min(width, int(np.count_nonzero(values > 1e-12 * max(values[0], 1e-300)))))
    basis = vectors[:, ::-1][:, :k].T @ rows
    lengths = np.linalg.norm(basis, axis=1, keepdims=True)
    # The sign of an eigenvector is the solver's whim; files are to be the same every time.
    signs = np.sign(basis[np.arange(k), np.abs(basis).argmax(axis=1)])[:, None]
    whole = float(values.sum())
    kept = float(values[:k].sum()) / whole if whole > 0.0 else 1.0
    directions: FloatArray = (
        basis * np.where(signs == 0.0, 1.0, signs) / np.where(lengths > 0.0, lengths, 1.0)
    )
    return directions, kept


class _Viewer:
    """Looks at a surface from its nodes, as far as a gel at any of them reaches."""

    def __init__(self, raster: RasterMesh, sensor: TactileSensor, spec: PatchSpec) -> None:
        radius = _radius(sensor, spec)
        size = 2 * int(np.ceil(radius / spec.pitch))
        at = (np.arange(size) + 0.5 - size / 2) * spec.pitch
        distance = np.hypot(at[None, :], at[:, None])
        self.inside = distance <= radius
        # What is farther from the tangent plane is out of reach of any gel, or in the way of every one.
        limit = sensor.gel_thickness + np.tan(MOST_TILT + spec.spacing / BEND) * distance
        self._limit, self.outside = limit[self.inside], float(limit[self.inside].max())
        fine = (np.arange(size * _RAYS) + 0.5 - size * _RAYS / 2) * spec.pitch / _RAYS
        slope = np.tan(MOST_TILT + spec.spacing / BEND)
        self._far = sensor.gel_thickness + slope * np.hypot(fine[None, :], fine[:, None])
        self._raster, self._size, self.pitch = raster, size, spec.pitch
        side = size * _RAYS
        self._camera = TactileSensor("patch", side, side, spec.pitch / _RAYS, sensor.gel_thickness)

    def seen(self, nodes: SurfaceNodes, which: IntArray) -> tuple[FloatArray, ByteArray]:
        """``(k, pixels)`` m over the tangent planes of some nodes, and how much is covered, of 255."""
        found = np.empty((len(which), len(self._limit)))
        cover = np.empty(found.shape, np.uint8)
        poses = inverse(nodes[which].object_from_node)
        for first in range(0, len(which), _CHUNK):
            part = slice(first, first + _CHUNK)
            gap = height_maps(self._raster, poses[part], self._camera)
            in_reach = gap < self._far
            blocks = in_reach.reshape(len(gap), self._size, _RAYS, self._size, _RAYS)
            share = blocks.mean(axis=(2, 4))[:, self.inside]
            cover[part] = np.rint(255.0 * share)
            middle = np.s_[:, _RAYS // 2 :: _RAYS, _RAYS // 2 :: _RAYS]
            whole = continued(np.where(in_reach[middle], gap[middle], np.nan), _CONTINUED)
            flat = whole[:, self.inside]
            found[part] = np.clip(np.where(np.isnan(flat), self._limit, flat), -self._limit, self._limit)
        return found, cover

    def patches(
        self, codes: FloatArray, basis: FloatArray | None, mean: FloatArray, cover: ByteArray
    ) -> PatchCodes:
        """Codes of what is seen."""
        return PatchCodes(codes, basis, mean, cover, self.inside, self.outside, self.pitch)


def continued(images: FloatArray, steps: int) -> FloatArray:
    """Heights continued straight beyond where they end, a pixel a step.

    Args:
        images: ``(n, rows, columns)``, NaN where there is none.
        steps: pixels.
    """
    images = images.copy()
    for _ in range(steps):
        padded = np.pad(images, ((0, 0), (2, 2), (2, 2)), constant_values=np.nan)
        rows, columns = images.shape[1:]
        total, weight = np.zeros_like(images), np.zeros_like(images)
        for i, j in ((-1, 0), (1, 0), (0, -1), (0, 1), (-1, -1), (-1, 1), (1, -1), (1, 1)):
            near = padded[:, 2 + i : 2 + i + rows, 2 + j : 2 + j + columns]
            next_one = padded[:, 2 + 2 * i : 2 + 2 * i + rows, 2 + 2 * j : 2 + 2 * j + columns]
            straight = 2.0 * near - next_one
            known = ~np.isnan(straight)
            total += np.where(known, straight, 0.0)
            weight += known
        fill = np.isnan(images) & (weight > 0.0)
        images[fill] = total[fill] / weight[fill]
    return images


def _radius(sensor: TactileSensor, spec: PatchSpec) -> float:
    return 0.5 * float(np.hypot(*sensor.window)) + spec.spacing + _MARGIN
