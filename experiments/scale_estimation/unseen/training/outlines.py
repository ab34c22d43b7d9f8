"""The regression of outlines, fitted to outlines of shapes of the families."""

from pathlib import Path

import numpy as np

from experiments.scale_estimation.unseen.regression import WEIGHTS, Regression, features_of, products
from experiments.scale_estimation.vision.vision import View
from harness.basics.arrays import FloatArray
from harness.basics.geometry import transform
from harness.basics.mesh import hull_of
from harness.picture.camera_errors import CameraErrors
from harness.picture.outline import SeenOutline, directions
from harness.sim.solid.household.families import FAMILIES, draw

PICTURES = 6
"""Of each shape: other sizes, turns and cameras."""

HELD_OUT = 0.2
RIDGE = 3.0
SIZES = (0.05, 0.6)
PIXELS = 0.3
"""Deviation of an outline's reach."""

PLACE = np.array([-0.42, 0.0, 0.25])
"""M in base, where objects stand."""

PUT = 20.0e-3
"""M, deviation per axis of where an object was put."""

_FOCAL = 600.0


def pictures(shapes: int, seed: int) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """``(n, d)`` features, ``(n,)`` logarithms of size over mean width, sizes in m, numbers of the shapes."""
    random = np.random.default_rng(seed)
    rows, targets, sizes, numbers = [], [], [], []
    names = list(FAMILIES)
    for shape in range(shapes):
        corners = hull_of(draw(names[shape % len(names)], random).inside.nodes)
        for _ in range(PICTURES):
            size = float(np.exp(random.uniform(*np.log(SIZES))))
            row, mean = picture(corners, size, random)
            rows.append(row)
            targets.append(np.log(size / mean))
            sizes.append(size)
            numbers.append(shape)
    return np.array(rows), np.array(targets), np.array(sizes), np.array(numbers)


def picture(corners: FloatArray, size: float, random: np.random.Generator) -> tuple[FloatArray, float]:
    """One look by a camera that is a little off from where it is said to be."""
    camera = drawn_camera(random)
    view = View(camera, _FOCAL, (320.0, 240.0), corners, PLACE)
    errors = CameraErrors(place=PUT)
    sigmas = View(camera, _FOCAL, (320.0, 240.0), corners, PLACE, errors).sigmas
    unknowns = np.where(
        np.isinf(sigmas), 0.0, np.where(np.isinf(sigmas), 1.0, sigmas) * random.standard_normal(14)
    )
    unknowns[0], unknowns[3] = np.log(size), random.uniform(0.0, 2.0 * np.pi)
    extents = (view.project(unknowns[None], corners)[0] @ directions().T).max(axis=0)
    extents = extents + PIXELS * random.standard_normal(len(extents))
    seen = SeenOutline(extents, np.zeros(len(extents), bool))
    return features_of(seen, camera, _FOCAL, PLACE)


def drawn_camera(random: np.random.Generator) -> FloatArray:
    """``(4, 4)``, looking at where the object stands."""
    elevation, turn = random.uniform(0.2, 1.0), random.uniform(0.0, 2.0 * np.pi)
    back = np.array([np.cos(elevation) * np.cos(turn), np.cos(elevation) * np.sin(turn), np.sin(elevation)])
    eye = PLACE + random.uniform(0.9, 1.8) * back
    right = np.cross(-back, [0.0, 0.0, 1.0])
    right /= np.linalg.norm(right)
    return transform(np.stack([right, np.cross(-back, right), -back], axis=1), eye)


def fitted(features: FloatArray, targets: FloatArray) -> Regression:
    """Ridge regression; its ``sigma`` is of the fit itself."""
    middle, spread = features.mean(axis=0), features.std(axis=0)
    terms = products((features - middle) / spread)
    normal = terms.T @ terms + RIDGE * np.eye(terms.shape[1])
    weights = np.linalg.solve(normal, terms.T @ targets)
    sigma = float(np.std(terms @ weights - targets))
    return Regression(middle, spread, np.asarray(weights), np.asarray(np.linalg.inv(normal)), sigma)


def train_outlines(shapes: int, seed: int, folder: Path) -> str:
    """Fit, write, and say what it reaches on shapes that were held out."""
    features, targets, sizes, numbers = pictures(shapes, seed)
    held = numbers >= (1.0 - HELD_OUT) * shapes
    found = fitted(features[~held], targets[~held])
    expected, deviations = found.size(features[held])
    apart = expected - targets[held]
    # So wide that nine tenths of the shapes held out are within.
    wider = float(np.quantile(np.abs(apart) / deviations, 0.9) / 1.645)
    error = 1e2 * np.abs(np.expm1(apart)) * sizes[held]
    np.savez(
        folder / Path(WEIGHTS).name,
        middle=found.middle,
        spread=found.spread,
        weights=found.weights,
        inverse=found.inverse,
        sigma=found.sigma * wider,
    )
    return (
        f"outline: {shapes} shapes of {len(FAMILIES)} families, {len(targets)} outlines; held out "
        f"{held.sum()}: mean error {error.mean():.2f} cm, median {np.median(error):.2f}, sizes "
        f"{1e2 * SIZES[0]:g} to {1e2 * SIZES[1]:g} cm; fitted {1e2 * found.sigma:.1f} %, stated "
        f"{1e2 * found.sigma * wider:.1f} %"
    )
