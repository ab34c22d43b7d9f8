"""One picture serves attitudes about it: what a turn that is expected changes of a score."""

from functools import partial

import numpy as np
import pytest

from experiments.contact_localization.posterior.search import turns_between
from experiments.contact_localization.touch.kernels import leanings_at, put_lean
from experiments.contact_localization.touch.touch import UPRIGHT, TouchNoise, best_fit, touch_map
from harness.basics.arrays import FloatArray
from harness.basics.geometry import rotation_about
from harness.bench.sensor import GELSIGHT_R15
from harness.sim.gel.height_map import RasterMesh, first_surface
from harness.sim.gel.view import LEAN, ToolView, view_along
from tests.samples.synthetic_press import BLOCK, Press, felt, stepped_block

NOISE = TouchNoise()
UP = np.array([0.0, 0.0, 1.0])
YAW = np.radians(2.5)
WALL = Press((0.0, -0.025, 0.0), (0.0, 1.0, 0.0), yaw=0.2)
EDGE = Press((0.008, -0.005, 0.025), (0.02, 0.0, -np.sqrt(1.0 - 0.02**2)), yaw=0.3)
CORNER = Press((0.034, 0.009, 0.025), (-0.1, 0.1, -np.sqrt(0.98)), yaw=0.6)


@pytest.fixture(scope="module")
def block() -> RasterMesh:
    return RasterMesh(stepped_block())


def _view(block: RasterMesh, object_from_gel: FloatArray) -> ToolView:
    pitch = 0.5 * BLOCK * GELSIGHT_R15.pitch
    return view_along(
        partial(first_surface, block), block.mesh.vertices, object_from_gel, pitch, GELSIGHT_R15
    )


def _fit(block: RasterMesh, press: Press, object_from_gel: FloatArray, turn: FloatArray = UPRIGHT) -> float:
    """Nats of what a press felt, by the view that an attitude has, the gel turned against it by so much."""
    view = _view(block, object_from_gel)
    touch = touch_map(felt(block, press), GELSIGHT_R15.pitch, BLOCK, NOISE.skirt, NOISE.edge, 0.12e-3)
    place = press.object_from_gel[:3, 3] @ view.object_from_view
    return best_fit(view, touch, NOISE, place, NOISE.shift, turn)


def _fits(block: RasterMesh, press: Press, yaw: float) -> tuple[float, ...]:
    """Nats by the press's own view, and by one of the object turned less: expected, not, and opposite."""
    own = press.object_from_gel[:3, :3]
    base_from_gel = rotation_about(UP, yaw) @ own
    (turn,) = turns_between(base_from_gel, np.array([yaw]))
    return _fit(block, press, own), *(
        _fit(block, press, base_from_gel, one) for one in (turn, UPRIGHT, -turn)
    )


@pytest.mark.parametrize("yaw", [YAW, -YAW])
@pytest.mark.parametrize(("press", "share"), [(WALL, 0.1), (EDGE, 0.7)])
def test_a_view_of_another_yaw_serves_as_the_own_where_the_turn_is_expected(
    block: RasterMesh, press: Press, share: float, yaw: float
) -> None:
    """A wall leans by the yaw, an edge from above is turned by it: unexpected, either tells a wrong yaw."""
    own, expected, unexpected, _ = _fits(block, press, yaw)
    assert unexpected < own - 0.05
    assert abs(expected - own) < share * (own - unexpected)


@pytest.mark.parametrize("yaw", [YAW, -YAW])
@pytest.mark.parametrize("press", [WALL, EDGE, CORNER])
def test_a_turn_the_other_way_costs_more(block: RasterMesh, press: Press, yaw: float) -> None:
    _, expected, _, opposite = _fits(block, press, yaw)
    assert opposite < expected - 0.1


def test_no_turn_changes_nothing() -> None:
    lean = np.random.default_rng(0).uniform(-1.0, 1.0, (5, LEAN))
    np.testing.assert_array_equal(leanings_at(lean, 0.0, 0.0, 0.0), np.zeros(5))


def test_what_an_image_does_not_tell_no_turn_costs() -> None:
    """A contact of one pixel tells no tilt: where none is expected or any, it fits as well."""
    lean, normal = np.empty(LEAN), np.diag([9.0, 0.0, 0.0])
    put_lean(normal, np.zeros(3), (64e-6, 0.03, 0.02), lean)
    assert leanings_at(np.r_[lean[:5], 0.0, 0.0][None], 0.1, -0.1, 0.0) == pytest.approx(0.0)
