"""Where a flat sensor can be pressed on an object, and which of these places a run visits."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from itertools import islice
from typing import Literal, Protocol

import numpy as np

from harness.basics.arrays import FloatArray, read_only
from harness.basics.errors import WrongUse
from harness.basics.geometry import apply, frame_facing, rotation_about, transform
from harness.bench.sensor import TactileSensor
from harness.sim.gel.height_map import RasterMesh
from harness.sim.gel.view import window_depth
from harness.sim.solid.surface_samples import random_points

Steps = Literal["close", "spread"]
Reachable = Callable[[FloatArray], bool]

SHORTEST_STEP = 3.0e-3
MOST_PENETRATION = 2.5e-3
TOUCH_VOLUME = 8.0e-9
"""Cubic metres of gel displaced when the arm notices a touch: 0.4 N on a bed of 50 N/cm^3."""

_LEAST_PRESS = 0.1e-3
_PITCH = 0.5e-3
_LOWEST_TOOL = 0.25
_DRAWN_AT_ONCE = 256
_PATIENCE = 6000
"""Places drawn in vain before a chain is at a dead end."""
_DEAD_ENDS = 20


@dataclass(frozen=True)
class PressLimits:
    """What is asked of every contact of a run."""

    longest_step: float = 25.0e-3  #: m from a contact to the next, where steps are close.
    tilt: float = float(np.radians(15.0))  #: rad, the most between the tool and the surface's normal.
    depth: tuple[float, float] = (0.5e-3, 2.0e-3)  #: m of indentation at the gel's centre, from and to.


@dataclass(frozen=True, eq=False)
class Site:
    """One planned contact."""

    base_from_gel: FloatArray
    """``(4, 4)``: the gel when it is fully pressed, were the object where the plan believes it to be."""
    press: float  #: metres to travel on to there from where the arm notices the touch.
    penetration: float  #: metres that the object then reaches into the gel at most.
    point_in_object: FloatArray  #: ``(3,)`` metres: the planned contact.
    tilt: float  #: rad between the tool and the surface's normal.


class Visit(Protocol):
    """Asks for a way to a site, and keeps it: the motions of a chain are made as it grows."""

    def __call__(self, before: int, base_from_gel: FloatArray, patient: bool) -> bool:
        """Whether there is a way there from site ``before``, which the chain now ends with.

        Args:
            before: sites that stay in front of this one; a chain that was cut back asks again.
            base_from_gel: ``(4, 4)``, fully pressed.
            patient: whether to search long; asked for after a first dead end.
        """


def from_above_or_aside(base_from_gel: FloatArray) -> bool:
    """Whether the tool points down, level, or at most 14 degrees up: what an arm beside an object can do."""
    return bool(base_from_gel[2, 2] < _LOWEST_TOOL)


def plan_sites(
    raster: RasterMesh,
    sensor: TactileSensor,
    base_from_object: FloatArray,
    count: int,
    steps: Steps,
    seed: int,
    reachable: Reachable = from_above_or_aside,
    presses: PressLimits = PressLimits(),
    visit: Visit | None = None,
) -> tuple[Site, ...]:
    """Contacts to make, drawn at random among those that the sensor's housing allows.

    Where a chain of them cannot be gone on with, its last sites are given up, more at every dead
    end, until it is begun anew.

    Args:
        raster: the object, in metres.
        sensor: whose flat housing must fit.
        base_from_object: ``(4, 4)`` nominal pose.
        count: contacts.
        steps: ``"close"``: each within a step of the one before; ``"spread"``: anywhere.
        seed: of the draws; the same seed gives the same sites.
        reachable: whether the arm can take the gel there without a collision.
        presses: how far apart, how tilted, how deep.
        visit: whether there is a way to it from the site before; asked last. None: a gel that flies.

    Raises:
        WrongUse: no such contacts were found; the message says what the places drawn lacked.
    """
    search = _Search(raster, sensor, base_from_object, steps, reachable, presses, visit)
    rng = np.random.default_rng(seed)
    given_up, longest = 1, 0
    for dead_ends in range(_DEAD_ENDS):
        search.grow(count, rng, patient=dead_ends > 0)
        if len(search.sites) == count:
            return tuple(search.sites)
        longest = max(longest, len(search.sites))
        if dead_ends > 0 and not search.sites:
            break
        del search.sites[-given_up:]
        given_up = 2 * given_up if search.sites else 1
    raise WrongUse(_none_found(search, count, longest))


def candidate_sites(
    raster: RasterMesh,
    sensor: TactileSensor,
    base_from_object: FloatArray,
    count: int,
    steps: Steps,
    seed: int | tuple[int, ...],
    before: Sequence[FloatArray],
    reachable: Reachable = from_above_or_aside,
    presses: PressLimits = PressLimits(),
) -> tuple[Site, ...]:
    """Contacts of which one is to be the next, drawn as those of ``plan_sites`` are.

    Args: as ``plan_sites`` has them, but for
        count: at most so many; fewer where few fit.
        before: ``(3,)`` m each, in the object: contacts so far, the last of which the next must be close to.

    Raises:
        WrongUse: none was found; the message says what the places drawn lacked.
    """
    search = _Search(raster, sensor, base_from_object, steps, reachable, presses, None, tuple(before))
    found = tuple(islice(search.fitting(np.random.default_rng(seed), patient=False), count))
    if not found:
        raise WrongUse(_none_found(search, 1, 0))
    return found


@dataclass
class _Tally:
    """How many of the places drawn passed each question so far."""

    drawn: int = 0
    near: int = 0
    fitting: int = 0
    reached: int = 0
    visited: int = 0


@dataclass
class _Search:
    """A chain of sites, and what it is made from."""

    raster: RasterMesh
    sensor: TactileSensor
    base_from_object: FloatArray
    steps: Steps
    reachable: Reachable
    presses: PressLimits
    visit: Visit | None
    before: Sequence[FloatArray] = ()
    sites: list[Site] = field(default_factory=list)
    tally: _Tally = field(default_factory=_Tally)

    def grow(self, count: int, rng: np.random.Generator, patient: bool) -> None:
        """Add sites until there are ``count``, or none of many places drawn can be the next."""
        for site in islice(self.fitting(rng, patient), count - len(self.sites)):
            self.sites.append(site)

    def fitting(self, rng: np.random.Generator, patient: bool) -> Iterator[Site]:
        """Places that can be the next, drawn one after another, until many are drawn in vain."""
        fruitless = 0
        while fruitless < _PATIENCE:
            points, faces = random_points(self.raster.mesh, _DRAWN_AT_ONCE, rng)
            fruitless += len(points)
            for point, normal in zip(points, self.raster.mesh.face_normals[faces], strict=True):
                site = self._next(point, normal, rng, patient)
                if site is not None:
                    fruitless = 0
                    yield site

    def _next(
        self, point: FloatArray, normal: FloatArray, rng: np.random.Generator, patient: bool
    ) -> Site | None:
        """The place as the chain's next site; None where it cannot be. The cheap questions come first."""
        self.tally.drawn += 1
        so_far = [*self.before, *(site.point_in_object for site in self.sites)]
        gaps = np.linalg.norm(np.array(so_far).reshape(-1, 3) - point, axis=1)
        near = self.steps == "spread" or gaps[-1:].max(initial=0.0) <= self.presses.longest_step
        if not bool(near and gaps.min(initial=np.inf) >= SHORTEST_STEP):
            return None
        self.tally.near += 1
        site = try_site(self.raster, self.sensor, self.base_from_object, point, normal, rng, self.presses)
        if site is None:
            return None
        self.tally.fitting += 1
        if not self.reachable(site.base_from_gel):
            return None
        self.tally.reached += 1
        if self.visit is not None and not self.visit(len(self.sites), site.base_from_gel, patient):
            return None
        self.tally.visited += 1
        return site


def _none_found(search: _Search, count: int, longest: int) -> str:
    tally, step = search.tally, 1e3 * search.presses.longest_step
    housing = " x ".join(f"{1e3 * side:g}" for side in search.sensor.housing)
    near = f"within {step:g} mm of the contact before" if search.steps == "close" else "apart from the others"
    return (
        f"only {longest} of {count} contacts with {search.steps} steps were found: of {tally.drawn} places "
        f"drawn on the object {tally.near} were {near}, at {tally.fitting} of these the flat housing of "
        f"{housing} mm fitted, to {tally.reached} of these the arm could take the gel without a collision, "
        f"and to {tally.visited} it had a free way; ask for fewer contacts, "
        + (f"longer steps than {step:g} mm, spread ones, " if search.steps == "close" else "")
        + "or another pose of the object"
    )


def try_site(
    raster: RasterMesh,
    sensor: TactileSensor,
    base_from_object: FloatArray,
    point_in_object: FloatArray,
    normal_in_object: FloatArray,
    rng: np.random.Generator,
    presses: PressLimits = PressLimits(),
) -> Site | None:
    """A press at a point with a random tilt, sensor yaw and depth; None where it does not fit.

    It fits where the tool, coming straight in, meets the point first at its centre line and
    where no part of the object reaches 2.5 mm behind the gel's plane anywhere under the
    housing.
    """
    tilt = float(np.arccos(rng.uniform(np.cos(presses.tilt), 1.0)))
    aside = frame_facing(-normal_in_object, rng.uniform(0.0, 2.0 * np.pi))
    axis = rotation_about(aside[:, 0], tilt) @ -normal_in_object
    object_from_gel = frame_facing(axis / np.linalg.norm(axis), rng.uniform(0.0, 2.0 * np.pi))
    indentation = rng.uniform(*presses.depth)
    heights = -window_depth(raster, object_from_gel, point_in_object, sensor.housing, _PITCH)
    rows, columns = heights.shape
    centre = heights[rows // 2, columns // 2]
    if not abs(centre) < 0.3e-3 or heights.max() + indentation > MOST_PENETRATION:
        return None
    window_columns, window_rows = (round(0.5 * side / _PITCH) for side in sensor.window)
    under_gel = heights[
        rows // 2 - window_rows : rows // 2 + window_rows + 1,
        columns // 2 - window_columns : columns // 2 + window_columns + 1,
    ]
    gel_in_object = point_in_object + indentation * object_from_gel[:, 2]
    base_from_gel = transform(
        base_from_object[:3, :3] @ object_from_gel, apply(base_from_object, gel_in_object[None])[0]
    )
    levels = -np.sort(-under_gel[np.isfinite(under_gel)].ravel())
    wanted = TOUCH_VOLUME / _PITCH**2
    # Pressed to the k-th highest place, the gel is displaced by all higher ones down to it.
    displaced = np.cumsum(levels) - levels * np.arange(1, len(levels) + 1)
    k = int(np.searchsorted(displaced, wanted))
    higher = float(levels[:k].sum())
    return Site(
        read_only(base_from_gel),
        max(_LEAST_PRESS, indentation - ((wanted - higher) / k)),
        float(under_gel.max() + indentation),
        read_only(np.array(point_in_object)),
        tilt,
    )
