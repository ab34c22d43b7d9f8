"""Calibrate the dots of a gel from pictures of it at rest: where each is, and how well that is known.

One picture is enough; several say by how much a place wanders from one to the next. Pictures of a gel that is
touched are refused: around a contact dots lie off the grid by more than a lens can bend it.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from time import perf_counter

import numpy as np
from scipy.spatial import cKDTree
from threadpoolctl import threadpool_limits

from calibration.markers.dots import Dots, find_dots
from calibration.markers.lattice import lay_lattice
from calibration.taxim.arm.moves import ArmScale, arm_scale
from harness.basics.arrays import BoolArray, ByteArray, FloatArray, read_only
from harness.basics.errors import CalibrationRefused, OutOfDomain
from harness.picture.dot_lattice import DotLattice

LARGEST_LOCAL = 0.06
"""Of the spacing, by which a dot of a resting gel may be off its smooth grid. In two published pictures of a
touched gel dots are off by an eighth and by a third."""

_FEW, _SHARE = 3, 0.02
"""Dots that may be off by more, and the share of all: misprints. More of them are a contact."""

LARGEST_MOVE = 0.25
"""Pixels rms, by which dots may wander from picture to picture: beyond, the gel was touched or moved."""


@dataclass(frozen=True)
class Printed:
    """What is known of the gel beside its pictures; at most one of pitch and spacing.

    Attributes:
        sensor: make.
        serial: of the gel.
        pitch: m a pixel.
        spacing: m from dot to dot of the print: millimetres a pixel follow.
    """

    sensor: str = "tactile camera"
    serial: str = "unknown"
    pitch: float | None = None
    spacing: float | None = None


@dataclass(frozen=True, eq=False)
class RestingMarkers:
    """The dots of a gel at rest.

    Attributes:
        picture: ``(rows, columns, 3)`` mean of the pictures.
        dots: of that mean.
        lattice: through them.
        scale: how the picture lies on the gel, by the print's spacing; None where that is not known.
        pitch: m a pixel; None where nothing told it.
        wander: pixels rms, of a dot from picture to picture; None of one picture.
        misprinted: places in ``dots`` that lie off their grid by more than ``LARGEST_LOCAL``.
        seconds: that it took.
    """

    picture: ByteArray
    dots: Dots
    lattice: DotLattice
    scale: ArmScale | None
    pitch: float | None
    wander: float | None
    misprinted: tuple[int, ...]
    seconds: float


def markers_at_rest(pictures: Sequence[ByteArray], printed: Printed) -> RestingMarkers:
    """Find the dots.

    Args:
        pictures: ``(rows, columns, 3)`` each, of one gel at rest.
        printed: what is known of it.

    Raises:
        CalibrationRefused: pictures that do not belong together, no grid of dots, or a touched gel.
        OutOfDomain: no picture, or both a pitch and a spacing.
    """
    began = perf_counter()
    _check(pictures, printed)
    # Products of a few numbers a dot: threads would wait for one another.
    with threadpool_limits(limits=1, user_api="blas"):
        mean = np.round(np.mean(np.stack(pictures), axis=0, dtype=np.float64)).astype(np.uint8)
        dots = find_dots(mean)
        lattice = lay_lattice(dots.places)
        misprinted = _resting(dots, lattice)
        wander = _wander(pictures, dots, lattice)
        scale = None if printed.spacing is None else _scale(dots, lattice, printed.spacing)
    pitch = printed.pitch if scale is None else scale.pitch.value
    return RestingMarkers(
        read_only(mean), dots, lattice, scale, pitch, wander, misprinted, perf_counter() - began
    )


def _check(pictures: Sequence[ByteArray], printed: Printed) -> None:
    if not pictures:
        raise OutOfDomain("no picture of the resting gel came; give one, or a folder of them")
    if printed.pitch is not None and printed.spacing is not None:
        raise OutOfDomain(
            "both a pitch and the print's spacing came, and each gives the other: leave one out"
        )
    shapes = sorted({picture.shape for picture in pictures})
    if len(shapes) > 1:
        sizes = " and ".join(f"{shape[1]} x {shape[0]}" for shape in shapes)
        raise CalibrationRefused(
            f"the pictures have {sizes} pixels; those of one camera at one resolution are wanted"
        )


def _resting(dots: Dots, lattice: DotLattice) -> tuple[int, ...]:
    """Dots that were misprinted; refuses a gel that is touched."""
    off = np.hypot(lattice.local[:, 0], lattice.local[:, 1]) / lattice.spacing
    far = np.flatnonzero(off > LARGEST_LOCAL)
    if len(far) >= _FEW and len(far) > _SHARE * len(off):
        worst = int(far[np.argmax(off[far])])
        x, y = dots.places[worst]
        raise CalibrationRefused(
            f"{len(far)} of {len(off)} dots lie off their grid by more than {LARGEST_LOCAL:.0%} of its "
            f"spacing, the one at column {x:.0f}, row {y:.0f} by {off[worst]:.0%}: the gel is touched there; "
            "take pictures of it at rest"
        )
    return tuple(int(k) for k in far)


def _wander(pictures: Sequence[ByteArray], dots: Dots, lattice: DotLattice) -> float | None:
    """Pixels rms of a coordinate between single pictures; dots that only some show do not count."""
    if len(pictures) < 2:
        return None
    seen = []
    for picture in pictures:
        found = find_dots(picture).places
        away, at = (np.asarray(one) for one in cKDTree(found).query(dots.places))
        seen.append(np.where((away < 0.25 * lattice.spacing)[:, None], found[at], np.nan))
    every: FloatArray = np.array(seen)
    shown: BoolArray = np.asarray(np.isfinite(every).all(axis=(0, 2)), dtype=np.bool_)
    if shown.mean() < 0.9:
        raise CalibrationRefused(
            f"{int(shown.sum())} of {len(shown)} dots are in every picture: they are not of one gel at rest"
        )
    wander = float(np.sqrt(np.var(every[:, shown], axis=0, ddof=1).mean()))
    if wander > LARGEST_MOVE:
        raise CalibrationRefused(
            f"dots wander by {wander:.2f} px rms from picture to picture (at most {LARGEST_MOVE:g}): the gel "
            "was touched in some, or the sensor moved in its mount"
        )
    return wander


def _scale(dots: Dots, lattice: DotLattice, spacing: float) -> ArmScale:
    """The picture on the gel, where the print's rows are the gel's own x; errors are those of the places."""
    on = lattice.on
    try:
        return arm_scale([dots.places[on]], spacing * lattice.index[on].astype(np.float64))
    except CalibrationRefused as refused:
        raise CalibrationRefused(f"the print is no scale of {1e3 * spacing:g} mm: {refused}") from refused
