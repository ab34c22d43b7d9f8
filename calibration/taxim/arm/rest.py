"""What the untouched gel looked like while the presses were made.

A single picture of it carries its own noise, moire and blocks of compression, and is not of the same
minute. Every press shows most of the gel untouched; where enough of them do, their median has the finer
structure better. What varies over more than a contact stays the picture's: the presses' own halos do.
"""

import numpy as np
from scipy.ndimage import distance_transform_edt, gaussian_filter

from calibration.taxim.pack import PressPack
from calibration.taxim.smooth_fit import distance
from harness.basics.arrays import BoolArray, FloatArray

AWAY = 2.5
"""Radii of the contact from its centre beyond which the gel is taken to be untouched."""

SIGHTINGS = 16
"""Presses that must show a place untouched. Where the presses lie close together a few remain, with the
halos of their neighbours: the picture as given is better there."""

_FINE = 1.5
"""Contact radii, sigma of the blur whose result counts as varying slowly."""

_SEAM = 0.15
"""Of that sigma, over which the correction fades in, so that it leaves no seam."""


def rest_change(pack: PressPack, change: FloatArray) -> FloatArray:
    """``(rows, columns, 3)`` grey levels by which the presses' untouched gel differs from the background.

    Args:
        pack: the presses; their centres and radii say where each is touched.
        change: ``(presses, rows, columns, 3)`` against the background, drift removed.

    Returns:
        The median over the presses less what varies slowly of it; 0 where fewer than 16 show the place
        untouched.
    """
    far = np.stack(
        [distance(pack.shape, c) > AWAY * r for c, r in zip(pack.centres, pack.radii, strict=True)], axis=0
    )
    count = far.sum(axis=0)
    rest = np.zeros(change.shape[1:])
    seen = count >= SIGHTINGS
    if not seen.any():
        return rest
    # Touched ones sort to the end, and the median is read off the front.
    values = np.where(far[:, seen, None], change[:, seen], np.inf)
    values.sort(axis=0)
    places, n = np.arange(values.shape[1]), count[seen]
    rest[seen] = 0.5 * (values[(n - 1) // 2, places] + values[n // 2, places])
    sigma = _FINE * float(np.median(pack.radii))
    share = np.maximum(gaussian_filter(seen.astype(np.float64), sigma), 1e-6)
    slow = gaussian_filter(rest, (sigma, sigma, 0.0)) / share[..., None]
    corrected: FloatArray = _faded(seen, _SEAM * sigma)[..., None] * (rest - slow)
    return corrected


def _faded(seen: BoolArray, width: float) -> FloatArray:
    """1 well within what is seen, 0 outside, and linear over ``width`` pixels between: no seam."""
    if seen.all():
        return np.ones(seen.shape)
    return np.minimum(distance_transform_edt(seen) / width, 1.0)
