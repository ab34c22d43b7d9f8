"""One run's contacts over one object: every hypothesis is weighed here.

A hypothesis fixes where the gel's centre was at the first contact, in the object's frame, and
the object's yaw; the arm's translations carry it to every other contact. Its position enters
only through differences, so where the bench stands cannot matter.
"""

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from experiments.contact_localization.model import Model, Prior
from experiments.contact_localization.posterior.hypotheses import Hypotheses, best_of
from experiments.contact_localization.posterior.likelihood import (
    Noise,
    arrange,
    contact_scales,
    geometry_scores,
    log_prior,
    moves,
    place_noise,
    possible_anchors,
)
from experiments.contact_localization.touch.touch import Contact, TouchMap, best_fit, touch_terms
from harness.basics.arrays import FloatArray, IntArray
from harness.bench.gap import USUAL
from harness.sim.gel.view import ToolView, view_along, view_of
from harness.sim.solid.surface_samples import Surface

_YAWS_TO = 5
"""Degrees from the nominal yaw to the last of the grid's, where it is known as well as usual; in proportion
to its sigma."""


_YAW_STEP = 2.0
"""Degrees between the yaws of the grid, and between pictures, where the yaw is unknown."""


_PICTURES = round(360.0 / _YAW_STEP)


_SHARED_COARSELY = 3


_MANY_PICTURES = 45


_PRUNE = 30.0


_CAP_ALONE = 1000.0
"""Nats: beyond what any place that fits costs, and a number where none does."""


MOST_HYPOTHESES = 20_000
"""That a grid keeps; of more, an even choice."""


class Search:
    """One run's contacts over one object: what every stage of the grid shares."""

    def __init__(
        self, contacts: Sequence[Contact], model: Model, prior: Prior, spacing: float, noise: Noise
    ) -> None:
        self.contacts = tuple(contacts)
        self.model = model
        self.prior = prior
        self.noise = noise
        read = any(contact.touch is not None for contact in contacts)
        self.geometry = noise.geometry if read else noise.unread
        self.surface: Surface = model.surface(spacing)
        self.turning = model.turning(prior.up) if prior.yaw == "unknown" else None
        if self.turning is None:
            # About the nominal yaw, a degree apart: at least those of the usual sigma.
            to = _YAWS_TO * max(1, int(np.ceil(prior.yaw_sigma / USUAL.yaw)))
            self.yaws = np.radians(np.arange(-to, to + 0.5, 1.0))
        else:
            # Over one period of the object; one where every yaw is alike.
            period = np.degrees(self.turning.period)
            self.yaws = np.radians(np.arange(0.0, max(period, 1e-9), _YAW_STEP))
        self._rough = False
        self.positions = np.array([contact.base_from_gel[:3, 3] for contact in contacts])
        self.positions -= self.positions[0]
        self.axes = np.array([contact.axis for contact in contacts])
        self._pitch = next((c.touch.pitch for c in contacts if c.touch is not None), 1.0e-3)
        attitudes = np.array([contact.base_from_gel[:3, :3] for contact in contacts])
        shown = np.array([contact.shows_contact for contact in contacts])
        self._shared_moves = moves(noise.shared, self.positions, attitudes, shown if shown.any() else ~shown)
        self._turned = self.axes, self.axes  # no yaws have been asked for
        self._views: dict[tuple[int, int, bool], ToolView] = {}

    def view(self, contact: int, picture: int, coarse: bool = False) -> ToolView:
        """The object along the tool at a contact, under the yaw of a numbered picture."""
        key = (contact, picture, coarse)
        if key not in self._views:
            self._views[key] = self._seen(contact, picture, coarse)
        return self._views[key]

    def _seen(self, contact: int, picture: int, coarse: bool) -> ToolView:
        sensor = self.model.sensor
        if coarse and self.prior.yaw == "known":
            # The fine picture will be asked for as well.
            fine = self.view(contact, picture)
            return view_of(fine.depth[::2, ::2], fine.object_from_view, fine.origin, 2.0 * fine.pitch, sensor)
        nominal = np.radians(_YAW_STEP * picture)
        object_from_base = self.prior.object_from_base(np.array([nominal]))[0]
        object_from_gel = object_from_base @ self.contacts[contact].base_from_gel[:3, :3]
        pitch = self._pitch if coarse else 0.5 * self._pitch
        return view_along(self.model.first_surface, self.surface.points, object_from_gel, pitch, sensor)

    def grid(self, members: IntArray, anchor: int, use_axis: bool = True) -> Hypotheses:
        """Hypotheses on the surface's samples, weighed by the places and tool axes of some contacts.

        Args:
            members: ``(m,)`` indices of the contacts that count.
            anchor: the one of them that a hypothesis puts on a sample.
            use_axis: whether the tool's attitude counts, or only places.
        """
        gels, yaws, log_weights = self.places(members, anchor, use_axis)
        return Hypotheses(gels, yaws, log_weights - log_weights.max())

    def places(
        self, members: IntArray, anchor: int, use_axis: bool = True, most: int = MOST_HYPOTHESES
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """As ``grid``, at most so many: gels, yaws and nats, which are of one scale whatever the anchor."""
        samples, yaws, log_weights = self._geometry(members, anchor, use_axis)
        kept = best_of(log_weights, _PRUNE, most)
        samples, yaws = samples[kept], yaws[kept]
        rotations = self.prior.object_from_base(self.yaws)
        inward = (rotations @ self.axes[anchor])[yaws]
        gels_at_anchor = self.surface.points[samples] + self.contacts[anchor].indentation * inward
        gels = gels_at_anchor - (rotations @ self.positions[anchor])[yaws]
        return gels, self.yaws[yaws], log_weights[kept]

    def look(self, at: Hypotheses, members: IntArray, within: float) -> Hypotheses:
        """Samples' hypotheses with what coarse images say added to their weights.

        Args:
            at: on the surface's samples, weighed by what is not an image.
            members: ``(m,)`` indices of contacts whose image shows a contact.
            within: nats behind the best at which a hypothesis is dropped as contacts come in.
        """
        step = max(1, round(self.surface.spacing / self._pitch))
        at = at.told(self.log_yaw_prior(at.yaws))
        for k, sigma, temperature in self._scales(members):
            wide = self._with_spacing(sigma)
            term = self._term(k, at, step, 1, wide, temperature, True, self.noise.touch.cap)
            at = at.told(term).best(within, len(term))
        return at

    def _with_spacing(self, sigma: float) -> float:
        """Metres: between samples the best place is up to half their spacing away."""
        return float(np.hypot(sigma, 0.4 * self.surface.spacing))

    def weigh(
        self, at: Hypotheses, members: IntArray, step: int, rings: int, within: float = np.inf
    ) -> Hypotheses:
        """Hypotheses with what yaw, shared errors and images say added to their weights.

        Args:
            at: weighed by all else. Shared errors that they do not name count to each contact's own.
            members: ``(m,)`` indices of contacts whose image shows a contact.
            step: fine view pixels between the cells over which the arm's error is integrated.
            rings: cells on each side.
            within: nats behind the best at which a hypothesis is dropped as contacts come in.
        """
        at = at.told(self.log_yaw_prior(at.yaws) + log_prior(at.shared))
        cells = max(1, step // 2) if self._rough else step
        # An outlier fits every place alike. One contact alone is no outlier: no others say where it was.
        cap = self.noise.touch.cap if len(members) > 1 else _CAP_ALONE
        for k, sigma, temperature in self._scales(members, at.shared is not None):
            term = self._term(k, at, cells, rings, sigma, temperature, self._rough, cap)
            at = at.told(term).best(within, len(term))
        return at

    def _term(
        self,
        contact: int,
        at: Hypotheses,
        step: int,
        rings: int,
        sigma: float,
        temperature: float,
        coarse: bool,
        cap: float,
    ) -> FloatArray:
        term = np.empty(len(at.yaws))
        touch, noise = self.touch(contact, coarse), place_noise(self.noise, at.shared is not None)
        noise = replace(noise.with_model(self.model.seen_rms, touch), cap=cap)
        for chosen, view, places in self.placed(contact, at, coarse):
            turns = self._turns(contact, at.yaws[chosen], coarse)
            term[chosen] = touch_terms(view, touch, noise, places, step, rings, sigma, temperature, turns)
        return term

    def _scales(self, members: IntArray, named: bool = False) -> Iterator[tuple[int, float, float]]:
        per_metre = self.geometry.gap_per_metre
        return contact_scales(self.positions, self.axes, members, self.noise, per_metre, named)

    def gates(self, one: Hypotheses, members: IntArray) -> FloatArray:
        """``(m,)`` nats: how well each contact fits at one hypothesis, untempered and uncapped.

        Its places may be off by all that a bench may be off by, named or not; a sample's by its spacing too.
        """
        values = np.empty(len(members))
        for column, (k, sigma, _) in enumerate(self._scales(members)):
            ((_, view, places),) = self.placed(k, one)
            noise = self.noise.touch.with_model(self.model.seen_rms, self.touch(k))
            wide = sigma if one.shared is not None else self._with_spacing(sigma)
            (turn,) = self._turns(k, one.yaws)
            values[column] = best_fit(view, self.touch(k), noise, places[0], wide, turn)
        return values

    def placed(
        self, contact: int, at: Hypotheses, coarse: bool = False
    ) -> Iterator[tuple[IntArray, ToolView, FloatArray]]:
        """Hypotheses by the picture that serves them, with the gel's centre in view coordinates."""
        places_in_object = self.gel_centres(contact, at)
        pictures = self.pictures(at.yaws, coarse)
        for picture in (0,) if self.prior.yaw == "known" else np.unique(pictures):
            chosen = np.nonzero(pictures == picture)[0].astype(np.int64)
            view = self.view(contact, int(picture), coarse)
            yield chosen, view, places_in_object[chosen] @ view.object_from_view

    def _turns(self, contact: int, yaws: FloatArray, coarse: bool = False) -> FloatArray:
        """``(n, 3)`` by which the gel is turned against the picture that serves each yaw."""
        past = yaws - np.radians(_YAW_STEP) * self.pictures(yaws, coarse)
        past = (past + np.pi) % (2.0 * np.pi) - np.pi
        return turns_between(self.contacts[contact].base_from_gel[:3, :3], past)

    def gel_centres(self, contact: int, at: Hypotheses) -> FloatArray:
        """``(n, 3)`` metres, in the object's frame, at one contact."""
        moved = self.positions[contact]
        if at.shared is not None:
            moved = (moved + at.shared @ self._shared_moves[contact])[:, :, None]
            return np.asarray(at.gels + np.matmul(self._rotations(at.yaws), moved)[:, :, 0])
        return np.asarray(at.gels + self._rotations(at.yaws) @ moved)

    def _rotations(self, yaws: FloatArray) -> FloatArray:
        """``(n, 3, 3)``, object from base; all contacts of one set of hypotheses ask for the same in turn."""
        if yaws is not self._turned[0]:
            self._turned = yaws, self.prior.object_from_base(yaws)
        return self._turned[1]

    def surface_points(self, contact: int, at: Hypotheses) -> FloatArray:
        """``(n, 3)`` metres: where the tool's line first meets the object, to a view's pixel.

        Where it meets nothing within the gel's thickness, the sample nearest to the gel's centre:
        what lies behind an edge that was just missed was not touched.
        """
        points = self.gel_centres(contact, at)
        for chosen, view, places in self.placed(contact, at, self._rough):
            row, column = np.round((places[:, :2] - view.origin) / view.pitch).astype(np.int64).T[::-1]
            rows, columns = view.depth.shape
            inside = (row >= 0) & (row < rows) & (column >= 0) & (column < columns)
            depth = np.full(len(places), np.inf)
            depth[inside] = view.depth[row[inside], column[inside]]
            hit = depth <= places[:, 2] + self.model.sensor.gel_thickness
            met = np.column_stack([places[hit, :2], depth[hit]]) @ view.object_from_view.T
            points[chosen[hit]] = met
            lost = chosen[~hit]
            points[lost] = self.surface.points[self.surface.tree.query(points[lost])[1]]
        return points

    def contact_places(self, contact: int, at: Hypotheses) -> FloatArray:
        """``(n, 3)`` metres: where a contact lies if the gel's centre was pressed in as it seems."""
        inward = self._rotations(at.yaws) @ self.axes[contact]
        return np.asarray(self.gel_centres(contact, at) - self.contacts[contact].indentation * inward)

    def touch(self, contact: int, coarse: bool = False) -> TouchMap:
        """What the gel read at a contact whose image counts."""
        touch = self.contacts[contact].coarse if coarse else self.contacts[contact].touch
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
        geometry = self.geometry
        samples, yaws = possible_anchors(self.surface, arrangement, geometry, use_axis)
        prior = np.log(self.surface.areas[samples]) + self.log_yaw_prior(self.yaws)[yaws]
        log_weights = geometry_scores(
            self.surface, arrangement, samples, yaws, prior, geometry, use_axis, _PRUNE
        )
        return samples, yaws, log_weights

    @property
    def yaw_step(self) -> float:
        """Between the grid's yaws, in rad."""
        return float(self.yaws[1] - self.yaws[0]) if self.turning is None else np.radians(_YAW_STEP)

    @property
    def yaw_observable(self) -> bool:
        """Whether any reading can depend on the yaw."""
        return self.turning is None or self.turning.fold != 0

    def settle(self, yaws: FloatArray) -> None:
        """Look at the yaws that are left: where they are many, coarse pictures do from now on.

        So many yaws are left only where readings hardly tell places apart: what half a millimetre more
        would say does not matter then, and a fine picture for every yaw costs most of the seconds.
        """
        self._rough = len(np.unique(self.pictures(yaws))) > _MANY_PICTURES

    def pictures(self, yaws: FloatArray, coarse: bool = False) -> IntArray:
        """``(n,)`` number of the picture whose yaw is nearest; 0, the nominal one, where it is known."""
        if self.prior.yaw == "known":
            return np.zeros(len(yaws), dtype=np.int64)
        shared = _SHARED_COARSELY if coarse else 1
        numbers = shared * np.round(np.degrees(yaws) / (_YAW_STEP * shared))
        return np.asarray(numbers.astype(np.int64) % _PICTURES)


def turns_between(base_from_gel: FloatArray, turns: FloatArray) -> FloatArray:
    """How the gel stands against one that looks upon an object turned by so much less about base z.

    Args:
        base_from_gel: ``(3, 3)`` rotation.
        turns: ``(n,)`` rad, small.

    Returns:
        ``(n, 3)`` to first order: the gel's slopes along x and y of its picture, and its turn in that plane.
    """
    # The object turned one way is the gel turned the other, about z as the gel has it.
    x, y, z = -base_from_gel[2]
    return np.outer(turns, np.array([y, -x, z]))
