"""The hammer in simulated time: fired by the arm's output alone, read as the box would be."""

from collections.abc import Callable

import numpy as np
import pytest

from harness.basics.arrays import AnyArray, FloatArray
from harness.bench.acquisition import strike_from_readings
from harness.bench.acquisition_channels import BLOCK, CLOCK, FLAG_FIELDS, FLAGS, FORCE, PRESSURE
from harness.bench.device import ImpactHammer, Reading
from harness.bench.kinematics import nearest_branch
from harness.bench.station_file import load_station, station_path
from mocks.daq.strike_counts import StrikeCounts
from mocks.in_process.arm import InProcessArm, Stage
from mocks.in_process.hammer import InProcessHammer
from mocks.ur.hooks import HOME
from mocks.world.world import NominalBench, World

SECTION = load_station(station_path("mock")).hammer
assert SECTION is not None
RATE = SECTION.rate
THROW, LENGTH, PEAK = 0.03, 0.2e-3, 40.0
Press = Callable[[float, float, float], FloatArray]


class Strikes:
    """Counts of a plain blow, and of where it was made."""

    def __init__(self) -> None:
        self.asked: list[tuple[FloatArray, int, int]] = []

    def record(self, base_from_flange: FloatArray, step: int, sample: int) -> AnyArray:
        self.asked.append((base_from_flange, step, sample))
        assert SECTION is not None
        times = np.arange(round(0.7 * RATE)) / RATE - THROW
        blow = (times > 0) & (times < LENGTH)
        force = (
            np.where(blow, PEAK * np.sin(np.pi * times / LENGTH), 0.0) / SECTION.acquisition.newtons_per_count
        )
        sound = np.where(times > 0, 2000 * np.exp(-30 * times) * np.sin(2 * np.pi * 1000 * times), 0.0)
        return np.stack([np.rint(force) + 120, np.rint(sound) - 180], axis=1).astype(np.int16)

    def idle(self) -> AnyArray:
        return np.tile(np.array([[120, -180], [121, -181]], np.int16), (5000, 1))


@pytest.fixture
def fixture(mug_bench: NominalBench, press: Press) -> tuple[InProcessHammer, InProcessArm, Stage, Strikes]:
    from harness.bench.gap import load_gap

    stage, strikes = Stage(time=2.0, step=4, sample=1), Strikes()
    joints = nearest_branch(
        "ur5e", press(-0.05, 1.0, 0.05), np.array(HOME), np.array([[-6.28] * 6, [6.28] * 6])
    )
    assert joints is not None
    arm = InProcessArm("ur5e", joints, World(mug_bench, load_gap("none"), 1), stage)
    assert SECTION is not None
    counts: StrikeCounts = strikes  # type: ignore[assignment]
    return InProcessHammer(counts, arm, 0, stage, SECTION), arm, stage, strikes


def read(hammer: ImpactHammer, fire: Callable[[], None]) -> dict[str, Reading]:
    hammer.open()
    found = hammer.capture(fire, 0.02, 0.4, 1.0)
    hammer.close()
    return {reading.channel.name: reading for reading in found}


def flag(readings: dict[str, Reading], name: str) -> float:
    return float(readings[FLAGS].values[0][FLAG_FIELDS.index(name)])


Parts = tuple[InProcessHammer, InProcessArm, Stage, Strikes]


def test_a_strike_is_read_around_its_trigger(fixture: Parts) -> None:
    hammer, arm, stage, strikes = fixture
    readings = read(hammer, lambda: arm.set_digital_output(0, True))
    assert set(readings) == {FORCE, PRESSURE, CLOCK, FLAGS}
    assert (flag(readings, "silent"), flag(readings, "overload"), flag(readings, "double_hit")) == (0, 0, 0)
    assert flag(readings, "onset") == 0.02 * RATE
    assert readings[FORCE].channel.shape == (BLOCK,)
    (asked,) = strikes.asked
    np.testing.assert_array_equal(asked[0], arm.state().base_from_flange)
    assert asked[1:] == (4, 1)
    # It was fired at 2 s and touched a throw later; the pressure is converted half a sample later.
    onset = readings[FORCE].times[0] + 0.02
    assert onset == pytest.approx(2.0 + THROW, abs=1e-4)
    assert readings[PRESSURE].times[0] - readings[FORCE].times[0] == pytest.approx(0.5 / RATE)
    assert stage.time == pytest.approx(onset + 0.4, abs=BLOCK / RATE)


def test_what_is_read_is_the_strike_in_newtons_and_pascals(fixture: Parts) -> None:
    hammer, arm, *_ = fixture
    assert SECTION is not None
    readings = read(hammer, lambda: arm.set_digital_output(0, True))
    strike = strike_from_readings(readings, SECTION.acquisition)
    assert strike.rate == pytest.approx(RATE)
    assert strike.force.max() == pytest.approx(PEAK, rel=0.05)
    assert np.abs(strike.pressure).max() == pytest.approx(
        2000 * SECTION.acquisition.pascals_per_count, rel=0.05
    )


@pytest.mark.parametrize("fired", ["nothing", "another output", "an output that is on already"])
def test_without_a_rise_of_the_striker_s_output_it_is_silent_for_the_whole_timeout(
    fixture: Parts, fired: str
) -> None:
    hammer, arm, stage, strikes = fixture
    if fired == "an output that is on already":
        arm.set_digital_output(0, True)
    actions = {
        "nothing": lambda: None,
        "another output": lambda: arm.set_digital_output(1, True),
        "an output that is on already": lambda: arm.set_digital_output(0, True),
    }
    readings = read(hammer, actions[fired])
    assert flag(readings, "silent") == 1
    assert strikes.asked == []
    assert stage.time >= 3.0
    assert np.ptp(readings[FORCE].values) <= 1


def test_it_says_how_it_does(fixture: Parts) -> None:
    health = fixture[0].health()
    assert (health.name, health.rate, health.drops) == ("hammer", RATE, 0)
