"""How well a hypothesis agrees with where the contacts were and how the tool stood.

A hypothesis is a surface sample for one contact, the *anchor*, and a yaw of the object. The
arm's relative translations then say where every other contact was: each must lie on the
surface, and the tool must have stood near the normal there.

An object that stands a little crooked, or is a little larger than its model, and a gel that is not quite
where the tool's description puts it, move every contact at once. These shared errors are unknowns next to
place and yaw, so that only the arm's own error is left to each contact. The terms were fitted to runs on a
bench with the usual errors; on another bench each is wider or narrower in proportion to the errors that
cause it.
"""

from collections.abc import Iterator
from dataclasses import dataclass, field, replace

import numpy as np

from experiments.contact_localization.touch.touch import TouchNoise
from harness.basics.arrays import AnyArray, BoolArray, FloatArray, IntArray
from harness.basics.compiled import compiled
from harness.bench.gap import USUAL, BenchErrors
from harness.sim.solid.surface_samples import Surface

_GOOD = -0.5
"""Nats at which the nearest sample explains a place well enough not to look at its neighbours."""


@dataclass(frozen=True)
class GeometryNoise:
    """How far a contact may lie from the surface that the arm puts it on."""

    gap: float = 0.8e-3  #: metres, one sigma: arm, gel centre, shape.
    gap_per_metre: float = 8.0e-3
    """metres of sigma for each metre between the contact and the anchor: the object's scale and tilt."""
    free_angle: float = np.radians(16.0)
    """rad between tool and normal that cost nothing: the planner may tilt so far."""
    angle: float = np.radians(2.0)  #: rad, one sigma beyond it.
    cap: float = 10.0  #: the most that one contact may cost, nats; a slipped contact costs no more.


@dataclass(frozen=True, eq=False)
class Arrangement:
    """The contacts relative to the anchor, for every yaw, in the object's frame."""

    anchor: int  #: index of the contact that hypotheses place on the surface.
    offsets: FloatArray  #: ``(yaws, contacts, 3)`` metres from the anchor.
    axes: FloatArray  #: ``(yaws, contacts, 3)`` unit: where the tool pointed.

    def gap_sigmas(self, noise: GeometryNoise) -> FloatArray:
        """``(contacts,)`` metres."""
        lengths = np.linalg.norm(self.offsets[0], axis=1)
        return np.asarray(np.hypot(noise.gap, noise.gap_per_metre * lengths))


def arrange(
    object_from_base: FloatArray, points_in_base: FloatArray, axes_in_base: FloatArray, anchor: int
) -> Arrangement:
    """Contacts relative to the anchor.

    Args:
        object_from_base: ``(yaws, 3, 3)`` rotations.
        points_in_base: ``(contacts, 3)`` metres; only their differences are used.
        axes_in_base: ``(contacts, 3)`` unit.
        anchor: index of a contact.
    """
    relative = points_in_base - points_in_base[anchor]
    offsets = np.einsum("yij,kj->yki", object_from_base, relative)
    axes = np.einsum("yij,kj->yki", object_from_base, axes_in_base)
    return Arrangement(anchor, np.ascontiguousarray(offsets), np.ascontiguousarray(axes))


def possible_anchors(
    surface: Surface, arrangement: Arrangement, noise: GeometryNoise, use_axis: bool
) -> tuple[IntArray, IntArray]:
    """The (sample, yaw) pairs at which the tool could have stood at the anchor."""
    pairs = (len(surface.points), len(arrangement.axes))
    if not use_axis:
        samples, yaws = np.divmod(np.arange(pairs[0] * pairs[1]), pairs[1])
        return samples, yaws
    facing = -surface.normals @ arrangement.axes[:, arrangement.anchor].T
    limit = noise.free_angle + noise.angle * np.sqrt(2.0 * noise.cap)
    samples, yaws = np.nonzero(facing > np.cos(limit))
    return samples.astype(np.int64), yaws.astype(np.int64)


def geometry_scores(
    surface: Surface,
    arrangement: Arrangement,
    samples: IntArray,
    yaws: IntArray,
    log_prior: FloatArray,
    noise: GeometryNoise,
    use_axis: bool,
    within: float,
) -> FloatArray:
    """Log posterior of hypotheses by the contacts' places (and tool axes).

    Args:
        surface: of the object.
        arrangement: the contacts.
        samples: ``(n,)`` sample index of the anchor.
        yaws: ``(n,)`` yaw index.
        log_prior: ``(n,)`` nats.
        noise: of the terms.
        use_axis: whether the tool's attitude counts, or only places.
        within: nats; a hypothesis is given up, as -inf, once it is farther behind the best.

    Returns:
        ``(n,)`` nats, up to a constant; each contact costs at most ``noise.cap``.
    """
    table = surface.table
    return _geometry_scores(
        surface.points,
        surface.normals,
        surface.neighbours,
        surface.spacing,
        table.nearest,
        table.origin,
        table.pitch,
        arrangement.offsets,
        arrangement.axes,
        arrangement.anchor,
        samples,
        yaws,
        log_prior,
        arrangement.gap_sigmas(noise),
        noise.free_angle,
        noise.angle,
        noise.cap,
        use_axis,
        within,
    )


@compiled
def _best_fit(
    points: FloatArray,
    normals: FloatArray,
    spacing: float,
    samples: AnyArray,
    x: float,
    y: float,
    z: float,
    axis: FloatArray,
    sigma: float,
    free_angle: float,
    angle: float,
    use_axis: bool,
    best: float,
) -> float:
    """Nats of a place at the sample that explains it best, or ``best`` where none does better."""
    least_facing, square = np.cos(free_angle), sigma * sigma
    ax, ay, az = axis[0], axis[1], axis[2]
    most = -2.0 * best
    for sample in samples:
        dx, dy, dz = x - points[sample, 0], y - points[sample, 1], z - points[sample, 2]
        nx, ny, nz = normals[sample, 0], normals[sample, 1], normals[sample, 2]
        out = dx * nx + dy * ny + dz * nz
        cost = out * out / square
        # Most samples are given up here: roots and angles are for the few that are near.
        if cost >= most:
            continue
        # Between samples the surface goes on: only what exceeds their spacing is off the surface.
        aside = dx * dx + dy * dy + dz * dz - out * out
        if aside > spacing * spacing:
            along = np.sqrt(aside) - spacing
            cost += along * along / square
        if use_axis:
            facing = -(nx * ax + ny * ay + nz * az)
            if facing < least_facing and cost < most:
                cost += ((np.arccos(max(-1.0, facing)) - free_angle) / angle) ** 2
        most = min(most, cost)
    return float(-0.5 * most)


@compiled
def _geometry_scores(
    points: FloatArray,
    normals: FloatArray,
    neighbours: AnyArray,
    spacing: float,
    nearest: AnyArray,
    origin: FloatArray,
    pitch: float,
    offsets: FloatArray,
    axes: FloatArray,
    anchor: int,
    samples: IntArray,
    yaws: IntArray,
    log_prior: FloatArray,
    sigmas: FloatArray,
    free_angle: float,
    angle: float,
    cap: float,
    use_axis: bool,
    within: float,
) -> FloatArray:
    contacts, one = offsets.shape[1], np.empty(1, np.int64)
    scores = np.empty(len(samples))
    leader = -np.inf
    for n in range(len(samples)):
        i, j = samples[n], yaws[n]
        total = log_prior[n]
        for k in range(contacts):
            if total < leader - within:
                total = -np.inf
                break
            x = points[i, 0] + offsets[j, k, 0]
            y = points[i, 1] + offsets[j, k, 1]
            z = points[i, 2] + offsets[j, k, 2]
            a = int(np.floor((x - origin[0]) / pitch))
            b = int(np.floor((y - origin[1]) / pitch))
            c = int(np.floor((z - origin[2]) / pitch))
            inside = 0 <= a < nearest.shape[0] and 0 <= b < nearest.shape[1] and 0 <= c < nearest.shape[2]
            sample = -1
            if k == anchor:
                sample = i
            elif inside:
                sample = nearest[a, b, c]
            if sample < 0:
                total -= cap
                continue
            one[0] = sample
            axis = axes[j, k]
            best = _best_fit(
                points, normals, spacing, one, x, y, z, axis, sigmas[k], free_angle, angle, use_axis, -cap
            )
            # Near an edge the nearest sample may lie on the other face.
            if use_axis and k != anchor and best < _GOOD:
                about = neighbours[sample]
                best = _best_fit(
                    points, normals, spacing, about, x, y, z, axis, sigmas[k], free_angle, angle, True, best
                )
            total += best
        scores[n] = total
        leader = max(leader, total)
    return scores


UNKNOWNS = 6
"""Tilt about base x and y, scale, and the gel's centre in its own frame, each in units of its sigma."""


@dataclass(frozen=True)
class SharedNoise:
    """One sigma of what contacts share, and of what is left to each."""

    tilt: float = USUAL.tilt  #: rad, of the object about base x and about base y.
    scale: float = USUAL.scale  #: of the object's true size over its model's, less 1.
    gel_centre: float = USUAL.gel_centre  #: metres, of the gel's centre along each axis of its own frame.
    shift: float = USUAL.arm
    """sigma in m of each contact in the plane of the gel: error of the arm and of the local shape."""
    depth: float = USUAL.arm  #: metres, the same across it.
    per_metre: float = 2.0e-3
    """sigma in m per metre between contacts: errors of the shape that are not errors of its scale."""


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
"""Largest distance in m between two presses that count as one position."""


SAME_AXIS = np.radians(4.0)
"""Largest angle in rad between tool axes that count as equal."""


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
    """Return the noise of the images, with position noise of each contact if shared errors are modelled."""
    if not named:
        return noise.touch
    return replace(noise.touch, shift=noise.shared.shift, depth=noise.shared.depth)
