"""The dots printed on a gel: how a press moves them, and how they look.

Loads that press the gel as deep as the object reaches, found at the nodes of a coarse grid, move each
dot by the sum of their kernels (the superposition of Taxim, Si and Yuan, 2022, section III-D, with
the kernel of an elastic layer). The theory is linear and the contact without friction: no shear, no twist.
"""

import numpy as np
from scipy.linalg import cholesky, solve_triangular
from scipy.optimize import nnls

from harness.basics.arrays import ByteArray, FloatArray, read_only
from harness.basics.errors import OutOfDomain, WrongUse
from harness.bench.sensor import MarkerGrid, TactileSensor
from harness.sim.gel.marker_kernel import LayerKernel, layer_kernel

INK = 0.15
"""Share of the light that a printed dot gives back; a black print, not measured on a sensor."""

NODES_PER_THICKNESS = 4.0
"""Nodes of the load grid to one thickness of the gel: nothing finer reaches the dots beside it."""


def rest_markers(sensor: TactileSensor) -> FloatArray:
    """``(markers, 2)`` metres, x and y in ``gel``: the untouched dots, row by row, centred.

    Raises:
        WrongUse: the gel has none.
    """
    grid = _grid(sensor)
    x = (np.arange(grid.columns) - (grid.columns - 1) / 2.0) * grid.spacing
    y = (np.arange(grid.rows) - (grid.rows - 1) / 2.0) * grid.spacing
    return read_only(np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2))


def marker_displacements(
    penetration: FloatArray,
    sensor: TactileSensor,
    nodes_per_thickness: float = NODES_PER_THICKNESS,
    rest: FloatArray | None = None,
) -> FloatArray:
    """How far each dot is from its place at rest.

    Args:
        penetration: ``(n, rows, columns)`` metres, 0 or more: how deep the object reaches.
        sensor: with markers.
        nodes_per_thickness: of the load grid.
        rest: ``(markers, 2)`` metres, x and y in ``gel``: the untouched dots as they were measured; the
            sensor's centred grid where None.

    Returns:
        ``(n, markers, 2)`` metres, x and y in ``gel``; exactly zero without contact.

    Raises:
        OutOfDomain: another shape than the sensor's, or a penetration that is negative or not finite.
        WrongUse: a gel without markers.
    """
    if penetration.ndim != 3 or penetration.shape[1:] != (sensor.rows, sensor.columns):
        raise OutOfDomain(
            f"penetrations are {penetration.shape}; this sensor's are (n, {sensor.rows}, {sensor.columns})"
        )
    if not (np.isfinite(penetration).all() and (penetration >= 0.0).all()):
        raise OutOfDomain("a penetration is negative or not finite; pass gaps through height_map.penetration")
    dots = rest_markers(sensor) if rest is None else rest
    block = max(1, round(sensor.gel_thickness / (nodes_per_thickness * sensor.pitch)))
    reach = float(np.hypot(*sensor.window)) + float(np.hypot(*dots.T).max())
    kernel = layer_kernel(sensor.gel_thickness, block * sensor.pitch / 2.0, reach)
    moved = np.zeros((len(penetration), len(dots), 2))
    for n, pressed in enumerate(penetration):
        if pressed.any():
            moved[n] = _moved(pressed, dots, sensor, block, kernel)
    return read_only(moved)


def draw_markers(
    images: ByteArray,
    displacements: FloatArray,
    sensor: TactileSensor,
    ink: float = INK,
    rest: FloatArray | None = None,
) -> ByteArray:
    """Print the dots over pictures: round, antialiased, each moved as a whole.

    Args:
        images: ``(n, rows, columns, 3)`` of a gel without dots.
        displacements: ``(n, markers, 2)`` metres.
        sensor: with markers.
        ink: share of the light that a dot gives back.
        rest: as for ``marker_displacements``; their radius is the sensor's.

    Returns:
        The pictures; a pixel that no dot touches is the same to the bit.

    Raises:
        OutOfDomain: shapes that disagree, displacements that are not finite, or an ink outside 0 to 1.
        WrongUse: a gel without markers.
    """
    dots = rest_markers(sensor) if rest is None else rest
    if images.shape[1:] != (sensor.rows, sensor.columns, 3):
        raise OutOfDomain(f"pictures are {images.shape}, not (n, {sensor.rows}, {sensor.columns}, 3)")
    if displacements.shape != (len(images), *dots.shape) or not np.isfinite(displacements).all():
        raise OutOfDomain(
            f"displacements are {displacements.shape}, not finite or not {(len(images), *dots.shape)}"
        )
    if not 0.0 <= ink <= 1.0:
        raise OutOfDomain(f"an ink that gives back {ink!r} of the light; give 0 to 1")
    drawn = images.copy()
    for n in range(len(images)):
        cover = _coverage(dots + displacements[n], sensor)
        under = cover > 0.0
        drawn[n][under] = np.rint(images[n][under] * (1.0 - (1.0 - ink) * cover[under])[:, None])
    return read_only(drawn)


def _grid(sensor: TactileSensor) -> MarkerGrid:
    if sensor.markers is None:
        raise WrongUse(f"the gel of {sensor.name} has no markers; give the sensor a MarkerGrid")
    return sensor.markers


def _moved(
    pressed: FloatArray, dots: FloatArray, sensor: TactileSensor, block: int, kernel: LayerKernel
) -> FloatArray:
    nodes, depth = _nodes(pressed, sensor, block)
    load = _loads(kernel.inwards(_distance(nodes, nodes)), depth)
    apart = dots[:, None] - nodes[None]
    distance = np.hypot(apart[..., 0], apart[..., 1])
    per_metre = np.divide(
        kernel.outwards(distance), distance, where=distance > 0.0, out=np.zeros_like(distance)
    )
    moved: FloatArray = np.einsum("mkc,mk,k->mc", apart, per_metre, load)
    return moved


def _nodes(pressed: FloatArray, sensor: TactileSensor, block: int) -> tuple[FloatArray, FloatArray]:
    """``(k, 2)`` and ``(k,)`` metres: the blocks of pixels that the object reaches, and its mean depth."""
    starts = [np.arange(0, size, block) for size in pressed.shape]
    sums = np.add.reduceat(np.add.reduceat(pressed, starts[0], axis=0), starts[1], axis=1)
    sizes = [np.diff(np.append(start, size)) for start, size in zip(starts, pressed.shape, strict=True)]
    depth = sums / np.outer(*sizes)
    y, x = (
        (start + wide / 2.0 - size / 2.0) * sensor.pitch
        for start, wide, size in zip(starts, sizes, pressed.shape, strict=True)
    )
    rows, columns = np.nonzero(depth > 0.0)
    return np.stack([x[columns], y[rows]], axis=-1), depth[rows, columns]


def _distance(a: FloatArray, b: FloatArray) -> FloatArray:
    apart: FloatArray = np.hypot(*(a[:, None] - b[None]).transpose(2, 0, 1))
    return apart


def _loads(gives: FloatArray, depth: FloatArray) -> FloatArray:
    """Loads that push and never pull, and hold every node at its depth or beyond.

    The least of ``load gives load / 2 - load depth`` over loads of zero or more (Kalker's principle;
    Johnson, 1985, section 5.9), as non-negative least squares through the Cholesky factor.
    """
    factor = cholesky(gives, lower=True)
    load, _ = nnls(factor.T, solve_triangular(factor, depth, lower=True), maxiter=10 * len(depth) + 100)
    found: FloatArray = load
    return found


def _coverage(centres: FloatArray, sensor: TactileSensor) -> FloatArray:
    """``(rows, columns)`` the share of each pixel under a dot, from its distance to the dot's edge."""
    radius = _grid(sensor).radius / sensor.pitch
    cover = np.zeros((sensor.rows, sensor.columns))
    shift = np.array([sensor.columns, sensor.rows]) / 2.0 - 0.5
    for x, y in centres / sensor.pitch + shift:
        top, left = max(0, int(np.floor(y - radius))), max(0, int(np.floor(x - radius)))
        here = cover[top : max(0, int(y + radius) + 2), left : max(0, int(x + radius) + 2)]
        i, j = np.ogrid[top : top + here.shape[0], left : left + here.shape[1]]
        edge = radius - np.hypot(i - y, j - x)
        np.maximum(here, np.clip(0.5 + edge, 0.0, 1.0), out=here)
    return cover
