"""With how much force an object is pressed into a gel, from how deep it reaches, and how well that is known.

Two levels. ``layer`` solves the contact with an elastic layer on its plate, as many contacts as there
are and whatever their shape. ``winkler`` takes each contact alone, as an elastic foundation (Johnson,
Contact Mechanics, 1985, section 4.3) with the springs of least energy on that layer: pressure goes as the
depth, and force as the volume that the object takes. Both are linear and without friction.

The pressure under a rigid object that is pressed into a gel as deep as a height map says.

Where the object presses, the surface of the gel is the object's; elsewhere nothing presses, and the gel lies
at or below it. Of all pressures of zero and more that is the one with the least energy ``p K p / 2 - p g``
(Kalker; Johnson, Contact Mechanics, 1985, section 5.9), found by conjugate gradients on the squares that
press (Polonsky and Keer, A numerical method for solving rough contact problems, Wear 231, 1999), with the
layer's influence summed by transforms on a grid of twice the size: no load meets a copy of itself.

An arm presses an object of one kind, reads its force sensor, and writes how deep it was, or how much
volume it took of the gel. A table by depth holds for that very object; one by volume is nearly the
same for objects of like breadth.
"""

from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
from pydantic import Field, model_validator
from scipy.fft import irfft2, next_fast_len, rfft2
from scipy.interpolate import PchipInterpolator
from scipy.ndimage import find_objects, label

from harness.basics.arrays import BoolArray, FloatArray, IntArray, block_means, read_only
from harness.basics.errors import OutOfDomain
from harness.basics.files.json_file import read_model
from harness.basics.toml_file import StrictModel
from harness.sim.gel.elastic import GelElastic, disc_stiffness, influence

Above = Annotated[float, Field(gt=0.0, allow_inf_nan=False)]
Said = Annotated[str, Field(min_length=1)]

_UNITS = {"depth_m": (1e3, "mm deep"), "volume_m3": (1e9, "mm^3 of the gel taken")}


class ForceRow(StrictModel):
    """Forces measured at one depth."""

    at: Above  #: metres, or cubic metres, by the table's ``of``.
    force_n: Above  #: N, mean of the readings.
    sigma_n: Above
    """Standard deviation in N of a press from that mean: scatter of repeated presses, and the uncertainty of
    the force sensor."""


class ForceTable(StrictModel):
    """Forces of one gel and one kind of object, least first."""

    schema_number: Literal[1] = Field(alias="schema")  #: of the file.
    sensor: Said  #: make.
    serial: str  #: of the very gel.
    indenter: Said  #: what was pressed, in words.
    made_from: Said  #: the readings.
    of: Literal["depth_m", "volume_m3"]
    """what ``at`` is: the deepest pixel, or the volume between the object and the untouched gel."""
    rows: Annotated[list[ForceRow], Field(min_length=3)]  #: both ``at`` and ``force_n`` rise.

    @model_validator(mode="after")
    def _rises(self) -> "ForceTable":
        for k, (one, other) in enumerate(pairwise(self.rows)):
            if other.at <= one.at or other.force_n <= one.force_n:
                raise ValueError(
                    f"row {k + 2} ({other.at:g}, {other.force_n:g} N) does not lie above row {k + 1} "
                    f"({one.at:g}, {one.force_n:g} N): a deeper press takes more force; sort the rows, and "
                    "press again what does not rise"
                )
        return self

    def at(self, measure: float) -> tuple[float, float]:
        """Interpolate the force in N and its standard deviation; both are zero without indentation.

        Args:
            measure: metres or cubic metres, by ``of``.

        Raises:
            OutOfDomain: more than the last row.
        """
        rows = [(0.0, 0.0, 0.0), *((row.at, row.force_n, row.sigma_n) for row in self.rows)]
        at, force, sigma = np.array(rows).T
        if not 0.0 <= measure <= at[-1]:
            scale, words = _UNITS[self.of]
            raise OutOfDomain(
                f"the press is {measure * scale:.4g} {words} and the table of forces ends at "
                f"{at[-1] * scale:.4g}; nothing is read beyond it: press less, or measure deeper presses"
            )
        # Cubics that pass every row and rise wherever the rows do (Fritsch and Butland, 1984).
        return float(PchipInterpolator(at, force)(measure)), float(np.interp(measure, at, sigma))

    def measure(self, depth: FloatArray, pitch: float) -> float:
        """Compute the table's abscissa from the ``(rows, columns)`` depths in m of one press."""
        return float(depth.max() if self.of == "depth_m" else depth.sum() * pitch**2)


ForceLevel = Literal["winkler", "layer"]

PARTS = ("modulus", "poisson", "thickness", "squares", "theory")
"""What an uncertainty is put together from; ``theory`` of a measured table is its scatter."""

THEORY = {"winkler": 0.10, "layer": 0.05}
"""Shares. ``layer``: what four published forces on a GelSight Mini scatter by around it, to half its
thickness (``tests/harness/sim/gel/test_published_force.py``). ``winkler``: what it is off ``layer`` by, of
balls, rods, edges and faces (``tests/benchmarks/touch/bench_force.py``)."""

CHECKED = (0.5, 0.4)
"""Depth in thicknesses, and in radii of the contact, to which those four presses went: beyond, a gel is no
longer linear, and nobody has shown by how much."""

SETTLED = 1e-5
"""Share of the energy that is left where a search ends: a hundredth of what the finest squares are off by."""

_MOST_TURNS = 1000


OF_GEL = 0.1
"""Share of the deepest pixel from which the surface of a gel is taken to be pressed."""


@dataclass(frozen=True, eq=False)
class Pressure:
    """What presses where."""

    pascals: FloatArray  #: of every square, 0 where nothing presses.
    left: float
    """share of the energy by which the search ended short of the least; ``SETTLED`` or less where it
    settled."""
    turns: int  #: of the search.


class _Search:
    """Conjugate gradients, in units of the deepest square and of the pressure that it would have alone."""

    def __init__(self, depth: FloatArray, pitch: float, thickness: float, gel: GelElastic) -> None:
        rows, columns = depth.shape
        self._padded = tuple(next_fast_len(2 * n - 1, real=True) for n in depth.shape)
        quarter = influence(rows, columns, pitch, thickness, gel)
        self._deepest, self._own = float(depth.max()), float(quarter[0, 0])
        whole = np.zeros(self._padded)
        whole[:rows, :columns] = quarter / self._own
        whole[-rows + 1 or None :, :columns][: rows - 1] = whole[rows - 1 : 0 : -1, :columns]
        whole[:, -columns + 1 or None :][:, : columns - 1] = whole[:, columns - 1 : 0 : -1]
        self._waves = rfft2(whole)
        self._depth = depth / self._deepest
        self._may = self._depth > 0.0

    def springs(self) -> FloatArray:
        """Pa, in proportion to the depth."""
        return np.asarray(self._guess() * (self._deepest / self._own))

    def run(self) -> Pressure:
        """Turn until what is left settles."""
        pressure = self._guess()
        gap, along = self._gap(pressure), np.zeros_like(pressure)
        before, restart, turn = 1.0, True, 0
        while self._left(pressure, gap) > SETTLED and turn < _MOST_TURNS:
            pressing = pressure > 0.0
            now = float((gap[pressing] ** 2).sum())
            along = np.where(pressing, gap + (0.0 if restart else now / before) * along, 0.0)
            pressure, gap, restart = self._turned(pressure, gap, along)
            before, turn = now, turn + 1
        left = self._left(pressure, gap)
        return Pressure(pressure * (self._deepest / self._own), left, turn)

    def _turned(
        self, pressure: FloatArray, gap: FloatArray, along: FloatArray
    ) -> tuple[FloatArray, FloatArray, bool]:
        """Pressure and gap one step on, and whether squares came into contact: it then starts anew."""
        moved = self._moved(along)
        curved = float((along * moved).sum())
        step = float((gap * along).sum()) / curved if curved > 0.0 else 0.0
        onward = pressure - step * along
        pulls = onward < 0.0
        onward[pulls] = 0.0
        touching = self._may & (onward == 0.0) & (gap < 0.0)
        onward[touching] = -step * gap[touching]
        if pulls.any() or touching.any():
            return onward, self._gap(onward), bool(touching.any())
        return onward, np.where(self._may, gap - step * moved, 0.0), False

    def _gap(self, pressure: FloatArray) -> FloatArray:
        """How far the gel is pushed beyond the object: negative where the object is in the gel."""
        return np.where(self._may, self._moved(pressure) - self._depth, 0.0)

    def _moved(self, pressure: FloatArray) -> FloatArray:
        rows, columns = pressure.shape
        spread: FloatArray = irfft2(rfft2(pressure, self._padded) * self._waves, self._padded)
        return spread[:rows, :columns]

    def _guess(self) -> FloatArray:
        """The depth itself as pressure, times what gives it the least energy."""
        reached = float((self._depth * self._moved(self._depth)).sum())
        return np.asarray(self._depth * (float((self._depth**2).sum()) / reached))

    def _left(self, pressure: FloatArray, gap: FloatArray) -> float:
        """Energy that may be left, as a share: gaps under the pressure, and depths that it does not reach."""
        under = float((pressure * np.abs(gap)).sum())
        beyond = float(np.maximum(-gap, 0.0)[pressure == 0.0].sum()) * float(pressure.max())
        return (under + beyond) / float((pressure * self._depth).sum())


@dataclass(frozen=True, eq=False)
class ContactForce:
    """The forces of some presses."""

    newtons: FloatArray  #: ``(n,)``, along the gel's normal; exactly 0 without contact.
    uncertainty: FloatArray  #: ``(n,)`` N, one standard deviation.
    shares: FloatArray  #: ``(n, len(PARTS))`` what it is put together from, as shares of the force.
    pressure: FloatArray  #: ``(n, rows, columns)`` Pa.
    centre: FloatArray  #: ``(n, 2)`` metres, where the force acts, x and y in ``gel``; NaN without contact.
    lower_bound: BoolArray
    """``(n,)`` whether the contact reaches the border: there is more of it than is seen."""
    depth_share: FloatArray  #: ``(n,)`` how deep the press is, in thicknesses.
    strain: FloatArray
    """``(n,)`` how deep it is, in radii of a disc of the area that the object takes; 0 without contact."""

    @property
    def beyond_checked(self) -> BoolArray:
        """``(n,)`` whether a press is deeper, or steeper, than any by which the theory was checked."""
        return np.asarray((self.depth_share > CHECKED[0]) | (self.strain > CHECKED[1]))

    @classmethod
    def of(
        cls, depth: FloatArray, pressure: FloatArray, shares: FloatArray, pitch: float, thickness: float
    ) -> "ContactForce":
        """Put together from the pressures; arguments as the attributes and ``contact_force``."""
        newtons = pressure.sum(axis=(1, 2)) * pitch**2
        edge = np.ones(depth.shape[1:], dtype=np.bool_)
        edge[1:-1, 1:-1] = False
        radius = pitch * np.sqrt(np.count_nonzero(depth, axis=(1, 2)) / np.pi)
        deepest: FloatArray = depth.max(axis=(1, 2))
        strains: FloatArray = np.divide(deepest, radius, out=np.zeros_like(radius), where=radius > 0.0)
        _, rows, columns = pressure.shape
        y, x = (np.arange(n) + 0.5 - n / 2.0 for n in (rows, columns))
        whole = pressure.sum(axis=(1, 2))
        moments = np.stack(
            [(pressure * x).sum(axis=(1, 2)), (pressure * y[:, None]).sum(axis=(1, 2))], axis=-1
        )
        centres = np.full(moments.shape, np.nan)
        centres[whole > 0.0] = pitch * moments[whole > 0.0] / whole[whole > 0.0, None]
        return cls(
            read_only(newtons),
            read_only(newtons * np.sqrt((shares**2).sum(axis=1))),
            read_only(shares),
            read_only(pressure),
            read_only(centres),
            read_only(np.asarray((depth[:, edge] > 0.0).any(axis=1))),
            read_only(depth.max(axis=(1, 2)) / thickness),
            read_only(strains),
        )


def pressed_of_gel(surface: FloatArray, share: float = OF_GEL) -> FloatArray:
    """Estimate how deep a gel is pressed from its surface: the pixels deeper than a share of the deepest.

    The object is where the surface is pressed, and the gel that hangs around it needs no force. A rendered
    skirt would (``docs/explanation/touch_force.md`` states the cost of the tenth).

    Args:
        surface: ``(rows, columns)`` metres of indentation.
        share: of the deepest pixel.
    """
    kept: FloatArray = np.where(surface > share * surface.max(), np.maximum(surface, 0.0), 0.0)
    return kept


def contact_force(
    depth: FloatArray,
    pitch: float,
    thickness: float,
    gel: GelElastic,
    level: ForceLevel = "layer",
    cells: int = 1,
) -> ContactForce:
    """The force of each press.

    Args:
        depth: ``(n, rows, columns)`` metres, 0 or more: how deep the object reaches into the untouched gel.
        pitch: metres a pixel.
        thickness: metres of the gel; infinite for a half-space.
        gel: how stiff it is.
        level: how it is computed.
        cells: pixels to a square, each way.

    Raises:
        OutOfDomain: another shape, a depth that is negative or not finite, or a press deeper than the gel is
            thick; pressures that do not settle, which no press was found to do.
    """
    require_depths(depth, thickness)
    pressure, shares = np.zeros(depth.shape), np.zeros((len(depth), len(PARTS)))
    for k, each in enumerate(np.asarray(depth, dtype=np.float64)):
        if not each.any():
            continue
        fine, coarse = (_pressed(each, pitch, thickness, gel, level, cells * by) for by in (1, 2))
        whole = fine.sum()
        squares = abs(coarse.sum() - whole) / whole
        pressure[k] = fine
        shares[k] = (gel.young_share, *_known(each, pitch, thickness, gel), squares, THEORY[level])
    return ContactForce.of(depth, pressure, shares, pitch, thickness)


def require_depths(depth: FloatArray, thickness: float) -> None:
    """Raise ``OutOfDomain`` for what is no press of a gel, or one that reaches its plate or the sensor."""
    if depth.ndim != 3 or 0 in depth.shape[1:]:
        raise OutOfDomain(f"depths are {depth.shape}; forces are computed of (n, rows, columns)")
    if not (np.isfinite(depth).all() and (depth >= 0.0).all()):
        raise OutOfDomain(
            "a depth is negative or not a number, and no force is known there; give 0 where the object does "
            "not reach"
        )
    deepest = float(depth.max(initial=0.0))
    if deepest > thickness:
        raise OutOfDomain(
            f"the press is {deepest * 1e3:.3g} mm deep and the gel {thickness * 1e3:g} mm thick; no force is "
            "computed of an object that reaches the plate: press less, or ask for no force"
        )


def _pressed(
    depth: FloatArray, pitch: float, thickness: float, gel: GelElastic, level: ForceLevel, cells: int
) -> FloatArray:
    """Pa of every pixel, by squares of ``cells`` pixels a side."""
    merged, side = depth, pitch * cells
    if cells > 1:
        # Means over squares of pixels; outside of the picture nothing presses.
        rows, columns = depth.shape
        merged = block_means(np.pad(depth, ((0, -rows % cells), (0, -columns % cells))), cells)
    if level == "winkler":
        # Every contact on springs of its own.
        parts, pascals = _contacts(merged), np.zeros(merged.shape)
        for k, box in enumerate(find_objects(parts)):
            alone = np.where(parts[box] == k + 1, merged[box], 0.0)
            pascals[box] += _Search(alone, side, thickness, gel).springs()
    else:
        found = contact_pressure(merged, side, thickness, gel)
        if found.left > SETTLED:
            raise OutOfDomain(
                f"the pressures did not settle in {found.turns} turns: {found.left:.2g} of the energy is "
                f"left, and the limit is {SETTLED:g}; take larger squares, --level touch.force_cells=4, or "
                "--level touch.force=winkler"
            )
        pascals = found.pascals
    # A square at the border may reach past the picture: what it carries is put on the pixels that are seen.
    spread = pascals.repeat(cells, axis=0).repeat(cells, axis=1)[: depth.shape[0], : depth.shape[1]]
    whole = spread.sum()
    return np.asarray(spread * (pascals.sum() * cells**2 / whole if whole > 0.0 else 1.0))


def _contacts(depth: FloatArray) -> IntArray:
    """``(rows, columns)`` the number of each contact from 1, corners held together; 0 beside."""
    return np.asarray(label(depth > 0.0, structure=np.ones((3, 3)))[0])


def _by_discs(depth: FloatArray, pitch: float, thickness: float, gel: GelElastic) -> float:
    """N, roughly: every contact as an evenly pressed disc of its area."""
    parts = _contacts(depth).ravel()
    areas = np.bincount(parts)[1:] * pitch**2
    volumes = np.bincount(parts, depth.ravel())[1:] * pitch**2
    radii = np.sqrt(areas / np.pi)
    stiff = [disc_stiffness(float(radius / thickness), gel.poisson) * gel.plane / radius for radius in radii]
    return float(volumes @ np.array(stiff))


def _known(depth: FloatArray, pitch: float, thickness: float, gel: GelElastic) -> tuple[float, float]:
    """Shares of the force by which Poisson's ratio and the thickness may be off, of discs as wide."""

    def force(poisson: float, thick: float) -> float:
        return _by_discs(depth, pitch, thick, replace(gel, poisson=poisson))

    here = force(gel.poisson, thickness)
    low, high = max(0.0, gel.poisson - gel.poisson_sigma), min(0.5, gel.poisson + gel.poisson_sigma)
    by_poisson = (force(high, thickness) - force(low, thickness)) / here if high > low else 0.0
    steps = (high - low) / gel.poisson_sigma if gel.poisson_sigma > 0.0 else 1.0
    if not np.isfinite(thickness) or gel.thickness_share == 0.0:
        return abs(by_poisson) / steps, 0.0
    thinner, thicker = (thickness * np.exp(sign * gel.thickness_share) for sign in (-1.0, 1.0))
    by_thickness = (force(gel.poisson, thinner) - force(gel.poisson, thicker)) / (2.0 * here)
    return abs(by_poisson) / steps, abs(by_thickness)


def contact_pressure(depth: FloatArray, pitch: float, thickness: float, gel: GelElastic) -> Pressure:
    """Solve one contact, or several that feel each other.

    Args:
        depth: ``(rows, columns)`` metres, 0 or more: how deep the object reaches into the untouched gel; only
            squares above zero can press.
        pitch: metres, side of a square.
        thickness: metres of the gel; infinite for a half-space.
        gel: how stiff it is.
    """
    pascals = np.zeros(depth.shape)
    if not depth.any():
        return Pressure(read_only(pascals), 0.0, 0)
    touched = (np.flatnonzero(depth.any(axis=axis)) for axis in (1, 0))
    rows, columns = (slice(int(where[0]), int(where[-1]) + 1) for where in touched)
    found = _Search(depth[rows, columns], pitch, thickness, gel).run()
    pascals[rows, columns] = found.pascals
    return Pressure(read_only(pascals), found.left, found.turns)


def read_force_table(path: Path) -> ForceTable:
    """A table of forces, ``docs/explanation/touch_force.md``; raises as ``read_model``."""
    return read_model(path, ForceTable, "table of forces", "docs/explanation/touch_force.md shows one")
