"""How sure each contact's place is, and how much its image counts beside the others'."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from experiments.contact_localization.posterior.hypotheses import Noise
from experiments.contact_localization.touch.touch import TouchNoise
from harness.basics.arrays import FloatArray, IntArray

SAME_PLACE = 1.5e-3
"""Metres between two presses that count as one place."""

SAME_AXIS = np.radians(4.0)
"""rad between their tools."""

_CAP_ALONE = 1000.0
"""Nats: beyond what any place that fits costs, and a number where none does."""


def contact_scales(
    positions: FloatArray,
    axes: FloatArray,
    members: IntArray,
    noise: Noise,
    per_metre: float,
    named: bool,
) -> Iterator[tuple[int, float, float]]:
    """Contact, sigma of its place in metres, and temperature of its image.

    Args:
        positions: ``(contacts, 3)`` metres in base.
        axes: ``(contacts, 3)`` unit in base: where the tool points.
        members: ``(m,)`` indices of the contacts that count.
        noise: of the terms.
        per_metre: metres of sigma for each metre from the contacts' middle, where errors that they share are
            not named.
        named: whether they are; what is left to each contact is less.
    """
    own = place_noise(noise, named)
    reach = np.linalg.norm(positions[members] - positions[members].mean(axis=0), axis=1)
    sigmas = np.hypot(own.shift, (noise.shared.per_metre if named else per_metre) * reach)
    temperatures = noise.temperature / _alike(positions[members], axes[members]).sum(axis=1)
    for k, sigma, temperature in zip(members, sigmas, temperatures, strict=True):
        yield int(k), float(sigma), float(temperature)


def place_noise(noise: Noise, named: bool) -> TouchNoise:
    """Of the images; of the places what is each contact's own, where the shared errors are named."""
    if not named:
        return noise.touch
    return replace(noise.touch, shift=noise.shared.shift, depth=noise.shared.depth)


def cap_of(noise: TouchNoise, contacts: int) -> float:
    """Nats that each of so many contacts may cost: one alone is no outlier.

    An outlier fits every place alike, and where other contacts fit they say where it was. Of a contact alone
    it would make all places alike, of which there are many more than such as fit.
    """
    return noise.cap if contacts > 1 else _CAP_ALONE


def _alike(positions: FloatArray, axes: FloatArray) -> FloatArray:
    """``(m, m)``: presses repeated at one place share their errors: their images together count as one."""
    gaps = np.linalg.norm(positions[:, None] - positions[None], axis=2)
    return np.asarray((gaps < SAME_PLACE) & (axes @ axes.T > np.cos(SAME_AXIS)), dtype=np.float64)
