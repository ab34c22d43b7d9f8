"""Bend the surface of the single-view prior to the contacts: the smooth surface where a picture was taken."""

import time
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from scipy import ndimage
from scipy.linalg import cho_factor, cho_solve
from scipy.spatial.distance import cdist

from experiments.shape_reconstruction.evidence import SeenMask, ShapeEvidence
from experiments.shape_reconstruction.fits import SmoothSurface, folds_of
from experiments.shape_reconstruction.prior.network import (
    BLUR,
    closing_field,
    prior_deviation,
    require_silhouette,
    shipped,
)
from experiments.shape_reconstruction.smooth.free_space import (
    CLEARANCE,
    ContactSamples,
    Silhouette,
    all_samples,
    known_by,
    limited_sides,
    not_bounded,
    sensor_depth,
    thinned,
)
from experiments.shape_reconstruction.smooth.grid import Grid
from harness.basics.arrays import FloatArray, IntArray, read_only

AMPLITUDE, LENGTH = 6.0e-3, 20.0e-3
"""Standard deviation and correlation length of the prior's error, m."""

MARGIN = 30.0e-3
"""Distance from the prior to the border of the grid, m: contacts bend its surface no farther."""

BEFORE, BEHIND = 4.0e-3, 2.0e-3
"""Distances along a contact's normal at which the field is known besides on the surface, m."""

READING = 0.7e-3
"""Least standard deviation of any part of the surface, m: errors that all contacts share."""

_POINT, _OFFSET = 1.0e-3, 1.5e-3
_SILHOUETTE = 1.0e-3


@dataclass(frozen=True, eq=False)
class _Data:
    """Observations of the field by contacts."""

    points: FloatArray  #: ``(n, 3)`` m.
    residuals: FloatArray  #: ``(n,)`` signed distance that a contact states less that of the prior, m.
    sigmas: FloatArray  #: ``(n,)`` one standard deviation of each, m.
    touches: IntArray  #: ``(n,)`` the contact that each is of.
    on_surface: IntArray  #: ``(n,)`` whether it is a place that was touched.


def bend_prior(evidence: ShapeEvidence) -> SmoothSurface:
    """Bend the single-view prior to the contacts, within the visual hull and the free space.

    The signed distance of the prior's surface is the mean of a Gaussian process; contacts correct it nearby.

    Raises:
        FitRefused: no contact, no silhouette, or the prior does not apply to it.
        OutOfDomain: contacts, silhouette and free space leave no body.
    """
    start = time.perf_counter()
    whole = all_samples(evidence)
    unshifted = require_silhouette(evidence)
    silhouette = Silhouette.of(unshifted.look, whole.points)
    samples = thinned(whole)
    grid, field, prior_error = _prior_distance(unshifted.look)
    data = _contact_data(samples, grid, field)
    precision = cho_factor(_covariance(data.points, data.points) + np.diag(data.sigmas**2))
    weights = cho_solve(precision, data.residuals)
    values, places = field.copy(), grid.points
    near = np.flatnonzero(field < MARGIN)  # farther out contacts bend nothing into the body
    values[near] = np.maximum(field[near], _outside(evidence, silhouette, places[near]))
    near = near[(values[near] < 2.0 * grid.pitch) & (field[near] > -MARGIN)]
    bent = field[near] + _covariance(places[near], data.points) @ weights
    values[near] = np.maximum(bent, _outside(evidence, silhouette, places[near]))
    body = grid.surface(values, whole.points)
    contacts = len(evidence.contacts)
    covariance = _covariance(data.points, data.points) + np.diag(data.sigmas**2)
    left_out = np.zeros(contacts)
    for fold in folds_of(contacts):
        out = np.isin(data.touches, fold)
        predicted = np.zeros(int(out.sum()))
        if not out.all():
            solved = cho_solve(cho_factor(covariance[np.ix_(~out, ~out)]), data.residuals[~out])
            predicted = covariance[np.ix_(out, ~out)] @ solved
        errors, surface = data.residuals[out] - predicted, data.on_surface[out] == 1
        for contact in fold:
            own = surface & (data.touches[out] == contact)
            # Thinning leaves nothing of a contact that lies on another: that one predicts it.
            left_out[contact] = float(np.sqrt(np.mean(errors[own] ** 2))) if own.any() else 0.0
    known, sides = known_by(body.mesh, whole, silhouette), limited_sides(body.mesh, whole, silhouette)
    between = _covariance(body.mesh.vertices, data.points)
    explained = np.einsum("ij,ji->i", between, cho_solve(precision, between.T)) / AMPLITUDE**2
    unsure = max(prior_error, float(np.sqrt(np.mean(left_out**2))))
    return SmoothSurface(
        mesh=body.mesh,
        deviation=np.hypot(unsure * np.sqrt(np.clip(1.0 - explained, 0.0, 1.0)), READING),
        known_by=known,
        not_bounded=not_bounded(sides),
        doubtful={},
        flags=body.notes,
        seconds=time.perf_counter() - start,
        estimator="bent prior",
        counts={"contacts": len(evidence.contacts)},
        left_out=left_out,
    )


@lru_cache(maxsize=4)
def _prior_distance(look: SeenMask) -> tuple[Grid, FloatArray, float]:
    """A grid around the prior, ``(corners,)`` m its signed distance, and m, its standard deviation.

    The estimates of a run share one picture: its prior is kept.
    """
    points = shipped().points(look)
    grid, closing = closing_field(points, MARGIN)
    inside = closing.reshape(grid.shape) < 0.0
    apart = ndimage.distance_transform_edt(~inside) - ndimage.distance_transform_edt(inside)
    signed = grid.pitch * (apart - 0.5 * np.sign(apart))
    field = read_only(np.asarray(ndimage.gaussian_filter(signed, BLUR)).ravel())
    return grid, field, prior_deviation(Silhouette.of(look, np.zeros((0, 3))), points)


def _contact_data(samples: ContactSamples, grid: Grid, field: FloatArray) -> _Data:
    count = len(samples.points)
    points = np.concatenate([samples.points + by * samples.normals for by in (0.0, BEFORE, -BEHIND)])
    stated = np.repeat([0.0, BEFORE, -BEHIND], count)
    at = ((points - grid.origin) / grid.pitch).T
    prior = ndimage.map_coordinates(field.reshape(grid.shape), at, order=1, mode="nearest")
    return _Data(
        points,
        stated - prior,
        np.repeat([_POINT, _OFFSET, _OFFSET], count),
        np.tile(samples.touches, 3),
        np.repeat([1, 0, 0], count),
    )


def _covariance(a: FloatArray, b: FloatArray) -> FloatArray:
    return np.asarray(AMPLITUDE**2 * np.exp(-0.5 * cdist(a, b, "sqeuclidean") / LENGTH**2))


def _outside(evidence: ShapeEvidence, silhouette: Silhouette, places: FloatArray) -> FloatArray:
    """``(n,)`` m by which places are outside the visual hull, below the support or in the sensor's path."""
    outside = np.maximum(silhouette.outside_metres(places) - _SILHOUETTE, -places[:, 2])
    return np.asarray(np.maximum(outside, sensor_depth(evidence, places) - CLEARANCE))
