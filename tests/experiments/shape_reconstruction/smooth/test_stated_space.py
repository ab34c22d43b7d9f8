"""The stated place and ``largest`` bind every method, or the contradiction is named."""

from dataclasses import replace

import numpy as np
import pytest
import trimesh

from experiments.shape_reconstruction import methods
from experiments.shape_reconstruction.evidence import ShapeEvidence
from experiments.shape_reconstruction.family import estimate as family
from experiments.shape_reconstruction.family.search import CONTINUED
from experiments.shape_reconstruction.methods import METHODS, continued, estimated
from experiments.shape_reconstruction.smooth.hermite import fit_rbf
from experiments.shape_reconstruction.smooth.stated_space import longest_side, max_offset
from experiments.shape_reconstruction.thresholds import MAX_LENGTH_RATIO
from harness.basics.arrays import FloatArray
from harness.basics.errors import FitRefused
from harness.basics.geometry import translation
from harness.basics.mesh import Mesh
from tests.support.shape_readings import look_at, shape_readings, touches_on

_BALL = trimesh.creation.icosphere(subdivisions=3)
THING = Mesh(0.03 * _BALL.vertices + [0.0, 0.0, 0.03], _BALL.faces)
"""60 mm across."""

SEEN = replace(shape_readings((), look_at(THING, 320)), largest=0.3)
TOUCHED = replace(shape_readings(touches_on(THING, 3, seed=0), None), largest=0.3)


def away(evidence: ShapeEvidence, by: FloatArray) -> ShapeEvidence:
    """The same readings of an object that stands elsewhere."""
    look = evidence.look
    if look is not None:
        pose = look.stand_from_camera.copy()
        pose[:2, 3] += by
        look = replace(look, stand_from_camera=pose)
    shift = np.array([*by, 0.0])
    touches = tuple(
        replace(one, points=one.points + shift, stand_from_gel=translation(shift) @ one.stand_from_gel)
        for one in evidence.touches
    )
    return replace(evidence, look=look, touches=touches)


@pytest.mark.parametrize("distance", [0.3, 1.0, 3.0])
@pytest.mark.parametrize("towards", [0.0, 1.6, 3.1, -2.3, 0.84])
def test_an_outline_away_from_the_stated_place_is_refused_by_every_method(
    distance: float, towards: float
) -> None:
    moved = away(SEEN, distance * np.array([np.cos(towards), np.sin(towards)]))
    for method in METHODS:
        with pytest.raises(FitRefused, match=r" m .*largest 0.3 m .*0.14 m"):
            estimated(method, moved)
    with pytest.raises(FitRefused, match=r" m .*largest 0.3 m .*0.14 m"):
        continued(moved, CONTINUED, None)


def test_an_outline_near_the_stated_place_is_not_refused() -> None:
    for by in (0.0, 0.9 * 3.0 * SEEN.place_error):
        assert estimated("glance", away(SEEN, np.array([by, 0.0]))).mesh.vertices.size


def test_an_outline_above_the_horizon_stands_nowhere() -> None:
    assert SEEN.look is not None
    pose = SEEN.look.stand_from_camera.copy()
    pose[2, 3] *= -1.0
    with pytest.raises(FitRefused, match="horizon"):
        estimated("glance", replace(SEEN, look=replace(SEEN.look, stand_from_camera=pose)))


def test_contacts_away_from_the_stated_place_or_too_far_apart_are_refused() -> None:
    with pytest.raises(FitRefused, match=r"0.3\d m .*0.27 m"):
        estimated("rbf", away(TOUCHED, np.array([0.32, 0.0])))
    pair = (TOUCHED.touches[0], away(TOUCHED, np.array([0.26, 0.0])).touches[0])
    with pytest.raises(FitRefused, match=r"0.1\d m .*largest .*0.15 m"):
        estimated("rbf", replace(TOUCHED, touches=pair, largest=0.15, place_error=0.08))
    assert estimated("rbf", TOUCHED).mesh.vertices.size


@pytest.mark.parametrize(("factor", "refused"), [(0.99, False), (1.01, True)])
def test_an_answer_longer_than_stated_is_refused(
    monkeypatch: pytest.MonkeyPatch, factor: float, refused: bool
) -> None:
    small = fit_rbf(TOUCHED)
    size = factor * MAX_LENGTH_RATIO * TOUCHED.largest / longest_side(small.mesh.vertices)
    grown = replace(small, mesh=Mesh(size * small.mesh.vertices, small.mesh.faces))
    box = {"box": lambda _: grown}
    monkeypatch.setattr(methods, "reconstruct", lambda *_: grown)
    if not refused:
        assert estimated("box", TOUCHED, box) is grown
        assert continued(TOUCHED, CONTINUED, None) is grown
        return
    with pytest.raises(FitRefused, match=r"0.33 m .*box.*largest .*0.3 m"):
        estimated("box", TOUCHED, box)
    with pytest.raises(FitRefused, match=r"0.33 m .*family"):
        continued(TOUCHED, CONTINUED, None)


@pytest.mark.parametrize("angle", [0.0, 0.3, 0.7])
def test_the_longest_side_is_that_of_the_box_however_it_is_turned(angle: float) -> None:
    corners = np.array([[x, y, z] for x in (0.0, 0.2) for y in (0.0, 0.1) for z in (0.0, 0.05)])
    turn = np.array(
        [[np.cos(angle), -np.sin(angle), 0.0], [np.sin(angle), np.cos(angle), 0.0], [0.0, 0.0, 1.0]]
    )
    assert longest_side(corners @ turn.T) == pytest.approx(0.2, rel=0.03)
    assert longest_side(corners * [1.0, 1.0, 8.0]) == pytest.approx(0.4)


def test_hypotheses_away_from_the_stated_place_or_too_large_are_left_out(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    from experiments.shape_reconstruction.family.search import LEVELS, FamilySearch

    found = FamilySearch(TOUCHED, replace(LEVELS["coarse"], draws=42, starts=4, refined=2, hops=0)).run()
    near = found[0]
    theta = near.shape.theta.copy()
    theta[0] = 1.01 * max_offset(TOUCHED)
    far = replace(near, shape=replace(near.shape, theta=theta))
    assert family._at_stated_place([far, near], TOUCHED) == [near]
    with pytest.raises(FitRefused, match=r" m .* m .*largest .*0.3 m"):
        family._at_stated_place([far], TOUCHED)
    with pytest.raises(FitRefused, match=r"largest .*0.01 m"):
        family._at_stated_place([near], replace(TOUCHED, largest=0.01))
