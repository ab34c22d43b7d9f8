"""The touch term: does the object, seen along the tool, look there as the gel says it does?

With the tool's attitude known, what the gel would read at every place of the object is a
crop of one orthographic depth image along the tool's axis: one render answers for all
candidates of a contact, and what stands in the way of the sensor is in the picture.
"""

from dataclasses import dataclass, replace

import numpy as np

from experiments.contact_localization.touch.kernels import (
    Reading,
    Sigmas,
    fill_scores,
    leanings_at,
    terms_at,
)
from harness.basics.arrays import BoolArray, FloatArray, IntArray, block_means, read_only
from harness.bench.gap import USUAL
from harness.sim.gel.view import ToolView

UPRIGHT: FloatArray = read_only(np.zeros(3))
"""Of a gel that stands as its view does."""

LEVEL_SLOPE = 0.06
"""Mean slope of a pixel below which it may be the gel at rest."""

UNKNOWN_INDENTATION = 1.0e-3
"""Metres that a press usually leaves at the gel's centre."""

CONTACT_THRESHOLD = 0.12e-3
"""Metres of indentation, averaged over a compared pixel, below which no contact is seen."""


@dataclass(frozen=True)
class TouchNoise:
    """How far a recovered height map may be from the predicted one."""

    rms: float = USUAL.gel_depth
    """metres, root mean square over the touched area at the true place, one sigma."""
    tilt: float = np.radians(1.75)
    """rad, one sigma about each axis of the image: sensor frame and object's attitude."""
    spin: float = USUAL.gel_yaw  #: rad, one sigma of the image's turn in its own plane.
    skirt: float = 1.0e-3  #: metres, sigma of the blur that stands for the gel hanging from the contact.
    edge: float = 0.6e-3
    """metres, sigma of the blur over the contact's own edges: what the sensor cannot resolve."""
    shift: float = 0.6e-3
    """metres, one sigma in the plane of the gel of where the arm says a contact was relative to the
    others."""
    depth: float = 0.6e-3  #: metres, one sigma across it.
    cap: float = 12.0  #: the most that one contact may cost, nats.

    @property
    def sigmas(self) -> Sigmas:
        """As the loops take them."""
        return float(self.rms), float(self.tilt), float(self.spin)

    def with_model(self, rms: float, touch: "TouchMap") -> "TouchNoise":
        """With what the predicted maps are themselves off by.

        Its square is spread over the whole map, and a misfit is counted over the touched area: an error at a
        narrow edge weighs as much there as the same one over a full face, of fewer pixels.

        Args:
            rms: m, root mean square over a whole map.
            touch: that is compared.
        """
        share = touch.heights.size / max(1, len(touch.touched))
        return replace(self, rms=float(np.hypot(self.rms, rms * np.sqrt(share))))


@dataclass(frozen=True, eq=False)
class TouchMap:
    """What the gel read at one contact, reduced to what the term compares."""

    heights: FloatArray  #: ``(rows, columns)`` metres of indentation, at ``pitch``.
    pitch: float  #: metres.
    touched: IntArray
    """``(n, 2)`` row and column of the pixels surely in contact; empty for a contact that the image does not
    show."""
    flat: BoolArray
    """``(rows, columns)`` where the gel is level: pressed by something level, or at rest beyond an edge too
    steep for its height to be read from the colour."""
    skirt: FloatArray  #: ``(m,)`` one half of the skirt's kernel, from its centre out.
    edge: FloatArray  #: ``(m,)`` one half of the kernel that softens the contact's own edges.

    @property
    def reading(self) -> Reading:
        """As the loops take it."""
        return self.heights, self.pitch, self.touched, self.flat, self.skirt, self.edge


@dataclass(frozen=True, eq=False)
class Contact:
    """One contact as the estimator knows it."""

    base_from_gel: FloatArray  #: ``(4, 4)``; its translation is used only against other contacts'.
    touch: TouchMap | None = None  #: what the gel read; None for a contact whose image must not be used.
    coarse: TouchMap | None = None  #: the same at half the resolution, for a first look at many places.

    @property
    def shows_contact(self) -> bool:
        """Whether there is an image and it shows one."""
        return self.touch is not None and len(self.touch.touched) > 0

    @property
    def axis(self) -> FloatArray:
        """``(3,)`` unit, in base: where the tool points."""
        return np.asarray(self.base_from_gel[:3, 2])

    @property
    def indentation(self) -> float:
        """Metres at the gel's centre, or what presses usually leave where the image does not say."""
        if self.touch is None or not self.shows_contact:
            return UNKNOWN_INDENTATION
        heights = self.touch.heights
        rows, columns = heights.shape
        middle = heights[(rows - 1) // 2 : rows // 2 + 1, (columns - 1) // 2 : columns // 2 + 1]
        return float(middle.mean())


def touch_map(
    heights: FloatArray, pitch: float, block: int, skirt: float, edge: float, threshold: float
) -> TouchMap:
    """A height map averaged over blocks of pixels.

    Args:
        heights: ``(rows, columns)`` metres of indentation.
        pitch: metres a pixel.
        block: pixels a side; rows and columns left over are cut evenly at both ends.
        skirt: metres, sigma of the gel's blur around a contact.
        edge: metres, sigma of the blur of the contact itself.
        threshold: metres; a map that rises no higher shows no contact.
    """
    rows, columns = heights.shape[0] // block, heights.shape[1] // block
    top, left = (heights.shape[0] - rows * block) // 2, (heights.shape[1] - columns * block) // 2
    cut = heights[top : top + rows * block, left : left + columns * block]
    coarse = block_means(cut, block)
    peak = float(coarse.max())
    core = coarse > max(threshold, 0.4 * peak)
    touched = np.argwhere(core) if peak > threshold else np.empty((0, 2), dtype=np.int64)
    coarse_pitch = pitch * block
    steepness = np.hypot(*np.gradient(cut, pitch))
    return TouchMap(
        read_only(np.ascontiguousarray(coarse)),
        coarse_pitch,
        read_only(touched),
        read_only((block_means(steepness, block) < LEVEL_SLOPE) & (coarse > 0.0)),
        read_only(_half_kernel(skirt / coarse_pitch)),
        read_only(_half_kernel(edge / coarse_pitch)),
    )


def contact_of(
    base_from_gel: FloatArray, heights: FloatArray, pitch: float, block: int, noise: TouchNoise
) -> Contact:
    """A contact from its pose ``(4, 4)`` and its height map in metres at ``pitch`` metres a pixel."""
    fine = touch_map(heights, pitch, block, noise.skirt, noise.edge, CONTACT_THRESHOLD)
    # A contact of one fine pixel is still seen in the four times larger one that holds it.
    coarse = touch_map(heights, pitch, 2 * block, noise.skirt, noise.edge, 0.25 * CONTACT_THRESHOLD)
    return Contact(base_from_gel, fine, coarse)


def _half_kernel(sigma: float) -> FloatArray:
    """A Gaussian of ``sigma`` pixels from its centre out, all of it summing to 1."""
    kernel = np.exp(-0.5 * (np.arange(int(np.ceil(2.5 * sigma)) + 1) / sigma) ** 2)
    return np.asarray(kernel / (kernel[0] + 2.0 * kernel[1:].sum()))


def view_scores(view: ToolView, touch: TouchMap, noise: TouchNoise, pixels: IntArray) -> None:
    """Fill in the touch term at ``(n, 2)`` pixels (row, column) of a view."""
    fill_scores(
        view.depth,
        view.score,
        view.gel_depth,
        view.lean,
        touch.reading,
        noise.sigmas,
        pixels,
    )


def touch_terms(
    view: ToolView,
    touch: TouchMap,
    noise: TouchNoise,
    places: FloatArray,
    step: int,
    rings: int,
    shift: float,
    temperature: float,
    turns: FloatArray = UPRIGHT,
) -> FloatArray:
    """Log-likelihood of one contact's image and place under each hypothesis.

    The arm's error is integrated out: the contact may have been at any of the cells around
    the place that a hypothesis gives it, each at the price of its distance.

    Args:
        view: along the tool, under the hypotheses' yaw.
        touch: what the gel read.
        noise: of the term.
        places: ``(n, 3)`` metres in view coordinates: the gel's centre, x, y and depth.
        step: pixels between cells.
        rings: cells looked at on each side.
        shift: metres, one sigma of the place in the plane of the gel.
        temperature: factor on the image's share.
        turns: ``(n, 3)`` or ``(3,)`` by which the gel is turned against the view under each hypothesis, as
            ``turns_between`` has them.

    Returns:
        ``(n,)`` nats, not below ``-noise.cap``.
    """
    return terms_at(
        view.origin,
        view.pitch,
        view.depth,
        view.nearest,
        view.farthest,
        view.score,
        view.gel_depth,
        view.lean,
        touch.reading,
        noise.sigmas,
        places,
        np.broadcast_to(turns, (len(places), 3)),
        step,
        rings,
        shift,
        noise.depth,
        noise.cap,
        temperature,
    )


def best_fit(
    view: ToolView,
    touch: TouchMap,
    noise: TouchNoise,
    place: FloatArray,
    shift: float,
    turn: FloatArray = UPRIGHT,
) -> float:
    """How well a contact fits near one place: nats of its best cell, untempered and uncapped.

    Args:
        view: along the tool.
        touch: what the gel read.
        noise: of the term.
        place: ``(3,)`` metres in view coordinates: the gel's centre.
        shift: metres, one sigma of the place in the plane of the gel.
        turn: ``(3,)`` by which the gel is turned against the view.
    """
    rings = int(np.ceil(3.0 * shift / view.pitch))
    column, row = np.round((place[:2] - view.origin) / view.pitch).astype(np.int64)
    around = np.arange(-rings, rings + 1)
    rows, columns = view.depth.shape
    r, c = (a.ravel() for a in np.meshgrid(row + around, column + around, indexing="ij"))
    inside = (r >= 0) & (r < rows) & (c >= 0) & (c < columns)
    r, c = r[inside], c[inside]
    view_scores(view, touch, noise, np.ascontiguousarray(np.column_stack([r, c])))
    dx = view.origin[0] + c * view.pitch - place[0]
    dy = view.origin[1] + r * view.pitch - place[1]
    dz = place[2] - view.gel_depth[r, c]
    cost = (dx**2 + dy**2) / shift**2 + (dz / noise.depth) ** 2
    fits = (
        view.score[r, c]
        + leanings_at(view.lean[r, c], *turn)
        - 0.5 * np.where(np.isfinite(cost), cost, np.inf)
    )
    return float(fits.max(initial=-np.inf))
