"""The first touch on a search's way does not depend on noise, on the zero, or on where the arm stopped."""

import numpy as np
import pytest

from harness.basics.arrays import FloatArray
from harness.basics.errors import BenchFault
from harness.bench.device import Channel, Reading
from harness.skills.press import first_touch

AXIS = np.array([0.0, 0.6, -0.8])
START = np.array([-0.4, 0.1, 0.5])
SPEED, NOISE, SURFACE = 0.010, 0.05, 0.022


def stiff(depth: FloatArray) -> FloatArray:
    """N against m: soft at first, as a gel is."""
    return np.asarray(2.0e4 * np.maximum(depth, 0.0) ** 1.5)


def search(
    stop: float, *, rate: float = 500.0, zero: float = 0.0, noise: float = NOISE, seed: int = 0
) -> tuple[Reading, ...]:
    """Packets of a search that comes to rest ``stop`` m from its start, on a surface 22 mm away."""
    rng = np.random.default_rng(seed)
    times = np.arange(round((stop / SPEED + 0.1) * rate)) / rate
    way = np.minimum(times * SPEED, stop)
    values = np.zeros((len(times), 7))
    values[:, :3] = START + way[:, None] * AXIS
    values[:, 3] = 1.0
    wrench = rng.normal(0.0, noise, (len(times), 6))
    wrench[:, :3] -= (stiff(way - SURFACE) + zero)[:, None] * AXIS
    return (
        Reading(Channel("arm.base_from_flange", "m, 1", (7,), "float64", "base", rate), times, values),
        Reading(Channel("arm.wrench", "N, N m", (6,), "float64", "base", rate), times, wrench),
    )


def touched(history: tuple[Reading, ...], force: float = 0.2) -> float:
    """Metres from the start."""
    return first_touch(history, AXIS, force) - float(START @ AXIS)


TRUE = SURFACE + (0.2 / 2.0e4) ** (2 / 3)


@pytest.mark.parametrize("stop", [0.0227, 0.0228, 0.0230, 0.0235])
@pytest.mark.parametrize("zero", [-0.15, 0.0, 0.15])
@pytest.mark.parametrize("seed", range(3))
def test_neither_the_stop_nor_the_zero_nor_noise_moves_it(stop: float, zero: float, seed: int) -> None:
    assert touched(search(stop, zero=zero, seed=seed)) == pytest.approx(TRUE, abs=0.06e-3)


def test_packets_far_apart_are_interpolated() -> None:
    assert touched(search(0.0235, rate=25.0, noise=0.0)) == pytest.approx(TRUE, abs=0.15e-3)


def test_a_search_that_stopped_before_the_mean_force_was_met_counts_from_its_stop() -> None:
    assert touched(search(0.0215)) == pytest.approx(0.0215, abs=1e-9)


def test_a_search_that_touched_at_its_start_counts_from_its_stop() -> None:
    poses, wrenches = search(0.0235, noise=0.0)
    late = slice(len(poses.times) - 20, None)
    ended = tuple(Reading(r.channel, r.times[late], r.values[late]) for r in (poses, wrenches))
    assert touched(ended) == pytest.approx(0.0235, abs=1e-9)


def test_packets_without_forces_are_refused() -> None:
    with pytest.raises(BenchFault, match=r"arm\.wrench"):
        touched(search(0.0235)[:1])
