"""What ball presses look like around their contact, by direction and by distance from its rim.

The polar grid is that of ``harness.sim.optics.shadow``: rays that start at the outermost pixel of a
contact's rim, with a sample every so many pixels.
"""

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import map_coordinates

from calibration.taxim.light_fit import REACH, GelLight, light_shades
from calibration.taxim.pack import PressPack
from harness.basics.arrays import FloatArray, read_only
from harness.sim.optics.shadow import RIM

DIRECTIONS = 64
SAMPLE_STEP = 1.25
"""Pixels, as the published tables have it."""

WITHIN = 0.7
"""Of the contact's radius: where its slopes show which way the light comes."""


@dataclass(frozen=True, eq=False)
class Around:
    """Presses on one polar grid about their contacts.

    Attributes:
        directions: ``(d,)`` rad, in the picture: from the columns' direction towards the rows'.
        starts: ``(d,)`` pixels from the axis where rays begin: the outermost pixel of the rim.
        seen: ``(presses, d, samples, 3)`` grey levels against the untouched gel; NaN outside the picture.
        left: the same less what slopes, skirt and light explain.
        within: ``(d, 3)`` grey levels that are explained within the contact, where no shadow falls.
    """

    directions: FloatArray
    starts: FloatArray
    seen: FloatArray
    left: FloatArray
    within: FloatArray


def around(pack: PressPack, clean: FloatArray, centres: FloatArray, light: GelLight) -> Around:
    """Look at presses along rays from their rims.

    Args:
        pack: the presses.
        clean: ``(presses, rows, columns, 3)`` grey levels against the untouched gel.
        centres: ``(presses, 2)`` pixels (column, row), of the balls' axes.
        light: what is explained already.
    """
    directions = (np.arange(DIRECTIONS, dtype=np.float64) + 0.5) * (2.0 * np.pi / DIRECTIONS)
    starts = rim_reach(light.edge, directions)
    samples = max(2, int((REACH * light.edge - starts.max()) / SAMPLE_STEP))
    away = starts[:, None] + SAMPLE_STEP * np.arange(samples)
    offset = np.stack([away * np.cos(directions[:, None]), away * np.sin(directions[:, None])], axis=-1)
    shape = (len(clean), DIRECTIONS, samples, 3)
    seen, left = np.empty(shape), np.empty(shape)
    within: FloatArray = np.zeros((DIRECTIONS, 3))
    ring = WITHIN * light.edge * np.stack([np.cos(directions), np.sin(directions)], axis=1)
    for k, centre in enumerate(centres):
        place = (centre + offset).reshape(-1, 2)[:, ::-1]
        looked = np.stack(
            [
                map_coordinates(clean[k][..., c], place.T, order=1, mode="constant", cval=np.nan)
                for c in range(3)
            ],
            axis=-1,
        )
        seen[k] = looked.reshape(shape[1:])
        left[k] = (looked - light_shades(pack, light, centre, place)).reshape(shape[1:])
        within += light_shades(pack, light, centre, (centre + ring)[:, ::-1]) / len(centres)
    return Around(
        read_only(directions), read_only(starts), read_only(seen), read_only(left), read_only(within)
    )


def rim_reach(edge: float, directions: FloatArray) -> FloatArray:
    """``(d,)`` pixels from the axis of a round contact to the outermost pixel of its rim.

    The rim is the contact widened by a square, so it reaches further along the diagonals.

    Args:
        edge: pixels, radius of the contact.
        directions: ``(d,)`` rad.
    """
    side = np.arange(-RIM, RIM + 1)
    corner = np.stack(np.meshgrid(side, side), axis=-1).reshape(-1, 2)
    along = np.stack([np.cos(directions), np.sin(directions)], axis=1) @ corner.T
    left = edge**2 - (corner**2).sum(axis=1) + along**2
    reach: FloatArray = np.where(left >= 0.0, along + np.sqrt(np.maximum(left, 0.0)), 0.0).max(axis=1)
    return reach
