"""Predict contacts that were left out of a fit of the shape family, and the outline in the picture."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from scipy import ndimage

from experiments.shape_reconstruction.estimators.free_space import shift_sigma
from experiments.shape_reconstruction.evidence import SeenMask, ShapeEvidence
from experiments.shape_reconstruction.family.classes import FamilyShape
from experiments.shape_reconstruction.family.contacts.fit import contact_fit, moved_points
from experiments.shape_reconstruction.family.estimate import OUTSIDE, POINT_SIGMA
from experiments.shape_reconstruction.family.search import FamilySearch, Hypothesis
from experiments.shape_reconstruction.family.settings import FamilySettings
from experiments.shape_reconstruction.family.sight import directions_of
from experiments.shape_reconstruction.family.warp import displacement
from experiments.shape_reconstruction.fusion.acceptance import folds_of
from experiments.shape_reconstruction.surface import ShapeEstimate
from harness.basics.arrays import FloatArray
from harness.basics.faces.ray_mesh import RayMesh
from harness.basics.mesh import Mesh

HYPOTHESES, ROUNDS = 3, 10
"""Hypotheses that are fitted again without some contacts, and rounds of each fit."""

AROUND = 24
"""Pixels around the silhouette in which a surface is compared with it."""

_BORDER = 1.0
"""Pixels that a rendered border and a mask's differ by besides the camera's error."""


def predict_left_out(found: ShapeEstimate, evidence: ShapeEvidence) -> FloatArray:
    """Fit the family's hypotheses without each part of the contacts, and measure those that were left out.

    Args:
        found: by the family; its hypotheses are where each fit begins.
        evidence: that it was found from.

    Returns:
        ``(contacts,)`` rms distance of each from the surface fitted and bent to the others, m.
    """
    contacts = evidence.contacts
    errors = np.zeros(len(contacts))
    for fold in folds_of(len(contacts)):
        kept = evidence.without(fold)
        search = FamilySearch(kept, FamilySettings())
        best = min((_fitted_again(search, one) for one in _hypotheses(found)), key=lambda one: one.cost)
        shape = best.shape
        bent_to = moved_points(shape, kept, np.ones(len(kept.contacts), bool))
        typical = contact_fit(shape, search.full).typical
        far = float(np.sqrt(np.mean(np.sum(bent_to[1] ** 2, axis=1)))) if typical > OUTSIDE else 0.0
        for k in fold:
            which = np.array([one is contacts[k] for one in contacts])
            points, offsets = moved_points(shape, evidence, which)
            sigma = np.full(len(bent_to[0]), POINT_SIGMA)
            moved = displacement(bent_to[0] - bent_to[1], bent_to[1], sigma, points - offsets, far)
            errors[k] = float(np.sqrt(np.mean(np.sum((offsets - moved) ** 2, axis=1))))
    return errors


def _hypotheses(found: ShapeEstimate) -> Sequence[Mapping[str, Any]]:
    stated: Sequence[Mapping[str, Any]] = found.details["hypotheses"]  # type: ignore[assignment]
    return stated[:HYPOTHESES]


def _fitted_again(search: FamilySearch, stated: Mapping[str, Any]) -> Hypothesis:
    code, numbers = np.array(stated["code"], np.int64), np.array(stated["numbers"], np.float64)
    begun = search.seeded(FamilyShape(str(stated["class"]), code, numbers), np.array(stated["drawn_about"]))
    return search.refined(begun, ROUNDS, last=True)


def outline_error(mesh: Mesh, look: SeenMask | None) -> float:
    """Measure the share of the silhouette that a surface misses or adds beyond the camera's error.

    Args:
        mesh: closed surface, m in ``stand``.
        look: the silhouette; None without a picture.

    Returns:
        Pixels missed and added over the silhouette's; zero without a silhouette.
    """
    if look is None or not look.mask.any():
        return 0.0
    rows, columns = np.nonzero(ndimage.binary_dilation(look.mask, iterations=AROUND))
    window = slice(rows.min(), rows.max() + 1), slice(columns.min(), columns.max() + 1)
    mask, known = look.mask[window], ~look.hidden[window]
    row, column = np.indices(mask.shape)
    pixels = np.column_stack([column.ravel() + window[1].start + 0.5, row.ravel() + window[0].start + 0.5])
    hits = RayMesh(mesh).first_hits(look.stand_from_camera[:3, 3], directions_of(look, pixels))
    shown = np.isfinite(hits.distance).reshape(mask.shape)
    if not shown.any():
        return 1.0
    depth = float(np.median(hits.distance[np.isfinite(hits.distance)]))
    near = _BORDER + shift_sigma(look, depth)
    added = shown & known & (ndimage.distance_transform_edt(~mask) > near)
    missed = mask & known & (ndimage.distance_transform_edt(~shown) > near)
    return float((added.sum() + missed.sum()) / mask.sum())
