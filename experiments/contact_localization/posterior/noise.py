"""Noise of every term: what all contacts share, what each has to itself, and how much its image counts.

An object that stands a little crooked, or is a little larger than its model, and a gel that is not quite
where the tool's description puts it, move every contact at once. These shared errors are unknowns next to
place and yaw, so that only the arm's own error is left to each contact. The terms were fitted to runs on a
bench with the usual errors; on another bench each is wider or narrower in proportion to the errors that
cause it.
"""

from collections.abc import Iterator
from dataclasses import dataclass, field, replace

import numpy as np

from experiments.contact_localization.posterior.likelihood import GeometryNoise
from experiments.contact_localization.touch.touch import TouchNoise
from harness.basics.arrays import BoolArray, FloatArray, IntArray
from harness.bench.bench_errors import USUAL, BenchErrors

UNKNOWNS = 6
"""Tilt about base x and y, scale, and the gel's centre in its own frame, each in units of its sigma."""


@dataclass(frozen=True)
class SharedNoise:
    """One sigma of what contacts share, and of what is left to each."""

    tilt: float = USUAL.tilt  #: rad, of the object about base x and about base y.
    scale: float = USUAL.scale  #: of the object's true size over its model's, less 1.
    gel_centre: float = USUAL.gel_centre  #: metres, of the gel's centre along each axis of its own frame.
    shift: float = USUAL.arm
    """metres, left to each contact in the plane of the gel: the arm, and the shape there."""
    depth: float = USUAL.arm  #: metres, the same across it.
    per_metre: float = 2.0e-3
    """metres of sigma left for each metre between contacts: what a shape's error is not, a scale."""


@dataclass(frozen=True)
class Noise:
    """The noise of every term, as measured on calibration runs."""

    geometry: GeometryNoise = field(default_factory=GeometryNoise)  #: of places and tool axes.
    unread: GeometryNoise = field(default_factory=lambda: GeometryNoise(gap=1.2e-3, angle=np.radians(4.0)))
    """the same where no image is read: how far the gel was pressed in, and past which edge, is not known
    there, so that the surface met may face elsewhere than the one that was aimed at."""
    touch: TouchNoise = field(default_factory=TouchNoise)  #: of the images.
    temperature: float = 0.8  #: factor on the images' share: their errors are shared between contacts.
    shared: SharedNoise = field(default_factory=SharedNoise)
    """of what all contacts share, and of what is left to each where that is named."""
    floor: float = 1.0
    """factor on what regions are widened by beside the hypotheses' own spread (``estimate.FLOORS``)."""


def moves(noise: SharedNoise, places: FloatArray, attitudes: FloatArray, members: BoolArray) -> FloatArray:
    """``(contacts, 6, 3)`` metres in base by which a sigma of each shared error moves each contact's gel.

    Against their mean over the contacts that count: moving all alike is a hypothesis's own place, and what
    errors do beside that says little of it, so that the two are drawn apart from each other. To first order,
    of which the next is a micrometre or so at half a degree and 100 mm.

    Args:
        noise: the sigmas.
        places: ``(contacts, 3)`` metres in base, of the gel's centre.
        attitudes: ``(contacts, 3, 3)``: of the gel in base.
        members: ``(contacts,)`` whether each counts; at least one.
    """
    tilted = noise.tilt * np.cross(np.eye(3)[None, :2], places[:, None])
    turned = noise.gel_centre * np.swapaxes(attitudes, 1, 2)
    each = np.concatenate([tilted, noise.scale * places[:, None], turned], axis=1)
    return np.asarray(each - each[members].mean(axis=0))


def log_prior(shared: FloatArray | None) -> FloatArray | float:
    """``(n,)`` nats, up to a constant; 0 where nothing is named."""
    return 0.0 if shared is None else np.asarray(-0.5 * np.sum(shared**2, axis=1))


def noise_at(errors: BenchErrors) -> Noise:
    """The noise of the terms, and of what all contacts share.

    Args:
        errors: of the bench, as its station states them.
    """
    noise = Noise()
    place, own = _ratio(errors, "arm", "gel_centre"), _ratio(errors, "arm")
    turn = _ratio(errors, "yaw", "tilt", "gel_tilt", "arm_tilt")  # all that turns the gel against the surface
    touch = replace(
        noise.touch,
        rms=noise.touch.rms * _ratio(errors, "gel_depth"),
        tilt=noise.touch.tilt * turn,
        spin=noise.touch.spin * _ratio(errors, "gel_yaw"),
        shift=noise.touch.shift * place,
        depth=noise.touch.depth * place,
    )
    shared = replace(
        noise.shared,
        tilt=errors.tilt,
        scale=errors.scale,
        gel_centre=errors.gel_centre,
        shift=noise.shared.shift * own,
        depth=noise.shared.depth * own,
        per_metre=noise.shared.per_metre * own,
    )
    return replace(
        noise,
        geometry=_geometry(noise.geometry, errors, place, turn),
        unread=_geometry(noise.unread, errors, place, turn),
        touch=touch,
        shared=shared,
        floor=noise.floor * own,
    )


def _ratio(errors: BenchErrors, *names: str) -> float:
    """Of errors that add in squares, over the usual ones."""
    ours, usual = (np.linalg.norm([getattr(some, name) for name in names]) for some in (errors, USUAL))
    return float(ours / usual)


def _geometry(noise: GeometryNoise, errors: BenchErrors, place: float, turn: float) -> GeometryNoise:
    reach = _ratio(errors, "scale", "tilt")
    return replace(
        noise,
        gap=noise.gap * place,
        gap_per_metre=noise.gap_per_metre * reach,
        angle=noise.angle * turn,
    )


SAME_PLACE = 1.5e-3
"""Metres between two presses that count as one place."""


SAME_AXIS = np.radians(4.0)
"""rad between their tools."""


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
    # Presses repeated at one place share their errors: their images together count as one.
    gaps = np.linalg.norm(positions[members][:, None] - positions[members][None], axis=2)
    alike = (gaps < SAME_PLACE) & (axes[members] @ axes[members].T > np.cos(SAME_AXIS))
    temperatures = noise.temperature / np.asarray(alike, dtype=np.float64).sum(axis=1)
    for k, sigma, temperature in zip(members, sigmas, temperatures, strict=True):
        yield int(k), float(sigma), float(temperature)


def place_noise(noise: Noise, named: bool) -> TouchNoise:
    """Of the images; of the places what is each contact's own, where the shared errors are named."""
    if not named:
        return noise.touch
    return replace(noise.touch, shift=noise.shared.shift, depth=noise.shared.depth)
