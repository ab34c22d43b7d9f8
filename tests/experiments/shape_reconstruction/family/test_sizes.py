"""Sizes and proportions of a class: ordinary draws are ordinary, and what is far from all of them is rare."""

import numpy as np
import pytest

from experiments.shape_reconstruction.family import revolution_distance as revolution
from experiments.shape_reconstruction.family.kind import FamilyShape
from experiments.shape_reconstruction.family.kinds import CLASSES, draw_shape, kind_of, rarity_of_size
from experiments.shape_reconstruction.family.search import LEVELS, FamilySearch
from tests.support.family_shapes import surface_of
from tests.support.shape_readings import look_at, shape_readings, touches_on

ORDINARY, RARE = 3.0, 5.0
"""Natural logarithms: of an ordinary thing at most, and of a rare one at least."""


def scaled(shape: FamilyShape, factor: float) -> FamilyShape:
    theta = shape.theta.copy()
    theta[list(kind_of(shape.code).lengths)] += np.log(factor)
    return FamilyShape(shape.name, shape.code, theta)


@pytest.mark.parametrize("name", CLASSES)
def test_draws_of_a_class_are_ordinary(name: str) -> None:
    drawn = [rarity_of_size(draw_shape(name, np.random.default_rng(seed))) for seed in range(100, 140)]
    assert min(drawn) >= 0.0
    assert np.median(drawn) < ORDINARY


@pytest.mark.parametrize("name", CLASSES)
@pytest.mark.parametrize("factor", [2.0, 0.5])
def test_the_farther_a_size_is_from_all_draws_the_rarer(name: str, factor: float) -> None:
    shape = draw_shape(name, np.random.default_rng(7))
    rarities = [rarity_of_size(scaled(shape, factor**k)) for k in range(3, 12)]
    assert np.isfinite(rarities).all()
    assert (np.diff(rarities) > 0.0).all()


def squat(name: str, half: float, height: float) -> FamilyShape:
    shape = draw_shape(name, np.random.default_rng(5))
    wide, _ = kind_of(shape.code).extent(shape.code, shape.theta)
    shape.theta[revolution.SLOT.radii] += np.log(half / wide)
    shape.theta[revolution.SLOT.height] = np.log(height)
    return shape


def test_a_stemmed_glass_as_low_and_wide_as_a_bowl_is_rare() -> None:
    assert rarity_of_size(squat("bowl", 0.076, 0.064)) < ORDINARY
    assert rarity_of_size(squat("stemmed glass", 0.076, 0.064)) > RARE


def test_a_rare_size_costs_where_hypotheses_are_ranked() -> None:
    bowl = draw_shape("bowl", np.random.default_rng(3))
    mesh = surface_of(bowl)
    search = FamilySearch(shape_readings(touches_on(mesh, 2, seed=1), look_at(mesh)), LEVELS["coarse"])
    glass = FamilyShape("stemmed glass", bowl.code, bowl.theta)
    named, misnamed = (search.refine(search.start(one, one.theta), 4) for one in (bowl, glass))
    assert named.misfit == pytest.approx(misnamed.misfit, rel=1e-6)
    assert misnamed.cost > named.cost + RARE
