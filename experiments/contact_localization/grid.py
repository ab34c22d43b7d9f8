"""The exact posterior over a grid of places and yaws, then refined between the grid's points.

A hypothesis fixes where the gel's centre was at the first contact, in the object's frame, and
the object's yaw; the arm's translations carry it to every other contact. Its position enters
only through differences, so where the bench stands cannot matter.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

import numpy as np

from experiments.contact_localization.likelihood import (
    GeometryNoise,
    arrange,
    geometry_terms,
    possible_anchors,
)
from experiments.contact_localization.model import Model, Prior
from experiments.contact_localization.surface import Surface
from experiments.contact_localization.touch import TouchMap, TouchNoise, View, best_fit, touch_terms
from experiments.contact_localization.view import view_along
from harness.arrays import FloatArray, IntArray
from harness.sim.compiled import compiled

_KNOWN_YAWS = np.radians(np.arange(-5.0, 5.5, 1.0))
_ALL_YAWS = np.radians(np.arange(0.0, 360.0, 2.0))
_PRUNE = 30.0
_MOST_HYPOTHESES = 20_000
_UNKNOWN_INDENTATION = 1.0e-3
SAME_PLACE = 1.5e-3
SAME_AXIS = np.radians(4.0)


@dataclass(frozen=True, eq=False)
class Contact:
    """One contact as the estimator knows it.

    Attributes:
        base_from_gel: ``(4, 4)``; its translation is used only against other contacts'.
        touch: what the gel read; None for a contact whose image must not be used.
    """

    base_from_gel: FloatArray
    touch: TouchMap | None

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
            return _UNKNOWN_INDENTATION
        heights = self.touch.heights
        rows, columns = heights.shape
        middle = heights[(rows - 1) // 2 : rows // 2 + 1, (columns - 1) // 2 : columns // 2 + 1]
        return float(middle.mean())


@dataclass(frozen=True, eq=False)
class Hypotheses:
    """Weighted places of the gel's centre at the first contact.

    Attributes:
        gels: ``(n, 3)`` metres, in the object's frame.
        yaws: ``(n,)`` rad away from the nominal one.
        log_weights: ``(n,)`` nats, the greatest 0.
    """

    gels: FloatArray
    yaws: FloatArray
    log_weights: FloatArray

    @property
    def weights(self) -> FloatArray:
        """``(n,)``, summing to 1."""
        weights = np.exp(self.log_weights)
        return np.asarray(weights / weights.sum())

    def best(self, within: float, most: int) -> "Hypotheses":
        """Those within so many nats of the best, evenly thinned where they are more than ``most``."""
        kept = _best(self.log_weights, within, most)
        return Hypotheses(self.gels[kept], self.yaws[kept], self.log_weights[kept])


@dataclass(frozen=True)
class Noise:
    """The noise of every term, as measured on calibration runs.

    Attributes:
        geometry: of places and tool axes.
        touch: of the images.
        temperature: factor on the images' share: their errors are shared between contacts.
    """

    geometry: GeometryNoise = field(default_factory=GeometryNoise)
    touch: TouchNoise = field(default_factory=TouchNoise)
    temperature: float = 0.3


class Search:
    """One run's contacts over one object: what every stage of the grid shares."""

    def __init__(
        self, contacts: Sequence[Contact], model: Model, prior: Prior, spacing: float, noise: Noise
    ) -> None:
        self.contacts = tuple(contacts)
        self.model = model
        self.prior = prior
        self.noise = noise
        self.surface: Surface = model.surface(spacing)
        self.yaws = _KNOWN_YAWS if prior.yaw == "known" else _ALL_YAWS
        self.positions = np.array([contact.base_from_gel[:3, 3] for contact in contacts])
        self.positions -= self.positions[0]
        self.axes = np.array([contact.axis for contact in contacts])
        self.touch_pitch = next((c.touch.pitch for c in contacts if c.touch is not None), 1.0e-3)
        self._views: dict[tuple[int, int], View] = {}

    def view(self, contact: int, picture: int) -> View:
        """The object along the tool at a contact, under the yaw of a numbered picture."""
        if (contact, picture) not in self._views:
            nominal = 0.0 if self.prior.yaw == "known" else _ALL_YAWS[picture]
            object_from_base = self.prior.object_from_base(np.array([nominal]))[0]
            object_from_gel = object_from_base @ self.contacts[contact].base_from_gel[:3, :3]
            pitch = 0.5 * self.touch_pitch
            self._views[contact, picture] = view_along(
                self.model.raster, object_from_gel, pitch, self.model.sensor
            )
        return self._views[contact, picture]

    def grid(self, members: IntArray, anchor: int, use_axis: bool = True) -> Hypotheses:
        """Hypotheses on the surface's samples, weighed by the places and tool axes of some contacts.

        Args:
            members: ``(m,)`` indices of the contacts that count.
            anchor: the one of them that a hypothesis puts on a sample.
            use_axis: whether the tool's attitude counts, or only places.
        """
        samples, yaws, terms = self._geometry(members, anchor, use_axis)
        log_weights = terms.sum(axis=1) + self._log_prior(samples, yaws)
        kept = _best(log_weights, _PRUNE, _MOST_HYPOTHESES)
        samples, yaws = samples[kept], yaws[kept]
        rotations = self.prior.object_from_base(self.yaws)
        inward = (rotations @ self.axes[anchor])[yaws]
        gels_at_anchor = self.surface.points[samples] + self.contacts[anchor].indentation * inward
        gels = gels_at_anchor - (rotations @ self.positions[anchor])[yaws]
        return Hypotheses(gels, self.yaws[yaws], log_weights[kept] - log_weights[kept].max())

    def weigh(
        self, gels: FloatArray, yaws: FloatArray, members: IntArray, step: int, rings: int, blur: float = 0.0
    ) -> FloatArray:
        """``(n, m)`` nats: the place and image of each of ``(m,)`` contacts under each hypothesis.

        Args:
            gels: ``(n, 3)`` metres, see ``Hypotheses``.
            yaws: ``(n,)`` rad.
            members: indices of contacts whose image shows a contact.
            step: view pixels between the cells over which the arm's error is integrated.
            rings: cells on each side.
            blur: metres, one sigma by which the hypotheses themselves are off their best place.
        """
        terms = np.zeros((len(gels), len(members)))
        noise, temperatures = self.noise.touch, self._temperatures(members)
        for column, (k, sigma) in enumerate(
            zip(members, np.hypot(self._place_sigmas(members), blur), strict=True)
        ):
            for chosen, view, places in self.placed(int(k), gels, yaws):
                terms[chosen, column] = touch_terms(
                    view, self.touch(int(k)), noise, places, step, rings, sigma, temperatures[column]
                )
        return terms

    def gates(self, gel: FloatArray, yaw: float, members: IntArray) -> FloatArray:
        """``(m,)`` nats: how well each contact fits at one hypothesis, untempered and uncapped."""
        values = np.empty(len(members))
        for column, (k, sigma) in enumerate(zip(members, self._place_sigmas(members), strict=True)):
            ((_, view, places),) = self.placed(int(k), gel[None], np.array([yaw]))
            values[column] = best_fit(view, self.touch(int(k)), self.noise.touch, places[0], sigma)
        return values

    def placed(
        self, contact: int, gels: FloatArray, yaws: FloatArray
    ) -> Iterator[tuple[IntArray, View, FloatArray]]:
        """Hypotheses by the picture that serves them, with the gel's centre in view coordinates."""
        places_in_object = self.gel_centres(contact, gels, yaws)
        pictures = self.pictures(yaws)
        for picture in np.unique(pictures):
            chosen = np.nonzero(pictures == picture)[0].astype(np.int64)
            view = self.view(contact, int(picture))
            yield chosen, view, places_in_object[chosen] @ view.object_from_view

    def gel_centres(self, contact: int, gels: FloatArray, yaws: FloatArray) -> FloatArray:
        """``(n, 3)`` metres, in the object's frame, at one contact."""
        moved = self.prior.object_from_base(yaws) @ self.positions[contact]
        return np.asarray(gels + moved)

    def surface_points(self, contact: int, gels: FloatArray, yaws: FloatArray) -> FloatArray:
        """``(n, 3)`` metres: where the tool's line first meets the object, to a view's pixel.

        Where it misses the object, the sample nearest to the gel's centre.
        """
        points = self.gel_centres(contact, gels, yaws)
        for chosen, view, places in self.placed(contact, gels, yaws):
            row, column = np.round((places[:, :2] - view.origin) / view.pitch).astype(np.int64).T[::-1]
            rows, columns = view.depth.shape
            inside = (row >= 0) & (row < rows) & (column >= 0) & (column < columns)
            depth = np.full(len(places), np.inf)
            depth[inside] = view.depth[row[inside], column[inside]]
            hit = np.isfinite(depth)
            met = np.column_stack([places[hit, :2], depth[hit]]) @ view.object_from_view.T
            points[chosen[hit]] = met
            lost = chosen[~hit]
            points[lost] = self.surface.points[self.surface.tree.query(points[lost])[1]]
        return points

    def contact_places(self, contact: int, hypotheses: Hypotheses) -> FloatArray:
        """``(n, 3)`` metres: where a contact lies if the gel's centre was pressed in as it seems."""
        rotations = self.prior.object_from_base(hypotheses.yaws)
        inward = rotations @ self.axes[contact]
        gels = hypotheses.gels + rotations @ self.positions[contact]
        return np.asarray(gels - self.contacts[contact].indentation * inward)

    def touch(self, contact: int) -> TouchMap:
        """What the gel read at a contact whose image counts."""
        touch = self.contacts[contact].touch
        assert touch is not None
        return touch

    def members(self, count: int) -> IntArray:
        """Those of the first ``count`` contacts whose image shows a contact."""
        shown = [k for k, c in enumerate(self.contacts[:count]) if c.shows_contact]
        return np.array(shown, dtype=np.int64)

    def log_yaw_prior(self, yaws: FloatArray) -> FloatArray:
        """``(n,)`` nats, up to a constant."""
        if self.prior.yaw == "unknown":
            return np.zeros(len(yaws))
        return np.asarray(-0.5 * (yaws / self.prior.yaw_sigma) ** 2)

    def _geometry(
        self, members: IntArray, anchor: int, use_axis: bool
    ) -> tuple[IntArray, IntArray, FloatArray]:
        rotations = self.prior.object_from_base(self.yaws)
        indentations = np.array([self.contacts[k].indentation for k in members])
        points = self.positions[members] - indentations[:, None] * self.axes[members]
        index = int(np.nonzero(members == anchor)[0][0])
        arrangement = arrange(rotations, points, self.axes[members], index)
        geometry = self.noise.geometry
        samples, yaws = possible_anchors(self.surface, arrangement, geometry, use_axis)
        terms = geometry_terms(self.surface, arrangement, samples, yaws, geometry, use_axis)
        return samples, yaws, terms

    def _log_prior(self, samples: IntArray, yaws: IntArray) -> FloatArray:
        return np.asarray(np.log(self.surface.areas[samples]) + self.log_yaw_prior(self.yaws)[yaws])

    def _place_sigmas(self, members: IntArray) -> FloatArray:
        centre = self.positions[members].mean(axis=0)
        reach = np.linalg.norm(self.positions[members] - centre, axis=1)
        return np.asarray(np.hypot(self.noise.touch.shift, self.noise.geometry.gap_per_metre * reach))

    def _temperatures(self, members: IntArray) -> FloatArray:
        """A press repeated at one place shares its errors: its images together count as one."""
        gaps = np.linalg.norm(self.positions[members][:, None] - self.positions[members][None], axis=2)
        alike = (gaps < SAME_PLACE) & (self.axes[members] @ self.axes[members].T > np.cos(SAME_AXIS))
        return np.asarray(self.noise.temperature / alike.sum(axis=1))

    def pictures(self, yaws: FloatArray) -> IntArray:
        """``(n,)`` number of the picture whose yaw is nearest."""
        if self.prior.yaw == "known":
            return np.zeros(len(yaws), dtype=np.int64)
        return np.asarray(np.round(np.degrees(yaws) / 2.0).astype(np.int64) % len(_ALL_YAWS))


def refine(
    search: Search, start: Hypotheses, members: IntArray, samples: int, rounds: int, seed: int
) -> Hypotheses:
    """The posterior in continuous place and yaw, by repeated importance sampling.

    Each round draws from the last round's hypotheses widened by a Gaussian and weighs by the
    posterior over the whole mixture it drew from (Cappé et al., Population Monte Carlo, JCGS
    13(4), 2004), so that no draw is favoured for having many neighbours.

    Args:
        search: the run.
        start: the grid's hypotheses, weighed with their images.
        members: ``(m,)`` indices of the contacts that count.
        samples: draws a round.
        rounds: how often; 0 returns ``start``.
        seed: of the draws.
    """
    rng = np.random.default_rng(seed)
    current = start
    for attempt in range(rounds):
        width = np.array([0.8e-3, 0.8e-3, 0.6e-3]) * 0.65**attempt
        turn = np.radians(0.8 if search.prior.yaw == "known" else 1.5) * 0.65**attempt
        parents = _systematic(current.weights, samples, rng)
        gels = current.gels[parents] + rng.normal(size=(samples, 3)) * width
        yaws = current.yaws[parents] + rng.normal(size=samples) * turn
        unique, repeats = np.unique(parents, return_counts=True)
        log_density = _mixture(
            np.column_stack([gels / width, yaws / turn]),
            np.column_stack([current.gels[unique] / width, current.yaws[unique] / turn]),
            repeats / samples,
        )
        finest = attempt == rounds - 1
        terms = search.weigh(gels, yaws, members, step=1 if finest else 2, rings=2)
        log_weights = terms.sum(axis=1) + search.log_yaw_prior(yaws) - log_density
        current = Hypotheses(gels, yaws, log_weights - log_weights.max())
    return current


def _best(log_weights: FloatArray, within: float, most: int) -> IntArray:
    """Indices within so many nats of the best; where they are too many, evenly thinned.

    Hypotheses come in the samples' random order, so every n-th of them covers the surface.
    """
    kept = np.nonzero(log_weights > log_weights.max() - within)[0]
    stride = -(-len(kept) // most)
    return kept[::stride].astype(np.int64)


def _systematic(weights: FloatArray, count: int, rng: np.random.Generator) -> IntArray:
    marks = (np.arange(count) + rng.random()) / count
    return np.minimum(np.searchsorted(np.cumsum(weights), marks), len(weights) - 1).astype(np.int64)


@compiled
def _mixture(points: FloatArray, centres: FloatArray, shares: FloatArray) -> FloatArray:
    result = np.empty(len(points))
    for i in range(len(points)):
        total = 0.0
        for j in range(len(centres)):
            gap = 0.0
            for d in range(points.shape[1]):
                gap += (points[i, d] - centres[j, d]) ** 2
            if gap < 60.0:
                total += shares[j] * np.exp(-0.5 * gap)
        result[i] = np.log(total)
    return result
