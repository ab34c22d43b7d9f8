"""The estimator's noise is that of the bench that the station states."""

from dataclasses import asdict
from typing import Any

import numpy as np
import pytest

from experiments.contact_localization.model import Model, Prior
from experiments.contact_localization.posterior.estimate import locate
from experiments.contact_localization.posterior.likelihood import Noise, noise_at
from experiments.contact_localization.posterior.search import Search
from experiments.contact_localization.touch.touch import Contact
from harness.bench.gap import USUAL
from tests.support.localization import dials

QUICK = dials(spacing=3e-3, rounds=2, samples=600)


def figures(noise: Any) -> dict[str, float]:
    """Every sigma by its name."""
    found: dict[str, float] = {}
    for name, value in (noise if isinstance(noise, dict) else asdict(noise)).items():
        inner = figures(value) if isinstance(value, dict) else {"": float(value)}
        found |= {f"{name}.{key}".rstrip("."): number for key, number in inner.items()}
    return found


def test_the_usual_errors_give_the_usual_noise_to_the_bit() -> None:
    assert noise_at(USUAL) == Noise()


@pytest.mark.parametrize(
    "name", ["yaw", "tilt", "scale", "gel_centre", "gel_tilt", "arm", "arm_tilt", "gel_depth"]
)
def test_a_greater_error_makes_some_noise_greater_and_none_less(name: str) -> None:
    wider = noise_at(USUAL.model_copy(update={name: 2.0 * getattr(USUAL, name)}))
    usual, found = figures(Noise()), figures(wider)
    assert all(found[key] >= value for key, value in usual.items())
    assert any(found[key] > value for key, value in usual.items())


def test_the_grid_of_yaws_reaches_three_sigmas_of_what_is_stated(
    contacts: tuple[Contact, ...], block: Model
) -> None:
    for factor in (0.5, 1.0, 1.2, 2.0):
        sigma = factor * USUAL.yaw
        search = Search(contacts, block, Prior(np.eye(3), "known", sigma), 3e-3, Noise())
        assert search.yaws.max() >= 3.0 * sigma
        assert search.yaws.max() == -search.yaws.min()
        assert search.yaw_step == pytest.approx(np.radians(1.0))


def test_a_bench_with_greater_errors_has_a_wider_region(
    contacts: tuple[Contact, ...], block: Model, prior: Prior
) -> None:
    areas = []
    for factor in (1.0, 2.0, 4.0):
        errors = USUAL.times(factor)
        at = Prior(prior.base_from_object, "known", errors.yaw)
        areas.append(locate(contacts, block, at, QUICK, noise_at(errors))[-1].region.area)
    assert areas == sorted(areas)
    assert areas[-1] > areas[0]
