"""The dots printed on a gel: how a press moves them, and how they look.

Loads that press the gel as deep as the object reaches, found at the nodes of a coarse grid, move each
dot by the sum of their kernels (the superposition of Taxim, Si and Yuan, 2022, section III-D, with
the kernel of an elastic layer). The theory is linear and the contact without friction: no shear, no twist.

How the surface of a gel gives under a push: an incompressible elastic layer on a rigid plate.

On an incompressible half-space a normal push moves the surface straight down and not sideways:
the radial term of Boussinesq's solution carries a factor 1 - 2 nu (Johnson, Contact Mechanics,
1985, section 3.2). What moves a gel's dots is that the gel is thin and sticks to its plate: what is
pushed away must go outwards (the thin limit is in Johnson, section 5.8). So the kernel is that of
the layer, which contains both limits. Stokes' stream function, clamped at the plate and free of shear at
the surface, gives for a pressure ``p cos(k x)`` on a layer of thickness h, with q = k h and shear modulus G:

    into the gel   p / (2 G k) (sinh 2q - 2q) / (cosh 2q + 1 + 2 q^2) cos(k x)
    outwards       p / (2 G k) 2 q^2          / (cosh 2q + 1 + 2 q^2) sin(k x)

A push on a spot is the Hankel transform of these. The modulus only scales the load, and cancels
where the load follows from the depth.

A sensor's description has a grid of dots, centred and straight (``harness.bench.sensor.MarkerGrid``). A
print is off by a pixel, turned by a degree, and a dot is missing here and there; this file has every dot of
the very gel.
"""

from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from pydantic import Field
from scipy.interpolate import CubicSpline
from scipy.linalg import cholesky, solve_triangular
from scipy.optimize import nnls
from scipy.special import j0, j1

from harness.basics.arrays import ByteArray, FloatArray, read_only
from harness.basics.errors import OutOfDomain, WrongUse
from harness.basics.files.json_file import read_model
from harness.basics.toml_file import StrictModel
from harness.bench.sensor import MarkerGrid, TactileSensor

Finite = Annotated[float, Field(allow_inf_nan=False)]
Above = Annotated[float, Field(gt=0.0, allow_inf_nan=False)]
Count = Annotated[int, Field(gt=0)]


class MarkerDot(StrictModel):
    """One dot of a resting gel."""

    row: Annotated[int, Field(ge=0)]  #: of the grid, downwards from 0.
    column: Annotated[int, Field(ge=0)]  #: of the grid, to the right from 0.
    x_px: Finite  #: pixels, column of its middle in the picture.
    y_px: Finite  #: pixels, row.
    sigma_px: Above  #: pixels, one standard uncertainty of either.
    radius_px: Above  #: pixels.


class MarkerFile(StrictModel):
    """Every dot of a gel."""

    schema_number: Literal[1] = Field(alias="schema")  #: of the file.
    sensor: str  #: make.
    serial: str  #: of the very gel.
    made_from: str  #: the pictures, by their hash.
    picture_rows: Count  #: pixels.
    picture_columns: Count  #: pixels.
    pitch_m: Above | None  #: m a pixel; None where nothing told it.
    ink: Annotated[float, Field(ge=0.0, le=1.0)]  #: share of the light that a dot gives back.
    rows: Count  #: of the grid.
    columns: Count  #: of the grid.
    spacing_px: Above  #: pixels from dot to dot.
    turned_rad: Finite  #: rad, of the grid's rows in the picture.
    dots: Annotated[list[MarkerDot], Field(min_length=1)]  #: those that are in the picture.

    @property
    def places(self) -> FloatArray:
        """``(dots, 2)`` pixels (column, row)."""
        return read_only(np.array([(dot.x_px, dot.y_px) for dot in self.dots]))

    @property
    def radius(self) -> float:
        """Median over the dots in pixels."""
        return float(np.median([dot.radius_px for dot in self.dots]))

    def in_gel(self, pitch: float | None = None) -> FloatArray:
        """``(dots, 2)`` metres, x and y in ``gel``.

        Args:
            pitch: m a pixel, where the file has none or another is wanted.

        Raises:
            OutOfDomain: no pitch is known.
        """
        scale = self._pitch(pitch)
        middle = 0.5 * np.array([self.picture_columns, self.picture_rows]) - 0.5
        return read_only((self.places - middle) * scale)

    def grid(self, pitch: float | None = None) -> MarkerGrid:
        """The centred, straight grid that comes nearest, for a sensor's description; raises as ``in_gel``."""
        scale = self._pitch(pitch)
        return MarkerGrid(self.rows, self.columns, self.spacing_px * scale, self.radius * scale)

    def _pitch(self, pitch: float | None) -> float:
        scale = self.pitch_m if pitch is None else pitch
        if scale is None:
            raise OutOfDomain(
                "no millimetres a pixel are known of these dots; calibrate them with --pitch, or with "
                "--spacing of the print"
            )
        return scale


INK = 0.15
"""Share of the light that a printed dot gives back; a black print, not measured on a sensor."""

NODES_PER_THICKNESS = 4.0
"""Nodes of the load grid to one thickness of the gel: nothing finer reaches the dots beside it."""

_WAVE_STEP = 0.02
"""Of q: an integral out to r is sound while r is well below 2 pi / 0.02 thicknesses."""

_FARTHEST = 60.0
"""Thicknesses to which the integrals are taken."""


@dataclass(frozen=True, eq=False)
class LayerKernel:
    """Surface displacement around one push, per load."""

    inwards: CubicSpline  #: of the distance in metres: into the gel.
    outwards: CubicSpline  #: of the distance in metres: along the surface, away from the push.
    reach: float  #: metres, the largest distance that may be asked for.


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
        centres = dots + displacements[n]
        radius = _grid(sensor).radius / sensor.pitch
        cover = np.zeros((sensor.rows, sensor.columns))
        shift = np.array([sensor.columns, sensor.rows]) / 2.0 - 0.5
        for x, y in centres / sensor.pitch + shift:
            top, left = max(0, int(np.floor(y - radius))), max(0, int(np.floor(x - radius)))
            here = cover[top : max(0, int(y + radius) + 2), left : max(0, int(x + radius) + 2)]
            i, j = np.ogrid[top : top + here.shape[0], left : left + here.shape[1]]
            edge = radius - np.hypot(i - y, j - x)
            np.maximum(here, np.clip(0.5 + edge, 0.0, 1.0), out=here)
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
    starts = [np.arange(0, size, block) for size in pressed.shape]
    sums = np.add.reduceat(np.add.reduceat(pressed, starts[0], axis=0), starts[1], axis=1)
    sizes = [np.diff(np.append(start, size)) for start, size in zip(starts, pressed.shape, strict=True)]
    depth = sums / np.outer(*sizes)
    y, x = (
        (start + wide / 2.0 - size / 2.0) * sensor.pitch
        for start, wide, size in zip(starts, sizes, pressed.shape, strict=True)
    )
    # Nodes are the blocks of pixels that the object reaches, with its mean depth there.
    rows, columns = np.nonzero(depth > 0.0)
    nodes, depth = np.stack([x[columns], y[rows]], axis=-1), depth[rows, columns]
    between = np.hypot(*(nodes[:, None] - nodes[None]).transpose(2, 0, 1))
    # Loads that push and never pull, and hold every node at its depth or beyond.
    factor = cholesky(kernel.inwards(between), lower=True)
    load, _ = nnls(factor.T, solve_triangular(factor, depth, lower=True), maxiter=10 * len(depth) + 100)
    apart = dots[:, None] - nodes[None]
    distance = np.hypot(apart[..., 0], apart[..., 1])
    per_metre = np.divide(
        kernel.outwards(distance), distance, where=distance > 0.0, out=np.zeros_like(distance)
    )
    moved: FloatArray = np.einsum("mkc,mk,k->mc", apart, per_metre, load)
    return moved


def layer_response(q: FloatArray) -> tuple[FloatArray, FloatArray]:
    """``(into the gel, outwards)`` of a wave of pressure, as factors of ``p / (2 G k)``.

    Args:
        q: wavenumber times thickness, greater than zero.
    """
    decay = np.exp(-2.0 * q)  # both fractions expanded by it: no overflow for a thick gel
    below = 0.5 * (1.0 + decay**2) + (1.0 + 2.0 * q**2) * decay
    return (0.5 * (1.0 - decay**2) - 2.0 * q * decay) / below, 2.0 * q**2 * decay / below


@lru_cache(maxsize=8)
def layer_kernel(thickness: float, spread: float, reach: float) -> LayerKernel:
    """The kernel of a push spread over a Gaussian spot.

    Args:
        thickness: metres, of the gel.
        spread: metres, sigma of the spot.
        reach: metres, the largest distance wanted.

    Raises:
        OutOfDomain: not lengths, a spot much smaller than the gel is thick, or a reach beyond 60
            thicknesses.
    """
    if not (0.0 < spread < np.inf and 0.0 < thickness < np.inf and 0.0 < reach < np.inf):
        raise OutOfDomain(f"a gel of {thickness} m, a spot of {spread} m and a reach of {reach} m cannot be")
    if reach > _FARTHEST * thickness or spread < thickness / 100.0:
        raise OutOfDomain(
            f"a reach of {reach * 1e3:g} mm and a spot of {spread * 1e3:g} mm on a gel of "
            f"{thickness * 1e3:g} mm; the kernel reaches {_FARTHEST:g} thicknesses, and a spot is "
            "at least 1/100 of one"
        )
    q = np.arange(0.5, 6.5 * thickness / spread / _WAVE_STEP) * _WAVE_STEP
    down, out = layer_response(q)
    weight = np.exp(-0.5 * (q * spread / thickness) ** 2) * _WAVE_STEP / thickness
    r = np.linspace(0.0, reach, int(np.ceil(8.0 * reach / spread)) + 2)
    inwards, outwards = np.empty_like(r), np.empty_like(r)
    for part in np.array_split(np.arange(len(r)), 1 + len(r) // 64):
        waves = np.outer(r[part] / thickness, q)
        inwards[part], outwards[part] = j0(waves) @ (down * weight), j1(waves) @ (out * weight)
    return LayerKernel(CubicSpline(r, inwards), CubicSpline(r, outwards), reach)


def read_markers(path: Path) -> MarkerFile:
    """The file that ``touchstone calibrate markers`` wrote; raises as ``read_model``."""
    return read_model(path, MarkerFile, "file of markers", "give what `touchstone calibrate markers` wrote")
