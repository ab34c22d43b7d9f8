"""A chain of sites is backed out of dead ends, and where there is none the message says what was lacking."""

import re
from dataclasses import dataclass, field

import numpy as np
import pytest

from harness.basics.arrays import FloatArray
from harness.basics.errors import WrongUse
from harness.basics.geometry import apply, inverse
from harness.bench.scene import scene_from_options
from harness.bench.sensor import GELSIGHT_R15
from harness.objects.household import build
from harness.sim.gel.height_map import RasterMesh
from harness.skills import sites as sites_module
from harness.skills.sites import (
    SHORTEST_STEP,
    PressLimits,
    Site,
    Steps,
    Visit,
    candidate_sites,
    plan_sites,
)

MESH = build("tray", 2e-3)
RASTER = RasterMesh(MESH)
POSE = scene_from_options("builtin:tray").base_from_object(MESH)


FEW = 512
"""Places drawn in vain before a dead end, where a test makes dead ends; enough on a tray."""


@pytest.fixture
def hasty(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sites_module, "_PATIENCE", FEW)


def sites(count: int, steps: Steps, visit: Visit | None, seed: int = 1) -> tuple[Site, ...]:
    return plan_sites(RASTER, GELSIGHT_R15, POSE, count, steps, seed, visit=visit)


@dataclass
class Asked:
    """A visit that goes anywhere, up to a given number of contacts the first times it is asked."""

    stuck: int  #: contacts beyond which there is no way until the chain was cut back to ``back`` contacts.
    back: int  #: see ``stuck``.
    befores: list[tuple[int, bool, bool]] = field(default_factory=list)
    """what it was asked, whether it said yes, whether it was to be patient."""

    def __call__(self, before: int, base_from_gel: FloatArray, patient: bool) -> bool:
        freed = any(b <= self.back for b, _, asked_patiently in self.befores if asked_patiently)
        good = before < self.stuck or freed
        self.befores.append((before, good, patient))
        return good


def same(one: tuple[Site, ...], other: tuple[Site, ...]) -> bool:
    return all(np.array_equal(a.base_from_gel, b.base_from_gel) for a, b in zip(one, other, strict=True))


@pytest.mark.usefixtures("hasty")
@pytest.mark.parametrize("back", [2, 1, 0])
def test_a_dead_end_is_backed_out_of_as_far_as_it_needs(back: int) -> None:
    """However early the mistake was made: the last site, the one before, the first."""
    visit = Asked(stuck=3, back=back)
    found = sites(5, "close", visit)
    assert len(found) == 5
    # What the chain kept is what was said yes to last, at each length.
    kept: dict[int, int] = {b: k for k, (b, good, _) in enumerate(visit.befores) if good}
    assert sorted(kept) == [0, 1, 2, 3, 4]
    assert sorted(kept.values()) == [kept[b] for b in range(5)], "the later sites follow the earlier ones"
    assert min(b for b, _, patient in visit.befores if patient) <= back
    assert sites_keep_their_distance(found, "close")


def sites_keep_their_distance(found: tuple[Site, ...], steps: Steps) -> bool:
    points = np.array([site.point_in_object for site in found])
    apart = np.linalg.norm(points[:, None] - points[None], axis=-1)[np.triu_indices(len(points), 1)]
    follow = np.linalg.norm(np.diff(points, axis=0), axis=1)
    near = steps == "spread" or bool(follow.max() <= PressLimits().longest_step)
    return near and bool(apart.min() >= SHORTEST_STEP)


@pytest.mark.parametrize("steps", ["close", "spread"])
@pytest.mark.parametrize("seed", [1, 2])
def test_steps_keep_their_distance_and_a_seed_gives_one_chain(steps: Steps, seed: int) -> None:
    found = sites(6, steps, None, seed)
    assert sites_keep_their_distance(found, steps)
    assert same(found, sites(6, steps, None, seed))
    assert not same(found, sites(6, steps, None, seed + 10))


def test_a_way_that_is_always_there_changes_no_site() -> None:
    assert same(sites(6, "close", Asked(9, 0)), sites(6, "close", None))


def test_a_site_is_where_it_says() -> None:
    """The planned point lies on the gel's axis, behind the gel's plane by the indentation."""
    for site in sites(4, "spread", None):
        point = apply(inverse(site.base_from_gel) @ POSE, site.point_in_object[None])[0]
        assert point[:2] == pytest.approx(0.0, abs=1e-9)
        assert -PressLimits().depth[1] <= point[2] <= -PressLimits().depth[0]


def numbers(message: str) -> dict[str, int]:
    pattern = (
        r"only (?P<longest>\d+) of (?P<count>\d+) contacts with (close|spread) steps were found: of "
        r"(?P<drawn>\d+) places drawn on the object (?P<near>\d+) were .*, at (?P<fitting>\d+) of these the "
        r"flat housing .* to (?P<reached>\d+) of these .* to (?P<visited>\d+) it had a free way; ask for"
    )
    found = re.match(pattern, message)
    assert found is not None, message
    return {name: int(value) for name, value in found.groupdict().items()}


@pytest.mark.usefixtures("hasty")
def test_where_no_way_goes_the_message_says_how_far_it_got() -> None:
    visit = Asked(stuck=2, back=-1)
    with pytest.raises(WrongUse, match=r"25 mm.*spread") as caught:
        sites(3, "close", visit)
    told = numbers(str(caught.value))
    assert (told["longest"], told["count"]) == (2, 3)
    assert told["drawn"] > told["near"] > told["fitting"] >= told["reached"] > told["visited"] > 0
    assert told["reached"] == len(visit.befores)
    assert told["visited"] == sum(good for _, good, _ in visit.befores)


@pytest.mark.usefixtures("hasty")
def test_an_object_out_of_reach_is_given_up_soon() -> None:
    asked: list[FloatArray] = []

    def reach(base_from_gel: FloatArray) -> bool:
        asked.append(base_from_gel)
        return False

    with pytest.raises(WrongUse, match=r"contacts.*pose") as caught:
        plan_sites(RASTER, GELSIGHT_R15, POSE, 3, "spread", 1, reach)
    told = numbers(str(caught.value))
    assert told["longest"] == told["reached"] == 0
    assert told["fitting"] == len(asked) > 10
    assert told["drawn"] == 2 * FEW


def test_every_candidate_may_follow_the_contacts_so_far() -> None:
    before = [site.point_in_object for site in sites(3, "close", None)]
    step = PressLimits().longest_step
    found = candidate_sites(RASTER, GELSIGHT_R15, POSE, 10, "close", 5, before)
    assert len(found) == 10
    for site in found:
        gaps = [np.linalg.norm(site.point_in_object - point) for point in before]
        assert gaps[-1] <= step
        assert min(gaps) >= SHORTEST_STEP
    anywhere = candidate_sites(RASTER, GELSIGHT_R15, POSE, 10, "spread", 5, before)
    assert max(np.linalg.norm(site.point_in_object - before[-1]) for site in anywhere) > step
    assert same(found, candidate_sites(RASTER, GELSIGHT_R15, POSE, 10, "close", 5, before))


def test_where_none_may_follow_the_message_says_what_was_lacking(hasty: None) -> None:
    far = [np.array([1.0, 0.0, 0.0])]
    with pytest.raises(WrongUse, match=r"0 of 1 contacts with close steps .*25 mm"):
        candidate_sites(RASTER, GELSIGHT_R15, POSE, 4, "close", 5, far)
