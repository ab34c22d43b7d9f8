"""A picture counts when it has come to rest; one that does not is waited for, and then it does not count."""

import numpy as np
import pytest

from calibration.taxim.arm.touch_down import Stillness, settle, unrest_between
from harness.basics.arrays import FloatArray
from harness.basics.errors import BenchFault
from harness.bench.device import Channel, Health, Reading

CHANNEL = Channel("gel.image", "count", (40, 60, 3), "uint8", "gel", 25.0)
STILL = Stillness()


class Gel:
    """A gel whose picture creeps to its rest, or flickers for ever, in simulated time."""

    def __init__(
        self, creep: float = 0.0, lasts: float = 1.0, flicker: float = 0.0, noise: float = 0.0
    ) -> None:
        self.time = 0.0
        self._creep, self._lasts, self._flicker, self._noise = creep, lasts, flicker, noise
        self._random = np.random.default_rng(0)

    def open(self) -> None: ...

    def close(self) -> None: ...

    def health(self) -> Health:
        raise NotImplementedError

    def pause(self, seconds: float) -> None:
        self.time += seconds

    def picture(self) -> FloatArray:
        grown = self._creep * np.exp(-self.time / self._lasts) + self._flicker * np.cos(7.0 * self.time)
        picture = np.full(CHANNEL.shape, 100.0)
        picture[10:26, 20:36] += grown
        return picture + self._random.normal(0.0, self._noise, CHANNEL.shape)

    def read(self, count: int, timeout: float) -> Reading:
        frames, times = [], []
        for _ in range(count):
            self.time += 0.04
            times.append(self.time)
            frames.append(np.round(self.picture()))
        return Reading(CHANNEL, np.array(times), np.array(frames))


def test_a_picture_at_rest_is_taken_at_once() -> None:
    gel = Gel(noise=2.0)
    found = settle(gel, gel.pause, STILL)
    assert found.settled
    assert len(found.unrest) == STILL.looks
    assert found.frames.values.shape == (STILL.frames, 40, 60, 3)


@pytest.mark.parametrize("lasts", [0.3, 0.6])
def test_a_creeping_gel_is_waited_for_until_it_creeps_no_more(lasts: float) -> None:
    gel = Gel(creep=40.0, lasts=lasts)
    found = settle(gel, gel.pause, STILL)
    assert found.settled
    assert found.seconds > 2.0 * lasts
    # What is left of the creep is of the order of what two looks may differ by.
    assert abs(float(gel.picture()[15, 25, 0]) - 100.0) < 3.0 * STILL.limit * lasts / STILL.interval
    assert found.unrest[0] > STILL.limit
    assert (found.unrest[-STILL.looks :] <= STILL.limit).all()


def test_slower_creep_is_waited_for_longer() -> None:
    waited = []
    for lasts in (0.2, 0.4, 0.8):
        gel = Gel(creep=40.0, lasts=lasts)
        waited.append(settle(gel, gel.pause, STILL).seconds)
    assert waited == sorted(waited)
    assert waited[-1] > waited[0]


def test_one_that_never_rests_is_given_up_after_the_patience_and_says_so() -> None:
    gel = Gel(flicker=12.0)
    found = settle(gel, gel.pause, STILL)
    assert not found.settled
    assert STILL.patience <= found.seconds < STILL.patience + 1.0
    assert found.unrest.max() > STILL.limit


def test_one_still_look_between_two_that_are_not_does_not_make_it_settled() -> None:
    """The cosine's turning points look still, once each."""
    gel = Gel(flicker=30.0)
    found = settle(gel, gel.pause, Stillness(limit=6.0, looks=3))
    assert not found.settled


def test_unrest_counts_what_a_contact_shows_and_not_a_single_pixel() -> None:
    rest = np.full((120, 160, 3), 90.0)
    speck, contact = rest.copy(), rest.copy()
    speck[30, 40] += 100.0
    contact[48:72, 56:80, 1] += 5.0
    assert unrest_between(rest, speck) < 0.1
    assert unrest_between(rest, contact) == pytest.approx(5.0)
    assert unrest_between(contact, rest) == unrest_between(rest, contact)


def test_a_camera_that_stalls_is_a_fault_and_not_a_still_picture() -> None:
    class Stalled(Gel):
        def read(self, count: int, timeout: float) -> Reading:
            raise BenchFault("gel sent nothing")

    gel = Stalled()
    with pytest.raises(BenchFault, match="nothing"):
        settle(gel, gel.pause, STILL)
