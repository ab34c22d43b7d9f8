"""What knows next to nothing, to be shown beside what claims to know more."""

import numpy as np

from experiments.scale_estimation.model import ObjectModel
from experiments.scale_estimation.size import SizeRange
from experiments.scale_estimation.sound.peaks import Peaks, RingingModel
from experiments.scale_estimation.touch.patch import Patch
from experiments.scale_estimation.vision.fit import View
from harness.basics.arrays import FloatArray
from harness.picture.outline import SeenOutline, directions

_TURNS = 8


def random_error(sizes: SizeRange, true: float) -> float:
    """M, the mean error of a size drawn from the range, even in its logarithm."""
    inside = np.exp(sizes.logs[sizes.inside.astype(bool)])
    return float(np.abs(inside - true).mean())


def constant(sizes: SizeRange) -> float:
    """M, the middle of the range."""
    return float(np.sqrt(sizes.low * sizes.high))


def by_first_peak(peaks: Peaks, model: RingingModel, nominal: float) -> float:
    """M, were the lowest peak the lowest mode."""
    return float(nominal * model.frequencies[0] / peaks.frequencies[0])


def by_area(outline: SeenOutline, view: View, nominal: float) -> float:
    """M, from the area of the outline's hull over the model's, over turns, at its nominal place."""
    stands = np.zeros((_TURNS, len(view.sigmas)))
    stands[:, 3] = np.arange(_TURNS) * 2.0 * np.pi / _TURNS
    reach = view.project(stands, view.corners) @ directions().T
    mean = float(np.mean([_area(one) for one in reach.max(axis=1)]))
    return float(nominal * np.sqrt(_area(outline.extents) / mean))


def by_box(outline: SeenOutline, view: View) -> float:
    """M, the longer side of the outline's box at the distance of where the object stands; no model of it."""
    count = len(outline.extents)
    widths = outline.extents + np.roll(outline.extents, -(count // 2))
    distance = (view.base_from_camera[:3, 2] @ (view.place - view.base_from_camera[:3, 3])) / view.focal_px
    return float(max(widths[0], widths[count // 4]) * distance)


def by_contacts_box(patches: list[Patch], model: ObjectModel) -> float:
    """M, from the area of the outline's hull over the model's, averaged over turns."""
    places = np.concatenate([patch.points for patch in patches])
    low = np.minimum(places.min(axis=0), [np.inf, np.inf, model.place[2]])
    return float((places.max(axis=0) - low).max())


def _area(extents: FloatArray) -> float:
    """Px^2, of the polygon whose sides stand so far out in evenly spaced directions."""
    step = 2.0 * np.pi / len(extents)
    before, after = np.roll(extents, 1), np.roll(extents, -1)
    sides = (before + after - 2.0 * extents * np.cos(step)) / np.sin(step)
    return float(0.5 * np.sum(extents * sides))
