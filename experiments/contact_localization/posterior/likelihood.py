"""How well a hypothesis agrees with where the contacts were and how the tool stood.

A hypothesis is a surface sample for one contact, the *anchor*, and a yaw of the object. The
arm's relative translations then say where every other contact was: each must lie on the
surface, and the tool must have stood near the normal there.
"""

from dataclasses import dataclass

import numpy as np

from harness.basics.arrays import AnyArray, FloatArray, IntArray
from harness.basics.compiled import compiled
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
