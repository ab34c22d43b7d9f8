"""Contacts against the surface of a model at any size, place and turn: least squares of many hypotheses."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.spatial import cKDTree

from harness.basics.arrays import FloatArray, read_only
from harness.basics.geometry import apply
from harness.bench.gap import USUAL, BenchErrors
from harness.experiment.repeated_readings import PlaceTolerance, group_by_place, weigh_repeated
from harness.sim.solid.surface_samples import Surface

POINTS = 12
"""Places kept of a press."""

SHARE = 0.5
"""Fraction of the greatest indentation; deeper pixels show the object, not the gel stretched beside it."""

TOUCHED = 0.12e-3
"""M of indentation below which nothing was touched."""


NEAR = 6.0e-3
"""M before a touch within which the surface may be: the press, and the gel's and the model's errors."""

BETWEEN = 1.5e-3
"""M between places on a way that met nothing."""


@dataclass(frozen=True, eq=False)
class Patch:
    """Where a press met the object."""

    points: FloatArray  #: ``(POINTS, 3)`` m in base.
    normal: FloatArray  #: ``(3,)`` unit in base, out of the object: of the plane through them.
    base_from_gel: FloatArray | None = None
    """``(4, 4)`` pose of the gel as the arm reported it; None where the pose is unknown, and the points and
    the normal then tell whether two contacts are at one place."""

    @property
    def press_line(self) -> tuple[FloatArray, FloatArray]:
        """``(3,)`` centre of the gel in base in m, and ``(3,)`` unit press axis, into the object."""
        if self.base_from_gel is None:
            return self.points.mean(axis=0), -self.normal
        return self.base_from_gel[:3, 3], self.base_from_gel[:3, 2]


FACING = 12.0e-3
"""M of distance on the nominal object that a normal off by one unit is worth in the search for the nearest
sample: on a thin wall it is then the face that looks the contact's way."""

DISTANCE_SIGMA = 1.1e-3
"""M, of where a contact is along its normal: the arm's, the gel's and the shape's errors together."""

NORMAL_SIGMA = float(np.radians(10.0))
"""Rad; a contact on a rim has a plane's normal 20 to 40 degrees off, so it counts softly."""

CAP = 8.0
"""Of a contact's cost: one that is not of the object, or where the model errs, does not decide alone."""

PASSED = 1.0e-3
"""M inside an object from where on the middle of the gel cannot have been: less is the errors' doing."""

THROUGH = 3.0
"""Cost of a way that would have led through the object."""

READING = 0.2e-3
"""M, by which the places of all imprints lie off the object alike, as the gel hangs around what it meets: the
root mean square over ten runs of seeds 40, 60 and 61."""

GEL_THICKNESS = 2.5e-3
"""Thickness in m of a gel whose sensor is not stated."""

USUAL_PLACE = PlaceTolerance.from_errors(USUAL, GEL_THICKNESS)
"""Largest differences between two contacts at one place, on a bench whose errors are not stated."""

UNKNOWNS = 8
"""Log of the size over the nominal one; x, y, m; yaw, rad; height, m; tilts about x and y, rad; depth, m."""

_SIZE, _X, _Y, _YAW, _Z, _TILT_X, _TILT_Y, _DEPTH = range(UNKNOWNS)


@dataclass(frozen=True)
class StandErrors:
    """How well it is known where the object stands: standard deviations."""

    place: float = 0.1  #: m, per axis of the plane.
    support: float = 1.0e-3  #: m, of the height.
    tilt: float = float(np.radians(0.5))  #: rad, per axis, of the object's own stand.
    depth: float = 0.54e-3
    """m, along its axis, of where the gel is on the arm and how deep it reads: of all contacts alike."""
    same_place: PlaceTolerance = USUAL_PLACE  #: largest differences between two contacts that count as one.

    @classmethod
    def at(
        cls, bench: BenchErrors, place: float, support: float, same_place: PlaceTolerance = USUAL_PLACE
    ) -> "StandErrors":
        """Derive the errors from those of the bench.

        Args:
            bench: standard deviations that the station states.
            place: standard deviation of the object's position per axis of the plane in m.
            support: standard deviation of the support's height in m.
            same_place: largest differences between two contacts that count as one.
        """
        depth = float(np.linalg.norm([bench.gel_centre, bench.gel_depth, READING]))
        return cls(place, support, bench.tilt, depth, same_place)


@dataclass(frozen=True, eq=False)
class Stand:
    """The nominal object as it stands, upright in base, its bottom's middle at the origin."""

    points: FloatArray  #: ``(n, 3)`` m, samples of its surface.
    normals: FloatArray  #: ``(n, 3)`` unit, outward.
    spacing: float  #: m between samples.
    place: FloatArray  #: ``(3,)`` m in base: where that middle nominally is.
    errors: StandErrors = StandErrors()  #: of that.

    @classmethod
    def of(
        cls,
        surface: Surface,
        upright: FloatArray,
        bottom: FloatArray,
        place: FloatArray,
        errors: StandErrors | None = None,
    ) -> "Stand":
        """From samples in the object's frame.

        Args:
            surface: samples.
            upright: ``(3, 3)`` rotation of the object, standing, in base.
            bottom: ``(3,)`` m in the object's frame: its bottom's middle.
            place: ``(3,)`` m in base.
            errors: of that; None for the usual ones.
        """
        turned = (surface.points - bottom) @ upright.T, surface.normals @ upright.T
        return cls(*turned, surface.spacing, place, errors or StandErrors())

    @cached_property
    def places(self) -> cKDTree:
        """Over places alone."""
        return cKDTree(self.points)

    @cached_property
    def deepest(self) -> float:
        """M: no place in the object is farther from a sample: half its least extent, and the spacing."""
        return float(0.5 * np.ptp(self.points, axis=0).min() + self.spacing)

    @cached_property
    def tree(self) -> cKDTree:
        """Over places and, weighed, the way that the surface faces there."""
        return cKDTree(np.hstack([self.points, FACING * self.normals]))


class FreeSpace:
    """Places that the gel has passed: no part of the object is there.

    Args:
        stand: the object.
        lines: ``(n, 3)`` m in base each, places along one way of the gel's middle.
    """

    def __init__(self, stand: Stand, lines: Sequence[FloatArray]) -> None:
        self._stand = stand
        kept = [line for line in lines if len(line)]
        self._ends = np.cumsum([0, *map(len, kept)])[:-1]
        self._places = np.concatenate(kept) - stand.place if kept else np.zeros((0, 3))

    def cost(self, unknowns: FloatArray) -> FloatArray:
        """``(k,)`` for ``(k, UNKNOWNS)`` hypotheses: so much for every way that leads through the object."""
        if not len(self._places):
            return np.zeros(len(unknowns))
        standing, _ = _in_stand(unknowns, self._places[None])
        scale = np.exp(unknowns[:, _SIZE])[:, None, None]
        tree, most = self._stand.places, self._stand.deepest
        near = tree.query((standing[:, 0] / scale).reshape(-1, 3), distance_upper_bound=most)[1]
        shape = standing[:, 0].shape
        outside = (near == tree.n).reshape(shape[:-1])  # what has no sample so near is not in the object
        near = np.minimum(near, tree.n - 1)
        points, faced = self._stand.points[near].reshape(shape), self._stand.normals[near].reshape(shape)
        apart = standing[:, 0] - scale * points
        deep = -np.einsum("kni,kni->kn", apart, faced)
        # Straight under a sample, not beside an edge of which it is the nearest.
        aside = np.linalg.norm(apart + deep[..., None] * faced, axis=-1)
        inside = (deep > PASSED) & (aside < self._stand.spacing * scale[..., 0]) & ~outside
        return THROUGH * np.asarray(
            np.logical_or.reduceat(inside, self._ends, axis=1).sum(axis=1), np.float64
        )


def distinct_paths(paths: Sequence[FloatArray], tolerance: PlaceTolerance) -> list[FloatArray]:
    """Keep the longest of the paths of the gel that lead along one line to one place.

    Args:
        paths: ``(n, 3)`` points in base in m each, along one straight path, its end first.
        tolerance: largest differences between two paths to one place.
    """
    long = [path for path in paths if len(path) > 1]  # a single point has no direction to compare
    if not long:
        return list(paths)
    ends = np.array([path[0] for path in long])
    axes = ends - np.array([path[-1] for path in long])
    places = group_by_place(ends, axes / np.linalg.norm(axes, axis=1, keepdims=True), tolerance)
    longest: dict[int, FloatArray] = {}
    for place, path in zip(places.tolist(), long, strict=True):
        longest[place] = max(longest.get(place, path), path, key=len)
    return [*longest.values(), *(path for path in paths if len(path) == 1)]


class TouchProblem:
    """Least squares of contacts over ``(k, UNKNOWNS)``.

    Args:
        stand: the object.
        patches: of the contacts.
        points: of each patch that are used; the first are spread the widest.
        slack: by which share a sample that is taken for the nearest may be farther than it.
    """

    def __init__(self, stand: Stand, patches: Sequence[Patch], points: int, slack: float = 0.0) -> None:
        self.stand = stand
        self._slack = slack
        places = [patch.points[:points] - stand.place for patch in patches]
        self._points = np.array(places).reshape(len(patches), points, 3)
        self._normals = np.array([patch.normal for patch in patches]).reshape(-1, 3)
        lines = np.array([patch.press_line for patch in patches]).reshape(-1, 2, 3)
        visited = group_by_place(lines[:, 0], lines[:, 1], stand.errors.same_place)
        self._shares = weigh_repeated(visited)
        self.places = len(np.unique(visited))
        """number of different places that were touched; the contacts of one place count once."""

    def refined(self, unknowns: FloatArray, rounds: int, fixed_size: bool) -> tuple[FloatArray, FloatArray]:
        """Downhill from each hypothesis.

        Args:
            unknowns: ``(k, UNKNOWNS)``.
            rounds: steps, each with the nearest samples looked up anew.
            fixed_size: whether the size stays as it is.

        Returns:
            ``(k, UNKNOWNS)`` unknowns and ``(k,)`` costs, half sums of squares with the prior, each's best.
        """
        best, least = unknowns.copy(), np.full(len(unknowns), np.inf)
        here = unknowns.copy()
        for last in range(rounds + 1):
            residuals, slopes, cost = self._linear(here)
            better = cost < least
            best[better], least[better] = here[better], cost[better]
            if last < rounds:
                prior = self._prior**2
                normal = np.einsum("kri,krj->kij", slopes, slopes) + np.diag(prior)
                gradient = np.einsum("kri,kr->ki", slopes, residuals) + prior * here
                first = 1 if fixed_size else 0
                scale = np.einsum("kii->ki", normal)[:, first:] * 1e-3 + 1e-6
                inner = normal[:, first:, first:] + scale[..., None] * np.eye(UNKNOWNS - first)
                step = np.zeros_like(here)
                step[:, first:] = -np.linalg.solve(inner, gradient[:, first:, None])[..., 0]
                reach = np.array([0.3, 0.05, 0.05, 0.5, 0.01, 0.02, 0.02, 2.0e-3])
                here = here + np.asarray(np.clip(step, -reach, reach))
        return best, least

    def sigma(self, unknowns: FloatArray) -> float:
        """Of the size's logarithm at ``(UNKNOWNS,)`` unknowns, all else free, to first order."""
        normal = self.information(unknowns) + 1e-9 * np.eye(UNKNOWNS)
        return float(np.sqrt(np.linalg.inv(normal)[_SIZE, _SIZE]))

    def information(self, unknowns: FloatArray) -> FloatArray:
        """``(UNKNOWNS, UNKNOWNS)`` inverse covariance at ``(UNKNOWNS,)`` of them, to first order."""
        _, slopes, _ = self._linear(unknowns[None])
        return np.asarray(slopes[0].T @ slopes[0] + np.diag(self._prior**2))

    @property
    def _prior(self) -> FloatArray:
        e = self.stand.errors
        sigmas = [np.inf, e.place, e.place, np.inf, e.support, e.tilt, e.tilt, e.depth]
        return 1.0 / np.array(sigmas)

    def _linear(self, unknowns: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """``(k, c)`` deviations, weighed by the cap, their slopes ``(k, c, UNKNOWNS)``, costs ``(k,)``."""
        k, (c, m) = len(unknowns), self._points.shape[:2]
        scale, turn = np.exp(unknowns[:, _SIZE]), _turns(unknowns)
        standing, offset = _in_stand(unknowns, self._points)
        normals = np.einsum("cj,kji->kci", self._normals, turn)
        facing = np.broadcast_to(FACING * normals[:, :, None], standing.shape)
        query = np.concatenate([standing / scale[:, None, None, None], facing], axis=-1)
        near = self.stand.tree.query(query.reshape(-1, 6), eps=self._slack)[1].reshape(k, c, m)
        points, faced = self.stand.points[near], self.stand.normals[near]
        apart = standing - scale[:, None, None, None] * points
        distance = np.einsum("kcmi,kcmi->kcm", apart, faced).mean(axis=2) + unknowns[:, _DEPTH, None]
        distance = distance / DISTANCE_SIGMA
        mean = faced.mean(axis=2)
        across = np.linalg.norm(np.cross(normals, mean), axis=-1)
        angle = np.arctan2(across, np.einsum("kci,kci->kc", normals, mean)) / NORMAL_SIGMA
        along = apart - np.einsum("kcmi,kcmi->kcm", apart, faced)[..., None] * faced
        lateral = np.linalg.norm(along, axis=-1).mean(axis=2)
        beyond = np.maximum(lateral - scale[:, None] * 3.0e-3, 0.0) / DISTANCE_SIGMA
        cost = 0.5 * (distance**2 + np.minimum(angle, 3.0) ** 2 / 3.0 + beyond**2)
        capped = self._shares * CAP * (1.0 - np.exp(-cost / CAP))
        weight = np.sqrt(self._shares) * np.exp(-0.5 * cost / CAP)
        slopes = np.empty((k, c, UNKNOWNS))
        # Slopes of the distance along the sample's normal, in the standing frame.
        slopes[..., _SIZE] = -scale[:, None] * np.einsum("kcmi,kcmi->kcm", points, faced).mean(axis=2)
        in_base = np.einsum("kci,kji->kcj", mean, turn)
        slopes[..., _X], slopes[..., _Y], slopes[..., _Z] = (
            -in_base[..., 0],
            -in_base[..., 1],
            -in_base[..., 2],
        )
        # d(R^T v)/dyaw = (v_y, -v_x, 0) in the standing frame.
        turned = standing[..., 1] * faced[..., 0] - standing[..., 0] * faced[..., 1]
        slopes[..., _YAW] = turned.mean(axis=2)
        middle = offset.mean(axis=2)
        slopes[..., _TILT_X] = in_base[..., 1] * middle[..., 2] - in_base[..., 2] * middle[..., 1]
        slopes[..., _TILT_Y] = in_base[..., 2] * middle[..., 0] - in_base[..., 0] * middle[..., 2]
        slopes[..., _DEPTH] = 1.0
        prior = 0.5 * ((self._prior * unknowns) ** 2).sum(axis=1)
        weighed = weight[..., None] * slopes / DISTANCE_SIGMA
        return weight * distance, weighed, capped.sum(axis=1) + prior


def _turns(unknowns: FloatArray) -> FloatArray:
    cosine, sine = np.cos(unknowns[:, _YAW]), np.sin(unknowns[:, _YAW])
    turn = np.zeros((len(unknowns), 3, 3))
    turn[:, 0, 0] = turn[:, 1, 1] = cosine
    turn[:, 1, 0], turn[:, 0, 1], turn[:, 2, 2] = sine, -sine, 1.0
    return turn


def _in_stand(unknowns: FloatArray, places: FloatArray) -> tuple[FloatArray, FloatArray]:
    """``(k, c, m, 3)`` places ``(c, m, 3)`` as the standing object has them, and off its place in base."""
    moved = unknowns[:, [_X, _Y, _Z]]
    offset = places[None] - moved[:, None, None]
    tilt_x, tilt_y = unknowns[:, None, None, _TILT_X], unknowns[:, None, None, _TILT_Y]
    x, y, z = np.moveaxis(offset, -1, 0)
    tilted = np.stack([tilt_y * z, -tilt_x * z, tilt_x * y - tilt_y * x], axis=-1)
    return np.einsum("kcmj,kji->kcmi", offset - tilted, _turns(unknowns)), offset


def free_line(base_from_gel: FloatArray, length: float, touched: bool) -> FloatArray:
    """``(n, 3)`` m in base: places that the middle of the gel has passed, on its straight way to a press.

    Args:
        base_from_gel: ``(4, 4)`` at the end of the way; z into the object.
        length: m of the way.
        touched: whether it ended at the object, whose surface is then nearer than ``NEAR`` to its end.
    """
    back = np.arange(NEAR if touched else 0.0, length, BETWEEN)
    return read_only(base_from_gel[:3, 3] - back[:, None] * base_from_gel[:3, 2])


def patch_of(heights: FloatArray, pitch: float, base_from_gel: FloatArray) -> Patch | None:
    """The places that a press met; None where the gel touched nothing.

    Args:
        heights: ``(rows, columns)`` m of indentation.
        pitch: m of gel that a pixel shows.
        base_from_gel: ``(4, 4)`` as the arm reported it; z into the object.
    """
    deepest = float(heights.max())
    if not deepest > TOUCHED:
        return None
    rows, columns = np.nonzero(heights >= SHARE * deepest)
    count = np.array(heights.shape)
    across = (columns - 0.5 * (count[1] - 1)) * pitch
    along = (rows - 0.5 * (count[0] - 1)) * pitch
    in_gel = np.column_stack([across, along, -heights[rows, columns]])
    # Of the plane z = a x + b y + c through the places, towards the gel: -z.
    terms = np.column_stack([in_gel[:, :2], np.ones(len(in_gel))])
    slope = np.linalg.lstsq(terms, in_gel[:, 2], rcond=None)[0]
    normal = np.array([slope[0], slope[1], -1.0])
    normal /= np.linalg.norm(normal)
    # Places far from each other: each the farthest from those before, the middle first.
    level = in_gel[:, :2]
    chosen = [int(np.linalg.norm(level - level.mean(axis=0), axis=1).argmin())]
    apart = np.linalg.norm(level - level[chosen[0]], axis=1)
    while len(chosen) < POINTS:
        chosen.append(int(apart.argmax()))
        apart = np.minimum(apart, np.linalg.norm(level - level[chosen[-1]], axis=1))
    points, rotation = apply(base_from_gel, in_gel[chosen]), base_from_gel[:3, :3]
    return Patch(read_only(points), read_only(rotation @ normal), read_only(base_from_gel.copy()))
