"""The shape of an object by the family: household shapes that the readings allow, and the surface between."""

import time
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy import ndimage
from scipy.spatial import cKDTree

from experiments.shape_reconstruction import thresholds as limits
from experiments.shape_reconstruction.evidence import ShapeEvidence
from experiments.shape_reconstruction.family import layout
from experiments.shape_reconstruction.family.contact_fit import (
    ContactFit,
    contact_fit,
    displacement,
    find_rotated_contacts,
    moved_points,
)
from experiments.shape_reconstruction.family.distance import distances
from experiments.shape_reconstruction.family.field import corners_of, median_surface
from experiments.shape_reconstruction.family.freedom import NuisanceCost
from experiments.shape_reconstruction.family.kind import FamilyShape
from experiments.shape_reconstruction.family.posterior import Mixture, mixture_of
from experiments.shape_reconstruction.family.search import LEVELS, FamilySearch, FamilySettings, Hypothesis
from experiments.shape_reconstruction.fits import SEEN, TOUCHED, UNOBSERVED, FamilyFit
from experiments.shape_reconstruction.smooth.free_space import (
    all_samples,
    beyond_deviation,
    limited_sides,
    silhouette_of,
)
from experiments.shape_reconstruction.smooth.free_space import not_bounded as open_axes
from experiments.shape_reconstruction.smooth.stated_space import longest_side, max_offset
from harness.basics.arrays import BoolArray, FloatArray, IntArray
from harness.basics.errors import FitRefused, OutOfDomain
from harness.basics.geometry import apply, inverse
from harness.basics.mesh import Mesh

SPREAD_OVER = 4
"""Samples of each hypothesis from which the spread at every vertex is computed."""

POINT_SIGMA = 1.6e-3
"""Standard deviation of each of a contact's eight points that a surface is moved to, m: they err together."""

FINER = "if they did not slip, a finer search may fit them: shape.method=family-fine, in thrice family's time"
"""Said where several contacts do not fit: a search may have missed the shape."""


def fit_family(
    evidence: ShapeEvidence, settings: FamilySettings | None = None, seeds: Sequence[Hypothesis] = ()
) -> FamilyFit:
    """Compute the median surface of the hypotheses that the readings allow, moved to its contacts.

    Args:
        evidence: one contact or a silhouette at least.
        settings: amount of search; the default level where not given.
        seeds: hypotheses of earlier fits of the same object, where the search begins as well.

    Raises:
        FitRefused: no hypothesis is at the stated place and of the stated size.
        OutOfDomain: nothing was touched or seen.
    """
    began = time.perf_counter()
    settings = settings or FamilySettings()
    if not evidence.sighted and not evidence.contacts:
        raise OutOfDomain(
            f"{len(evidence.touches)} touches met nothing and no silhouette was seen; a shape needs one "
            "contact or one silhouette: press at the object, or take its picture"
        )
    search = FamilySearch(evidence, settings)
    started = [search.start(seed.shape, seed.prior.middle) for seed in seeds]
    hypotheses = _at_stated_place(search.run(started), evidence)
    mixture = mixture_of(hypotheses, evidence.sighted, bool(evidence.contacts), settings.seed)
    turned = find_rotated_contacts(mixture.best.shape, evidence)
    fit, nuisance = contact_fit(mixture.best.shape, search.full), search.nuisance(mixture.best.shape)
    fit = replace(fit, doubtful=fit.doubtful | (turned > 0.0))
    rejected = _outliers(fit)
    touched = np.concatenate([np.empty((0, 3)), *(touch.points for touch in evidence.contacts)])
    body = median_surface(mixture, settings.pitch, touched)
    plain = body.mesh
    mesh = _warped(plain, mixture.best.shape, evidence, fit)
    found = FamilyFit(
        mesh=mesh,
        deviation=_deviation(plain, mixture, mesh, fit, evidence.sighted),
        known_by=known_by(mesh.vertices, evidence),
        not_bounded=not_bounded(
            evidence, mesh, fit.typical > limits.POOR_CONTACT_COST or nuisance.is_excessive
        ),
        doubtful={
            touch.index: float(off)
            for touch, off, bad in zip(evidence.contacts, fit.off, rejected, strict=True)
            if bad
        },
        flags=(*_flags(evidence, mixture, fit, nuisance, turned, settings), *body.notes),
        seconds=time.perf_counter() - began,
        estimator="family",
        left_out=np.zeros(len(evidence.contacts)),
        mixture=mixture,
        contact_cost=fit.typical,
        other_cost=fit.others,
        nuisance=nuisance,
        beyond_contacts=float(np.linalg.norm(beyond_contacts(mesh.vertices, evidence), axis=1).mean()),
        sighted=evidence.sighted,
    )
    return found if evidence.contacts else _by_picture_alone(found, evidence)


def _at_stated_place(hypotheses: list[Hypothesis], evidence: ShapeEvidence) -> list[Hypothesis]:
    """Those no larger than the scene allows and no farther from the stated place.

    Raises:
        FitRefused: there is none.
    """
    limit = limits.MAX_LENGTH_RATIO * evidence.largest
    kept = [
        one
        for one in hypotheses
        if longest_side(corners_of(one.shape)) <= limit
        and float(np.hypot(*one.shape.theta[: layout.Y + 1])) <= max_offset(evidence)
    ]
    if not kept:
        best = hypotheses[0].shape
        off = float(np.hypot(*best.theta[: layout.Y + 1]))
        raise FitRefused(
            f"the readings fit a household shape {longest_side(corners_of(best)):.2f} m long, {off:.2f} m "
            f"from the stated place; [shape] largest is {evidence.largest:g} m and the place is known to "
            f"{evidence.place_error * 1e3:g} mm; correct object.pose.position or these two"
        )
    return kept


def _by_picture_alone(found: FamilyFit, evidence: ShapeEvidence) -> FamilyFit:
    """Widen the deviation along the line of sight, which one outline does not limit."""
    sides = limited_sides(found.mesh, None, silhouette_of(evidence, np.zeros((0, 3))))
    beyond = beyond_deviation(found.mesh, found.known_by, sides, evidence.largest)
    return replace(
        found,
        deviation=np.hypot(found.deviation, beyond),
        not_bounded=open_axes(sides),
        flags=(*found.flags, "by the picture alone: its depth along the line of sight is supposed"),
    )


def _warped(mesh: Mesh, shape: FamilyShape, evidence: ShapeEvidence, fit: ContactFit) -> Mesh:
    places, offsets = moved_points(shape, evidence, ~_outliers(fit))
    sigma = np.full(len(places), POINT_SIGMA)
    far = (
        float(np.sqrt(np.mean(np.sum(offsets**2, axis=1))))
        if fit.typical > limits.OUTSIDE_CONTACT_COST
        else 0.0
    )
    moved = mesh.vertices + displacement(places - offsets, offsets, sigma, mesh.vertices, far)
    return Mesh(moved, mesh.faces)


def _outliers(fit: ContactFit) -> BoolArray:
    """``(contacts,)`` whether each is rejected: it fits none of the rest, and few are so.

    Where more do not fit, the shape is wrong, and the surface is moved to all of them.
    """
    if len(fit.doubtful) and fit.doubtful.mean() > limits.MAX_OUTLIER_FRACTION:
        return np.zeros_like(fit.doubtful)
    return fit.doubtful


def _deviation(plain: Mesh, mixture: Mixture, mesh: Mesh, fit: ContactFit, sighted: bool) -> FloatArray:
    """``(vertices,)`` m: spread of the hypotheses and about them, the warp, noise, and the underside."""
    total = np.zeros(len(plain.vertices))
    for one, weight, about in zip(mixture.hypotheses, mixture.weights, mixture.about, strict=True):
        shapes = (one.shape, *about[:SPREAD_OVER])
        for shape in shapes:
            gap = distances(shape.code, shape.theta, plain.vertices)
            total += weight / len(shapes) * gap**2
    moved = np.sum((mesh.vertices - plain.vertices) ** 2, axis=1)
    under = (mesh.vertex_normals[:, 2] < limits.UNDERSIDE_NORMAL) & (
        mesh.vertices[:, 2] < limits.UNDERSIDE_HEIGHT
    )
    known = (limits.SPREAD_FACTOR**2 * total + 0.25 * moved + limits.MIN_DEVIATION**2) * (
        1.0 + limits.MISFIT_GAIN * fit.typical
    )
    return np.asarray(
        np.sqrt(known + limits.UNDERSIDE_DEVIATION**2 * under) * (1.0 if sighted else limits.BLIND_FACTOR)
    )


def _flags(
    evidence: ShapeEvidence,
    mixture: Mixture,
    fit: ContactFit,
    nuisance: NuisanceCost,
    turned: FloatArray,
    settings: FamilySettings,
) -> list[str]:
    """State rival classes, a poor fit, and the contacts that do not fit, with the reason."""
    flags = []
    rivals = [name for name, weight in mixture.by_class().items() if weight >= limits.MIN_RIVAL_WEIGHT]
    if len(rivals) > 1:
        flags.append(f"class unknown: {' or '.join(rivals)}")
    if fit.typical > limits.OUTSIDE_CONTACT_COST:
        flags.append(
            f"outside the family: contacts are {np.median(fit.off) * 1e3:.1f} mm off the nearest such shape"
        )
    if nuisance.is_excessive:
        flags.append(f"outside the family: such a shape fits with {nuisance.largest}")
    listed = ", ".join(
        f"{touch.index} ({1e3 * gap:.1f} mm)"
        for touch, gap, bad in zip(evidence.contacts, fit.off, fit.doubtful, strict=True)
        if bad
    )
    finer = f"; {FINER}" if settings.draws < LEVELS["fine"].draws and fit.doubtful.sum() > 1 else ""
    if _outliers(fit).any():
        rest = 1e3 * float(np.median(fit.off[~fit.doubtful])) if not fit.doubtful.all() else np.inf
        flags.append(f"contacts rejected as outliers: {listed}, where the others fit to {rest:.1f} mm{finer}")
    elif fit.doubtful.any():
        flags.append(
            f"contacts off the household shape: {listed}; they are too many to have slipped and all "
            f"count{finer}"
        )
    angles = [
        f"{touch.index} ({np.degrees(angle):.0f} deg)"
        for touch, angle in zip(evidence.contacts, turned, strict=True)
        if angle > 0.0
    ]
    if angles:
        flags.append(f"contacts whose pose is turned against the rest: {', '.join(angles)}")
    return flags


def known_by(vertices: FloatArray, evidence: ShapeEvidence) -> IntArray:
    """Classify points as ``UNOBSERVED``, ``SEEN`` or ``TOUCHED``, ``(n,)``."""
    known = np.full(len(vertices), UNOBSERVED, np.int64)
    look = evidence.look
    if look is not None and look.mask.any():
        in_camera = apply(inverse(look.stand_from_camera), vertices)
        rows, columns = look.mask.shape
        depth = np.maximum(in_camera[:, 2], 1e-3)
        places = look.focal_length * in_camera[:, :2] / depth[:, None] + 0.5 * np.array([columns, rows])
        border = look.mask ^ ndimage.binary_erosion(look.mask)
        away = ndimage.distance_transform_edt(~(border & ~look.hidden))
        column, row = np.floor(places).astype(np.int64).T
        shown = (column >= 0) & (row >= 0) & (column < columns) & (row < rows) & (in_camera[:, 2] > 0.0)
        known[np.flatnonzero(shown)[away[row[shown], column[shown]] <= limits.BORDER_DISTANCE]] = SEEN
    points = [touch.points for touch in evidence.contacts]
    if points:
        known[cKDTree(np.concatenate(points)).query(vertices)[0] <= limits.FAMILY_TOUCH_DISTANCE] = TOUCHED
    return known


def not_bounded(evidence: ShapeEvidence, mesh: Mesh, outside: bool) -> tuple[str, ...]:
    """Names of the axes of ``stand`` along which nothing limits the object; by the support it is from below.

    The silhouette and a class that fits limit it all around. Where the class does not, the silhouette limits
    what the camera looks across, and the rest is limited by contacts near its ends alone. Without a
    silhouette contacts must look both ways along an axis, and end near the end of the answer.

    Args:
        evidence: one contact or a silhouette at least.
        mesh: the answer.
        outside: whether its contacts do not fit any class.
    """
    look = evidence.look
    if look is not None and look.mask.any():
        around = ndimage.binary_dilation(look.mask, iterations=2) & ~look.mask
        edge = look.mask.copy()
        edge[1:-1, 1:-1] = False
        hidden = int((around & look.hidden).sum()) + int(edge.sum())
        if hidden <= limits.MAX_HIDDEN_BORDER * max(int(around.sum()), 1):  # enough of its border is seen
            return open_without_class(evidence, mesh) if outside else ()
    normals = np.array([touch.mean_normal for touch in evidence.contacts]).reshape(-1, 3)
    beyond = beyond_contacts(mesh.vertices, evidence).max(axis=0)
    free = []
    for axis, name in enumerate("xyz"):
        upper = bool((normals[:, axis] > limits.MIN_LIMITING_NORMAL).any())
        lower = axis == 2 or bool((normals[:, axis] < -limits.MIN_LIMITING_NORMAL).any())
        if not (upper and lower) or beyond[axis] > limits.MAX_BEYOND_LAST:
            free.append(name)
    return tuple(free)


def open_without_class(evidence: ShapeEvidence, mesh: Mesh) -> tuple[str, ...]:
    """List the axes along which neither the silhouette nor contacts limit the object, whatever its class.

    Args:
        evidence: one contact or a silhouette at least.
        mesh: the answer.
    """
    samples = all_samples(evidence) if evidence.contacts else None
    touched = np.zeros((0, 3)) if samples is None else samples.points
    return open_axes(limited_sides(mesh, samples, silhouette_of(evidence, touched)))


def beyond_contacts(vertices: FloatArray, evidence: ShapeEvidence) -> FloatArray:
    """``(n, 3)`` m along each axis by which vertices lie outside of the box of all contacts and the support.

    Zero for all without a contact.
    """
    points = [touch.points for touch in evidence.contacts]
    if not points:
        return np.zeros_like(vertices)
    met = np.concatenate(points)
    low, high = met.min(axis=0), met.max(axis=0)
    low[2] = min(low[2], 0.0)
    return np.asarray(np.maximum(np.maximum(low - vertices, vertices - high), 0.0))
