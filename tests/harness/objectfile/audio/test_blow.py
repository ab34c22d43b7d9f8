"""Blows: what passes to the object, and what is refused."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from harness.basics.errors import WrongUse
from harness.basics.materials import MATERIALS
from harness.objectfile.audio.blow import HAMMERS, LONGEST, HammerBlow, hammer, hammered, pulse_lasting
from harness.sim.sound.contact_pulse import HertzPulse, hertz_pulse

CERAMIC = MATERIALS["ceramic"]
DOWN = np.array([0.0, 0.0, -1.0])


def pulse_of(blow: HammerBlow) -> HertzPulse:
    assert blow.pulse is not None
    return blow.pulse


@given(st.tuples(*3 * [st.floats(-1e3, 1e3)]).filter(lambda force: math.hypot(*force) > 1e-3))
def test_an_impulse_keeps_its_size_and_direction(force: tuple[float, float, float]) -> None:
    blow = HammerBlow.instant(force)
    assert np.linalg.norm(blow.direction) == pytest.approx(1.0)
    assert blow.impulse * blow.direction == pytest.approx(np.array(force), abs=1e-12)


@pytest.mark.parametrize(
    ("force", "said"),
    [
        ([0.0, 0.0, 0.0], "force .*0"),
        ([0.0, float("nan"), 1.0], "finite"),
        ([float("inf"), 0.0, 1.0], "finite"),
        ([1.0, 2.0], "finite"),
        ([1e-300, 0.0, 0.0], "force .* N"),
        ([0.0, 1e308, 1e308], "force .* N"),
    ],
)
def test_a_force_that_strikes_nothing_is_refused(force: list[float], said: str) -> None:
    with pytest.raises(WrongUse, match=said):
        HammerBlow.instant(force)


@given(st.sampled_from(sorted(HAMMERS)), st.floats(0.01, 1e3))
def test_a_hammer_comes_to_the_force_that_was_asked_for(name: str, peak: float) -> None:
    blow = hammered(peak * DOWN, hammer(name), CERAMIC, mass=0.3)
    assert pulse_of(blow).peak == pytest.approx(peak, rel=1e-9)
    assert blow.direction == pytest.approx(DOWN)
    assert blow.impulse == pulse_of(blow).impulse


def test_a_hammer_of_a_speed_is_that_of_hertz() -> None:
    blow = hammered(DOWN, hammer("nylon"), CERAMIC, 0.3, speed=0.7)
    assert blow.pulse == hertz_pulse(HAMMERS["nylon"], 0.7, CERAMIC, mass=0.3)


def test_softer_tips_stay_longer() -> None:
    steel, nylon, rubber = (
        pulse_of(hammered(10.0 * DOWN, hammer(name), CERAMIC)).duration
        for name in ("steel", "nylon", "rubber")
    )
    assert steel < 0.1e-3 < nylon < 1e-3 < rubber < 0.1


@settings(deadline=None)  # it integrates a force of thousands of samples
@given(st.floats(1e-5, LONGEST), st.floats(1e-3, 1.0), st.floats(0.01, 1e3))
def test_a_contact_time_is_kept_with_the_force_and_the_impulse_of_its_history(
    duration: float, mass: float, peak: float
) -> None:
    blow = hammered(peak * DOWN, hammer("steel", mass=mass), CERAMIC, contact=duration)
    pulse = pulse_of(blow)
    assert pulse.duration == duration
    assert pulse.peak == pytest.approx(peak, rel=1e-9)
    steps = 4000
    middle = (np.arange(steps) + 0.5) * duration / steps
    assert pulse.force(middle).sum() * duration / steps == pytest.approx(pulse.impulse, rel=1e-4)
    assert pulse.force(np.array([0.5 * duration])) == pytest.approx(peak)


def test_a_contact_time_is_what_a_tip_of_that_hardness_makes() -> None:
    """Hertz's own blow, asked for by nothing but its duration, mass and speed."""
    own = hertz_pulse(HAMMERS["nylon"], 0.5, CERAMIC)
    asked = pulse_lasting(own.duration, HAMMERS["nylon"].mass, 0.5)
    assert asked.peak == pytest.approx(own.peak)
    assert asked.impulse == pytest.approx(own.impulse)
    assert asked.approach == pytest.approx(own.approach)


@pytest.mark.parametrize("turns", [0.0, 0.3, 1.0, 4.0, 30.0])
def test_a_mode_is_given_the_spectrum_of_the_force(turns: float) -> None:
    pulse = pulse_lasting(1e-3, 0.01, 0.5)
    given_ = HammerBlow.lasting(DOWN, pulse).given_to(np.array([turns / 1e-3]))
    steps = 200_000
    times = (np.arange(steps) + 0.5) * 1e-3 / steps
    wanted = abs(np.sum(pulse.force(times) * np.exp(-2e3j * np.pi * turns * times))) * 1e-3 / steps
    assert given_ == pytest.approx([wanted], abs=2e-3 * pulse.impulse)
    assert given_ <= pulse.impulse * (1.0 + 1e-12)


def test_an_impulse_gives_every_mode_all_of_it() -> None:
    assert HammerBlow.instant([0.0, 3.0, 4.0]).given_to(np.array([1.0, 1e4])).tolist() == [5.0, 5.0]


def test_what_makes_no_blow_is_refused() -> None:
    with pytest.raises(WrongUse, match="'nylom'"):
        hammer("nylom")
    with pytest.raises(WrongUse, match=r"2 N .*0\.5 m/s"):
        hammered(2.0 * DOWN, hammer("steel"), CERAMIC, speed=0.5)
    for speed in (0.0, -1.0, float("nan")):
        with pytest.raises(WrongUse, match="speed"):
            hammered(DOWN, hammer("steel"), CERAMIC, speed=speed)
        with pytest.raises(WrongUse, match="speed"):
            hammered(DOWN, hammer("steel"), CERAMIC, speed=speed, contact=1e-3)
    with pytest.raises(WrongUse, match=r"radius .*0 m"):
        hammered(DOWN, hammer("steel", radius=0.0), CERAMIC)
    with pytest.raises(WrongUse, match=r"mass .*0 kg"):
        hammered(DOWN, hammer("steel", mass=0.0), CERAMIC, contact=1e-3)
    for contact in (0.0, float("inf")):
        with pytest.raises(WrongUse, match=f"contact .*{contact:g} s"):
            hammered(DOWN, hammer("steel"), CERAMIC, contact=contact)
    with pytest.raises(WrongUse, match=r"contact .*1 s .* s$"):
        hammered(DOWN, hammer("steel"), CERAMIC, contact=1.0)
    with pytest.raises(WrongUse, match=r"force .* N.* N"):
        hammered(DOWN, hammer("steel"), CERAMIC, speed=1e9)
