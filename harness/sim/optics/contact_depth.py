"""Estimate the depth of a press from its picture, corrected for the darkening by the contact.

There are two passes. The first, with the smooth model of the calibration, locates the contact roughly: its
slopes are biased, since it interprets the darkening by the contact as slope. The second pass subtracts that
darkening. Before both, the current light is compared with the calibration's.

A real gel is darker by a dozen grey levels where something touches it, even at the apex of a ball, where it
is as flat as untouched. The smooth model of ``harness.sim.optics.shading`` has no such term, so that a flat
gel changes no colour, and fits slopes instead. The table contains both: per bin it is

    table = slopes(normal, position) + offset(position),

linear in both and decoupled by the terms of the position, so that least squares over the filled bins
separates them.
"""

from dataclasses import dataclass, replace
from time import perf_counter

import numpy as np
from scipy.ndimage import gaussian_filter

from harness.basics.arrays import ByteArray, FloatArray, read_only
from harness.basics.errors import CalibrationRefused, DataRefused
from harness.sim.optics.inverse import STEADY, Detection, Inversion, invert
from harness.sim.optics.lit_calibration import place_terms
from harness.sim.optics.shading import POSITION_TERMS, design, scaled_position
from harness.sim.optics.tactile_calibration import TABLE_TERMS, TactileCalibration, with_background

TOUCHED = 0.4
"""Share of the deepest point, above the gel around, beyond which the object is taken to touch. Published
balls read alike from 0.35 to 0.5: the colours of a contact reach a little past its line."""

_AROUND = 5.0
"""Percentile of the heights that is the gel around; the lowest one may be an outlier."""

_RIM = 2.0
"""Pixels over which a contact's dimming is let in."""

_ALIKE = 12.0
"""Grey levels within which pixels are taken to have changed alike."""

_TURNS = 30

FLATTEST = np.radians(5.0)
"""Slope from which on the table holds all of a contact's offset, which is let in over the first 4 degrees."""

_LEAST_BINS = 100
_RIDGE = 1e-9


@dataclass(frozen=True, eq=False)
class ContactColour:
    """A contact's colour in two parts."""

    slopes: FloatArray  #: ``(120, 3)`` coefficients of ``harness.sim.optics.shading``.
    offset: FloatArray  #: ``(rows, columns, 3)`` grey levels that a contact adds to what its slope gives.
    misfit: float  #: grey levels rms by which the table's bins differ from both together.


@dataclass(frozen=True, eq=False)
class Depth:
    """A reading, and by what."""

    read: Inversion  #: heights, contact, where it can be trusted.
    calibrations: tuple[TactileCalibration, ...]
    """of each picture: the colours of contacts over what the picture's gel would show at rest."""
    dimming: FloatArray
    """``(n, rows, columns, 3)`` grey levels that contacts were taken to add whatever their slope."""
    drift: FloatArray
    """``(n, 3)`` grey levels by which the light differs from the calibration's; zero where none was looked
    for."""


def read_depth(images: ByteArray, calibration: TactileCalibration, detection: Detection = STEADY) -> Depth:
    """Recover the surface of a flat gel from pictures of presses.

    Args:
        images: ``(n, rows, columns, 3)`` RGB.
        calibration: with a smooth model and a table of the same presses.
        detection: what counts as a change; ``drifting`` also asks for the light of the moment.

    Raises:
        DataRefused: images of another shape or type than the calibration's.
        CalibrationRefused: a calibration with no smooth model, or a table of too few bins.
    """
    if images.ndim != 4 or images.shape[1:] != calibration.background.shape or images.dtype != np.uint8:
        raise DataRefused(
            f"images are {images.dtype} {images.shape}; this calibration reads uint8 "
            f"(n, *{calibration.background.shape})"
        )
    began = perf_counter()
    colour = contact_colour(calibration)
    answers = [_read_one(image, calibration, colour, detection) for image in images]
    drift = np.array([drift for *_, drift in answers]).reshape(len(images), 3)
    dimming = np.array([dimming for _, _, dimming, _ in answers]).reshape(images.shape)
    reads = [read for read, *_ in answers]
    names = ("height", "contact", "imprint", "trusted", "error", "anchored")
    return Depth(
        Inversion(
            **{name: read_only(np.concatenate([vars(read)[name] for read in reads])) for name in names},
            seconds=perf_counter() - began,
        ),
        tuple(by for _, by, _, _ in answers),
        read_only(dimming),
        read_only(drift),
    )


def drift_of(image: ByteArray, background: ByteArray) -> FloatArray:
    """``(3,)`` grey levels by which most of a picture differs from the untouched gel: the mode's mean.

    A contact with its halo may fill half of a picture; the pixels that changed alike are still more than
    those that share any other change.
    """
    change = (image[::2, ::2].astype(np.float64) - background[::2, ::2]).reshape(-1, 3)
    drift = np.asarray(np.median(change, axis=0))
    for _ in range(_TURNS):
        alike = ((change - drift) ** 2).sum(axis=1) < _ALIKE**2
        if not alike.any():
            return drift
        moved = change[alike].mean(axis=0)
        settled, drift = bool(np.abs(moved - drift).max() < 0.01), np.asarray(moved)
        if settled:
            return drift
    return drift


def _read_one(
    image: ByteArray, calibration: TactileCalibration, colour: ContactColour, detection: Detection
) -> tuple[Inversion, TactileCalibration, FloatArray, FloatArray]:
    drift = drift_of(image, calibration.background) if detection.drifting else np.zeros(3)
    rest = calibration.background + drift
    first = invert(image[None], with_background(calibration, _byte(rest)), detection)
    if not first.imprint.any():
        return first, with_background(calibration, _byte(rest)), np.zeros(image.shape), drift
    height = first.height[0]
    above = height - np.percentile(height, _AROUND)
    share: FloatArray = gaussian_filter((above > TOUCHED * above.max()).astype(np.float64), _RIM)
    dimming = colour.offset * share[..., None]
    by = with_background(replace(calibration, smooth=colour.slopes), _byte(rest + dimming))
    return invert(image[None], by, detection), by, dimming, drift


def _byte(picture: FloatArray) -> ByteArray:
    return np.clip(np.rint(picture), 0.0, 255.0).astype(np.uint8)


def contact_colour(calibration: TactileCalibration) -> ContactColour:
    """Part the table of a calibration into slopes and offset.

    Raises:
        CalibrationRefused: presses reached too few bins to tell.
    """
    normal, bins = _reached(calibration)
    x, y = (
        axis.ravel()
        for axis in np.meshgrid(
            np.linspace(0, calibration.columns - 1, 3), np.linspace(0, calibration.rows - 1, 3)
        )
    )
    raw = np.stack([x * x, y * y, x * y, x, y, np.ones_like(x)], axis=1)
    assert raw.shape[1] == TABLE_TERMS
    back = np.linalg.pinv(place_terms(scaled_position(x, y, calibration.rows, calibration.columns)))
    places = bins @ np.asarray(back @ raw, dtype=np.float64).T  # (n, 3, 6): channel, place term
    terms = design(normal, np.zeros_like(normal))
    terms = np.hstack(
        [np.ascontiguousarray(terms[:, ::POSITION_TERMS], dtype=np.float64), np.ones((len(normal), 1))]
    )
    gram = terms.T @ terms
    gram += _RIDGE * np.diag(np.diag(gram))
    flat = places.transpose(0, 2, 1).reshape(len(normal), -1)
    found = np.linalg.solve(gram, terms.T @ flat)
    misfit = float(np.sqrt(np.mean((terms @ found - flat)[:, :3] ** 2)))
    found = found.reshape(-1, POSITION_TERMS, 3)
    y, x = (axis.ravel().astype(np.float64) for axis in np.mgrid[: calibration.rows, : calibration.columns])
    offset = place_terms(scaled_position(x, y, calibration.rows, calibration.columns)) @ found[-1]
    return ContactColour(
        read_only(np.ascontiguousarray(found[:-1].reshape(-1, 3))),
        read_only(offset.reshape(calibration.rows, calibration.columns, 3)),
        misfit,
    )


def _reached(calibration: TactileCalibration) -> tuple[FloatArray, FloatArray]:
    """Normals ``(n, 2)`` of the bins that say something, and their entries ``(n, 3, 6)``."""
    step = 0.5 * np.pi / (calibration.bins - 1)
    row, column = np.nonzero(calibration.support[:, :-1])
    steep = (row + 0.5) * step
    inside = (steep > FLATTEST) & (np.sin(steep) <= calibration.header.slope_limit)
    row, column, steep = row[inside], column[inside], steep[inside]
    if len(row) < _LEAST_BINS:
        raise CalibrationRefused(
            f"presses reached {len(row)} bins of this calibration's table between "
            f"{np.degrees(FLATTEST):.0f} deg and its steepest slope; at least {_LEAST_BINS} are wanted: "
            "fit it again from more presses"
        )
    towards = -np.pi + (column + 0.5) * 4.0 * step
    # A height's gradient has the normal's image part pointing the other way.
    normal = -np.sin(steep)[:, None] * np.stack([np.cos(towards), np.sin(towards)], axis=1)
    return normal, calibration.table[row, column].astype(np.float64).transpose(0, 2, 1)
