"""Fit a smooth surface through all contacts with their normals (thin-plate RBF).

Rays along the border of a silhouette add places of the surface; contacts left out give its prediction error.

The covariance is that of Williams and Fitzgibbon (Gaussian process implicit surfaces, 2007),
``2 r^3 - 3 R r^2 + R^3``, where ``R`` is ``WIDER`` times what holds all data; values and gradients are both
observed. Its mean is the triharmonic interpolant of Hermite data, its variance says how far the surface may
be from it.
"""

import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy import ndimage
from scipy.linalg import cho_factor, cho_solve, solve_triangular
from scipy.spatial import ConvexHull, QhullError, cKDTree

from experiments.shape_reconstruction import thresholds as limits
from experiments.shape_reconstruction.evidence import ShapeEvidence
from experiments.shape_reconstruction.fits import SmoothSurface
from experiments.shape_reconstruction.smooth import free_space
from experiments.shape_reconstruction.smooth.free_space import (
    CLEARANCE,
    ContactSamples,
    Silhouette,
    all_samples,
    sensor_depth,
    silhouette_of,
    thinned,
)
from experiments.shape_reconstruction.smooth.grid import Grid
from experiments.shape_reconstruction.smooth.revolution import (
    SLACK,
    Revolution,
    RotatedSpace,
    find_revolution,
    rotated_space,
)
from harness.basics.arrays import FloatArray
from harness.basics.compiled import compiled

UNIT = 1.0 / 18.0
"""Amplitude at which gradients are as long as unit normals: of each component a variance of a third."""

_AMPLITUDES = (0.3, 1.0, 3.0, 10.0)
"""Over ``UNIT``, of which the likeliest is taken."""

_JITTER = 1e-10

WIDER = 1.3
"""Times the ball that holds all data, ``R``: over the whole of a ball ``R`` across the covariance of values
and gradients is not positive definite, over one of ``R / 1.2`` it is (eigenvalues for data on balls, spheres,
rings and rods)."""


@dataclass(frozen=True, eq=False)
class SurfaceData:
    """Observations of a field ``f`` that is 0 on a surface and grows outward with slope one."""

    points: FloatArray  #: ``(n, 3)`` m, where ``values`` are known.
    values: FloatArray  #: ``(n,)`` m.
    sigmas: FloatArray  #: ``(n,)`` m, one standard deviation of each value.
    normals: FloatArray  #: ``(n, 3)``, gradients there; ignored where ``normal_sigmas`` is infinite.
    normal_sigmas: FloatArray  #: ``(n,)`` one standard deviation of each component.

    def joined(self, other: "SurfaceData") -> "SurfaceData":
        """Both."""
        return SurfaceData(
            np.concatenate([self.points, other.points]),
            np.concatenate([self.values, other.values]),
            np.concatenate([self.sigmas, other.sigmas]),
            np.concatenate([self.normals, other.normals]),
            np.concatenate([self.normal_sigmas, other.normal_sigmas]),
        )


@dataclass(frozen=True, eq=False)
class ThinPlateField:
    """A fitted field; lengths inside are shares of ``reach``."""

    centre: FloatArray  #: ``(3,)`` m.
    reach: float  #: m, the ``R`` of the covariance.
    data: SurfaceData  #: that it was fitted to.
    weights: FloatArray  #: ``(n, 4)`` of value and gradient at every place.
    factor: FloatArray  #: ``(4 n, 4 n)`` lower Cholesky factor of the covariance of all data.
    amplitude: float  #: of the covariance.

    def values(self, points: FloatArray) -> FloatArray:
        """``(m,)`` m: the mean field at ``(m, 3)`` points."""
        local = self._local(points)
        found = _mean_values(local, self._local(self.data.points), self.weights * self.amplitude)
        return np.asarray(found * self.reach)

    def deviations(self, points: FloatArray) -> FloatArray:
        """``(m,)`` m: one standard deviation of the field at ``(m, 3)`` points."""
        between = self.amplitude * _covariances(self._local(points), self._local(self.data.points), 1)
        solved = solve_triangular(self.factor, between.T, lower=True, check_finite=False)
        variance = self.amplitude - np.einsum("ij,ij->j", solved, solved)
        return np.asarray(np.sqrt(np.maximum(variance, 0.0)) * self.reach)

    def _local(self, points: FloatArray) -> FloatArray:
        return np.ascontiguousarray((points - self.centre) / self.reach)


PITCH = 4.0e-3
"""Pitch of the grid on which the surface is extracted, m."""

MARGIN = 10.0e-3
"""Margin of the grid around the contacts, m."""

SLOPE, ENTERED_SLOPE = 0.3, 0.15
"""Largest distance beyond the hull of the contacts per m from the nearest contact; the same of a round body
that the sensor entered, whose contacts are rotated about its axis."""

FOOT = 0.6
"""Width of the hull at the support over that of the contacts."""

READING = 0.7e-3
"""M, one standard deviation of any part of the surface at least: errors that all contacts share."""

_HULL = 2.0e-3
_SILHOUETTE = 1.0e-3
_NORMAL = 0.1
_COPY_SIGMA, _COPY_NORMAL, _COPIES = 2.0e-3, 0.2, 120
_MOUTH = 0.05
_SOME = 1200
_NEAR = 2.0 * PITCH


@dataclass(frozen=True, eq=False)
class _Bounds:
    """Largest extent of the object: near the hull of ``(n, 3)`` points, m, and outside free space.

    Free space is rotated about the axis of a round body.
    """

    evidence: ShapeEvidence
    places: FloatArray
    silhouette: Silhouette | None
    room: RotatedSpace | None

    def beyond(self, points: FloatArray) -> FloatArray:
        """``(n,)`` m that points are outside; below 0 within."""
        outside = np.maximum(sensor_depth(self.evidence, points) - CLEARANCE, -points[:, 2])
        near = cKDTree(self.places).query(points)[0]
        slope = SLOPE if self.room is None else ENTERED_SLOPE
        try:
            sides = ConvexHull(self._hull_points).equations
        except QhullError:  # it is flat, and bounds nothing
            beyond = np.full(len(points), -1.0)
        else:
            beyond = np.full(len(points), -np.inf)
            for side in sides:
                np.maximum(beyond, points @ side[:3] + side[3], out=beyond)
        outside = np.maximum(outside, beyond - _HULL - slope * near)
        if self.room is not None:
            outside = np.maximum(outside, self.room.at(points) - SLACK)
        if self.silhouette is not None:
            outside = np.maximum(outside, self.silhouette.outside_metres(points) - _SILHOUETTE)
        return outside

    @property
    def _hull_points(self) -> FloatArray:
        middle = self.places.mean(axis=0)
        foot = (middle + FOOT * (self.places - middle)) * np.array([1.0, 1.0, 0.0])
        return np.concatenate([self.places, foot])


@dataclass(frozen=True, eq=False, kw_only=True)
class RbfFit(SmoothSurface):
    """The zero surface of a thin-plate field."""

    amplitude: float  #: scale of the field's covariance.
    axis: Revolution | None  #: axis that contacts are rotated about; None without one.

    def details(self) -> dict[str, object]:
        """Return JSON values of the result besides the surface."""
        return {
            **super().details(),
            "amplitude": self.amplitude,
            "left_out_m": self.left_out.tolist(),
            "axis_m": None if self.axis is None else [float(value) for value in self.axis.centre],
        }


def fit_rbf(evidence: ShapeEvidence, symmetric: bool = True) -> RbfFit:
    """Fit a thin-plate field through the contacts, and cut its zero surface by the free space.

    Args:
        evidence: one contact or more.
        symmetric: whether contacts that agree on an axis are turned about it where nothing was touched.

    Raises:
        FitRefused: no touch met the object.
        OutOfDomain: nothing is left of it: contacts and free space contradict each other.
    """
    start = time.perf_counter()
    whole = all_samples(evidence)
    samples = thinned(whole)
    silhouette = silhouette_of(evidence, samples.points)
    axis = find_revolution(samples) if symmetric else None
    normal_sigmas = np.maximum(samples.normal_sigmas, _NORMAL)
    data = SurfaceData(
        samples.points, np.zeros(len(samples.points)), samples.sigmas, samples.normals, normal_sigmas
    )
    low, high = _box(data.points, evidence.largest)
    by_contacts = field = fitted(data, low, high)
    left_out, outliers = _predict_left_out(evidence, by_contacts)
    if axis is not None:
        data = data.joined(_copies(axis, samples, evidence, silhouette))
        low, high = _box(data.points, evidence.largest)
        field = fitted(data, low, high, by_contacts.amplitude)
    room = None if axis is None else rotated_space(axis, samples, evidence)
    bounds = _Bounds(evidence, data.points, silhouette, room)
    if silhouette is not None:
        rim = _rim_data(silhouette, _cut(field, bounds), data.points, low, high)
        field = fitted(data.joined(rim), low, high, by_contacts.amplitude)
    grid = Grid.over(low, high, PITCH)
    body = grid.surface(grid.near_zero(_cut(field, bounds)), samples.points)
    mesh, sides = body.mesh, free_space.limited_sides(body.mesh, whole, silhouette)
    known = free_space.known_by(mesh, whole, silhouette)
    beyond = free_space.beyond_deviation(mesh, known, sides, evidence.largest)
    hollow = free_space.hollow_deviation(mesh, known, whole)
    smooth = _field_deviation(field, mesh.vertices)
    round_ = "supposed to be round about a vertical axis, as its contacts are" if axis else ""
    open_ = (
        "may be hollow: its top was touched nowhere near its middle" if (hollow > 0.0).mean() > _MOUTH else ""
    )
    return RbfFit(
        mesh=mesh,
        deviation=np.sqrt(smooth**2 + READING**2 + beyond**2 + hollow**2),
        known_by=known,
        not_bounded=free_space.not_bounded(sides),
        doubtful=outliers,
        flags=(*(flag for flag in (round_, open_) if flag), *body.notes),
        seconds=time.perf_counter() - start,
        estimator="rbf",
        counts={"contacts": len(evidence.contacts)},
        left_out=left_out,
        amplitude=field.amplitude,
        axis=axis,
    )


def _field_deviation(field: ThinPlateField, vertices: FloatArray) -> FloatArray:
    """Return ``(n,)`` m, the field's standard deviation at some vertices, interpolated at the others."""
    some = np.random.default_rng(0).permutation(len(vertices))[:_SOME]
    deviations = field.deviations(vertices[some])
    # The other vertices are as the nearest three of those.
    apart, near = (np.asarray(one) for one in cKDTree(vertices[some]).query(vertices, k=[1, 2, 3]))
    share = 1.0 / (apart + 1e-6)
    return np.asarray((share * deviations[near]).sum(axis=1) / share.sum(axis=1))


def _copies(
    axis: Revolution, samples: ContactSamples, evidence: ShapeEvidence, silhouette: Silhouette | None
) -> SurfaceData:
    """Places supposed by turning, where neither the sensor nor the picture says that nothing is."""
    places, normals = axis.copies(samples)
    free = sensor_depth(evidence, places) > CLEARANCE
    if silhouette is not None:
        free |= silhouette.outside_metres(places) > 2.0 * _SILHOUETTE
    places, normals = places[~free], normals[~free]
    some = np.random.default_rng(0).permutation(len(places))[:_COPIES]
    count = len(some)
    return SurfaceData(
        places[some],
        np.zeros(count),
        np.full(count, _COPY_SIGMA),
        normals[some],
        np.full(count, _COPY_NORMAL),
    )


def _box(points: FloatArray, largest: float) -> tuple[FloatArray, FloatArray]:
    low, high = points.min(axis=0) - MARGIN, points.max(axis=0) + MARGIN
    low[2] = 0.0
    high[2] = max(high[2], 2.0 * PITCH)
    return low, np.minimum(high, low + largest + 2.0 * MARGIN)


def _cut(field: ThinPlateField, bounds: _Bounds) -> Callable[[FloatArray], FloatArray]:
    """The field, and what bounds it where it might be inside."""

    def cut(points: FloatArray) -> FloatArray:
        values = field.values(points)
        near = values < _NEAR
        values[near] = np.maximum(values[near], bounds.beyond(points[near]))
        return values

    return cut


RAYS = 60
"""Along the whole border, evenly."""

SIGMA = 2.5e-3
"""M, one standard deviation of such a place along its normal: pixels, what is left of the camera's errors."""

NORMAL_SIGMA = 0.3
APART = 10.0e-3
"""Distance from a contact within which no such point is used, m."""

_DEPTHS = 40


def _rim_data(
    silhouette: Silhouette,
    field: Callable[[FloatArray], FloatArray],
    contacts: FloatArray,
    low: FloatArray,
    high: FloatArray,
) -> SurfaceData:
    """Find the minima of a field along rays of the border, as data of the surface."""
    pixels, outward = _border(silhouette)
    pose = silhouette.look.stand_from_camera
    origin = pose[:3, 3]
    middle = 0.5 * np.array(silhouette.look.mask.shape[::-1])
    in_camera = (pixels - middle - silhouette.shift) / silhouette.look.focal_length
    rays = np.column_stack([in_camera, np.ones(len(in_camera))]) @ pose[:3, :3].T
    corners = np.array(
        [[x, y, z] for x in (low[0], high[0]) for y in (low[1], high[1]) for z in (low[2], high[2])]
    )
    deep = (corners - origin) @ pose[:3, 2]
    depths = np.linspace(float(deep.min()), float(deep.max()), _DEPTHS)
    along = origin + depths[None, :, None] * rays[:, None]
    inside = ((along >= low) & (along <= high)).all(axis=2)
    values = np.where(inside, field(along.reshape(-1, 3)).reshape(inside.shape), np.inf)
    best = values.argmin(axis=1)
    places = along[np.arange(len(along)), best]
    normals = np.column_stack([outward, np.zeros(len(outward))]) @ pose[:3, :3].T
    kept = np.isfinite(values.min(axis=1))
    if len(contacts):
        kept &= cKDTree(contacts).query(places)[0] > APART
    count = int(kept.sum())
    return SurfaceData(
        places[kept], np.zeros(count), np.full(count, SIGMA), normals[kept], np.full(count, NORMAL_SIGMA)
    )


def _border(silhouette: Silhouette) -> tuple[FloatArray, FloatArray]:
    """``(n, 2)`` pixels of the mask's border that nothing may hide, and the direction out of the mask."""
    mask, hidden = silhouette.look.mask, silhouette.look.hidden
    rim = mask & ~ndimage.binary_erosion(mask) & ~ndimage.binary_dilation(hidden, iterations=2)
    rim[[0, -1]], rim[:, [0, -1]] = False, False  # there the picture ends, not the object
    rows, columns = np.nonzero(rim)
    if len(rows) == 0:
        return np.zeros((0, 2)), np.zeros((0, 2))
    slope = [ndimage.gaussian_filter(silhouette.outside, 1.5, order=order) for order in ((0, 1), (1, 0))]
    outward = np.column_stack([axis[rows, columns] for axis in slope])
    outward /= np.maximum(np.linalg.norm(outward, axis=1, keepdims=True), 1e-9)
    around = np.argsort(np.arctan2(rows - rows.mean(), columns - columns.mean()))
    some = around[np.unique(np.linspace(0, len(around) - 1, RAYS).astype(int))]
    return np.column_stack([columns + 0.5, rows + 0.5])[some], outward[some]


_SAME_PLACE = 1e-12


def _predict_left_out(evidence: ShapeEvidence, field: ThinPlateField) -> tuple[FloatArray, dict[int, float]]:
    """Predict each contact from the field without it.

    Returns ``(contacts,)`` rms distances of the contacts from their predictions, m, zero where thinning kept
    no point, and the distance of each outlier by the index of its touch, m.

    With ``P`` the inverse of the covariance, a block left out is off by ``inv(P_bb) (P y)_b``, with the
    covariance ``inv(P_bb)`` (Rasmussen and Williams, Gaussian processes for machine learning, 2006,
    section 5.4.2).
    """
    count = 4 * len(field.data.points)
    inverse = cho_solve((field.factor, True), np.eye(count), check_finite=False)
    errors, found = np.zeros(len(evidence.contacts)), {}
    for number, contact in enumerate(evidence.contacts):
        apart = ((field.data.points[:, None] - contact.points[None]) ** 2).sum(axis=2).min(axis=1)
        # Numbers of the values and gradients that are this contact's.
        rows = [4 * int(k) + i for k in np.nonzero(apart < _SAME_PLACE)[0] for i in range(4)]
        if len(rows) == 0:
            continue
        block = np.linalg.inv(inverse[np.ix_(rows, rows)])
        off = block @ field.weights.ravel()[rows]
        values = slice(0, None, 4)
        errors[number] = field.reach * float(np.sqrt(np.mean(off[values] ** 2)))
        mean = float(off[values].mean())
        sigma = float(np.sqrt(block[values, values].mean()))
        if abs(mean) > limits.MAX_PREDICTION_SIGMAS * sigma:
            found[contact.index] = abs(mean) * field.reach
    return errors, found


def fitted(
    data: SurfaceData, low: FloatArray, high: FloatArray, amplitude: float | None = None
) -> ThinPlateField:
    """The field of a roughness, or of the likeliest.

    Args:
        data: one place or more.
        low: ``(3,)`` m, of the box in which the field will be read.
        high: ``(3,)`` m.
        amplitude: of the covariance; None for the likeliest of a few.
    """
    corners = np.concatenate([data.points, low[None], high[None]])
    centre = 0.5 * (corners.min(axis=0) + corners.max(axis=0))
    reach = WIDER * 2.0 * float(np.linalg.norm(corners - centre, axis=1).max())
    local = np.ascontiguousarray((data.points - centre) / reach)
    prior = _covariances(local, local, 4)
    observed = np.column_stack([data.values / reach, data.normals]).ravel()
    noise = (
        np.column_stack([data.sigmas / reach, np.repeat(data.normal_sigmas[:, None], 3, axis=1)]).ravel() ** 2
    )
    kept = np.isfinite(noise)
    noise[~kept], observed[~kept] = 1.0, 0.0
    prior[~kept], prior[:, ~kept] = 0.0, 0.0  # what is not observed weighs nothing
    best: tuple[float, float, FloatArray, FloatArray] | None = None
    for tried in [a * UNIT for a in _AMPLITUDES] if amplitude is None else [amplitude]:
        total = tried * prior
        total[np.diag_indices_from(total)] += noise + _JITTER * tried
        lower, _ = cho_factor(total, lower=True, overwrite_a=True, check_finite=False)
        lower = np.tril(lower)
        weights = np.asarray(cho_solve((lower, True), observed, check_finite=False))
        likelihood = -0.5 * float(observed @ weights) - float(np.log(np.diag(lower)).sum())
        if best is None or likelihood > best[0]:
            best = likelihood, tried, lower, weights
    assert best is not None
    _, chosen, factor, weights = best
    return ThinPlateField(centre, reach, data, weights.reshape(-1, 4), factor, chosen)


@compiled
def _covariances(at: FloatArray, of: FloatArray, rows: int) -> FloatArray:
    """``(rows m, 4 n)`` covariances of values at ``(m, 3)`` places with all data of ``(n, 3)``.

    With 4 ``rows`` a place, of the value and of the three components of the gradient there; with 1, of the
    value alone.
    """
    found = np.zeros((rows * len(at), 4 * len(of)))
    d = np.empty(3)
    for m in range(len(at)):
        for n in range(len(of)):
            for axis in range(3):
                d[axis] = at[m, axis] - of[n, axis]
            r = np.sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2])
            found[rows * m, 4 * n] = 2.0 * r**3 - 3.0 * r * r + 1.0
            for i in range(3):
                found[rows * m, 4 * n + 1 + i] = 6.0 * (1.0 - r) * d[i]
                if rows == 1:
                    continue
                found[rows * m + 1 + i, 4 * n] = -6.0 * (1.0 - r) * d[i]
                for j in range(3):
                    bent = -6.0 * d[i] * d[j] / r if r > 0.0 else 0.0
                    straight = 6.0 * (1.0 - r) if i == j else 0.0
                    found[rows * m + 1 + i, 4 * n + 1 + j] = straight + bent
    return found


@compiled
def _mean_values(at: FloatArray, of: FloatArray, weights: FloatArray) -> FloatArray:
    found = np.zeros(len(at))
    for m in range(len(at)):
        total = 0.0
        for n in range(len(of)):
            x, y, z = at[m, 0] - of[n, 0], at[m, 1] - of[n, 1], at[m, 2] - of[n, 2]
            r2 = x * x + y * y + z * z
            r = np.sqrt(r2)
            total += weights[n, 0] * (2.0 * r * r2 - 3.0 * r2 + 1.0)
            total += 6.0 * (1.0 - r) * (weights[n, 1] * x + weights[n, 2] * y + weights[n, 3] * z)
        found[m] = total
    return found
