"""The world's strikes: linear in force, common to a run but for what moves, the same when run again."""

from collections.abc import Callable

import numpy as np
import pytest

from harness.basics.arrays import FloatArray
from harness.basics.geometry import inverse, transform, translation
from harness.bench.acquisition import shipped_acquisition
from harness.bench.acquisition_channels import judge
from harness.bench.gap import Gap, load_gap
from harness.sim.modal.modes import Modes
from mocks.daq.strike_counts import StrikeCounts
from mocks.world.sound import IMPULSE, SoundingObject, WorldSound
from mocks.world.world import NominalBench, World

RATE = 50e3
FLANGE_FROM_HAMMER = transform(np.diag([1.0, -1.0, -1.0]), np.array([0.09, 0.0, -0.05]))
STAND_OFF = 6e-3
FREQUENCIES = np.array([900.0, 2100.0, 4300.0, 7900.0])
DAMPINGS = np.array([8.0, 12.0, 20.0, 30.0])
LEVELS = np.array([200.0, 100.0, 150.0, 100.0])
QUIET = {"signal_to_noise": 200.0}

Press = Callable[[float, float, float], FloatArray]


def modes_on(world: World) -> Modes:
    """Smooth waves on the true surface, along its normals."""
    mesh = world.mesh
    points, normals = mesh.vertices, mesh.vertex_normals
    waves = np.array([[60.0, 0, 30.0], [0, 80.0, -40.0], [50.0, 60.0, 0], [-90.0, 40.0, 70.0]])
    heights = np.cos(points @ waves.T + np.array([0.2, 1.0, 2.0, 0.6]))
    shapes = heights[:, :, None] * normals[:, None, :] / np.sqrt(0.3)
    counts = (len(points), len(mesh.faces))
    return Modes(FREQUENCIES, points, normals, mesh.faces, shapes, 20e3, 0.3, 6, *counts, 1e-9, {})


def changed(gap: str, **sound: object) -> Gap:
    loaded = load_gap(gap)
    return loaded.model_copy(update={"sound": loaded.sound.model_copy(update=sound)})


@pytest.fixture(scope="module")
def bench(mug_bench: NominalBench) -> NominalBench:
    return mug_bench


def sound_of(bench: NominalBench, gap: Gap, seed: int = 3) -> WorldSound:
    world = World(bench, gap, seed)
    instrument = SoundingObject(modes_on(world), DAMPINGS, LEVELS)
    return WorldSound(world, instrument, gap, seed, FLANGE_FROM_HAMMER, RATE)


@pytest.fixture(scope="module")
def exact(bench: NominalBench) -> WorldSound:
    return sound_of(bench, changed("none", **QUIET))


@pytest.fixture(scope="module")
def wrong(bench: NominalBench) -> WorldSound:
    return sound_of(bench, changed("default", **QUIET))


@pytest.fixture(scope="module")
def before(bench: NominalBench, press: Press) -> Callable[[float, float], FloatArray]:
    """``base_from_flange`` with the hammer before the wall at an azimuth and a height."""

    def placed(azimuth: float, height: float) -> FloatArray:
        base_from_gel = press(0.0, azimuth, height) @ bench.flange_from_gel
        hammer = base_from_gel @ translation(np.array([0.0, 0.0, -STAND_OFF]))
        base_from_flange: FloatArray = hammer @ inverse(FLANGE_FROM_HAMMER)
        return base_from_flange

    return placed


PLACES = [(2.0, 0.03), (2.3, 0.05), (2.8, 0.06), (3.3, 0.04), (3.8, 0.07), (4.2, 0.025)]
Before = Callable[[float, float], FloatArray]


def at_peaks(sound: WorldSound, before: Before, places: list[tuple[float, float]] = PLACES) -> FloatArray:
    """``(places, modes)`` complex: what each strike's transfer function is at each true resonance."""
    found = []
    for step, place in enumerate(places):
        truth = sound.strike(before(*place), step, 1)
        window = np.exp(-np.arange(len(truth.force)) / RATE * 20.0)
        turns = np.exp(-2j * np.pi * sound.frequencies[:, None] * np.arange(len(truth.force)) / RATE)
        found.append((turns @ (truth.pressure * window)) / (turns @ (truth.force * window)))
    return np.array(found)


def test_a_strike_is_a_half_sine_of_its_impulse_after_the_solenoid_s_way(
    exact: WorldSound, before: Before
) -> None:
    truth = exact.strike(before(*PLACES[0]), 0, 1)
    blow = truth.aim.blow
    assert truth.force.sum() / RATE == pytest.approx(IMPULSE, rel=0.02)  # ten samples a pulse
    assert 0.16e-3 <= blow.pulse <= 0.24e-3
    pushed = np.flatnonzero(truth.force) / RATE
    assert blow.throw <= pushed[0] < blow.throw + 1 / RATE
    assert blow.throw + blow.pulse - 1 / RATE <= pushed[-1] <= blow.throw + blow.pulse
    quiet = truth.pressure[: int(blow.throw * RATE)]
    assert np.abs(quiet).max() < 1e-6 * np.abs(truth.pressure).max()


def test_without_a_gap_the_hammer_meets_the_very_place_along_its_axis_and_modes_are_exact(
    exact: WorldSound, before: Before, bench: NominalBench
) -> None:
    np.testing.assert_array_equal(exact.frequencies, FREQUENCIES)
    np.testing.assert_array_equal(exact.dampings, DAMPINGS)
    assert exact.force_gain == 1.0
    azimuth, height = PLACES[2]
    aim = exact.aim(before(azimuth, height), 0, 1)
    outward = np.array([np.cos(azimuth), np.sin(azimuth), 0.0])
    np.testing.assert_allclose(aim.direction_in_object, -outward, atol=1e-9)
    assert aim.met is not None
    off = aim.met.nominal - np.array([0.0, 0.0, height])
    assert np.linalg.norm(off - (off @ outward) * outward) < 0.1e-3  # the arm's own 0.02 mm an axis
    tip = before(azimuth, height) @ FLANGE_FROM_HAMMER
    met_in_base = bench.base_from_object @ np.append(aim.met.nominal, 1.0)
    assert (met_in_base[:3] - tip[:3, 3]) @ tip[:3, 2] == pytest.approx(STAND_OFF, abs=0.5e-3)


def test_without_a_gap_each_resonance_says_the_shape_where_it_was_struck(
    exact: WorldSound, before: Before
) -> None:
    heard = at_peaks(exact, before)
    aims = [exact.aim(before(*place), step, 1) for step, place in enumerate(PLACES)]
    points = np.array([aim.met.point for aim in aims if aim.met is not None])
    gains = modes_on(exact._world).gains(points, np.array([aim.direction_in_object for aim in aims]))
    for mode in range(len(FREQUENCIES)):
        expected = gains[:, mode] / np.linalg.norm(gains[:, mode])
        common = heard[:, mode] / np.linalg.norm(heard[:, mode])
        assert abs(np.vdot(common, expected)) > 0.999


def test_a_gain_of_the_run_is_common_to_its_strikes_and_one_of_a_strike_is_not(
    bench: NominalBench, before: Before
) -> None:
    heard = {}
    for name, sound in {"run": {"microphone_gain": 3.0}, "strike": {"gain_per_strike": 3.0}}.items():
        heard[name] = at_peaks(sound_of(bench, changed("none", **QUIET, **sound)), before)
    plain = at_peaks(sound_of(bench, changed("none", **QUIET)), before)
    for mode in range(len(FREQUENCIES)):
        levels = np.abs(plain[:, mode])
        strong = levels > 0.3 * levels.max()  # beside a nodal line the neighbours leak in
        same = heard["run"][strong, mode] / plain[strong, mode]
        assert np.abs(same - same.mean()).max() < 0.05 * np.abs(same).max()
        own = heard["strike"][strong, mode] / plain[strong, mode]
        assert strong.sum() < 2 or 1.0 < np.ptp(20 * np.log10(np.abs(own))) < 20.0


def test_sound_is_linear_in_the_force(bench: NominalBench, before: Before) -> None:
    once = sound_of(bench, changed("default", **QUIET)).strike(before(*PLACES[0]), 0, 1)
    harder = sound_of(bench, changed("default", **QUIET, saturated_strikes=(0,))).strike(
        before(*PLACES[0]), 0, 1
    )
    np.testing.assert_allclose(harder.force, 10.0 * once.force, atol=1e-9)
    scale = np.abs(once.pressure).max()
    np.testing.assert_allclose(harder.pressure, 10.0 * once.pressure, atol=1e-5 * scale)


def test_a_run_again_reads_the_same_in_any_order_and_another_seed_does_not(
    bench: NominalBench, before: Before
) -> None:
    gap = load_gap("default")
    first, second = sound_of(bench, gap), sound_of(bench, gap)
    forward = [first.strike(before(*place), step, 1) for step, place in enumerate(PLACES[:3])]
    for step in (2, 0, 1):
        again = second.strike(before(*PLACES[step]), step, 1)
        np.testing.assert_array_equal(again.force, forward[step].force)
        np.testing.assert_array_equal(again.pressure, forward[step].pressure)
    other = sound_of(bench, gap, seed=4).strike(before(*PLACES[0]), 0, 1)
    assert len(other.force) != len(forward[0].force) or np.any(other.pressure != forward[0].pressure)


@pytest.mark.parametrize("gap", ["none", "default"])
def test_the_noise_lies_under_a_middling_strike_as_far_as_the_gap_says(
    bench: NominalBench, before: Before, gap: str
) -> None:
    sound, loud = sound_of(bench, load_gap(gap)), sound_of(bench, changed(gap, **QUIET))
    truth = sound.strike(before(*PLACES[0]), 0, 1)
    quiet = truth.pressure[: int(0.9 * truth.aim.blow.throw * RATE)]
    assert quiet.std() == pytest.approx(sound.noise, rel=0.1)
    places = [(azimuth, height) for azimuth in np.linspace(1.6, 4.6, 9) for height in (0.02, 0.05, 0.08)]
    levels = []
    for place in places:
        heard = loud.strike(before(*place), 0, 1).pressure[int(truth.aim.blow.throw * RATE) :]
        levels.append(np.sqrt(np.mean(heard[: int(0.5 * RATE)] ** 2)))
    wanted = load_gap(gap).sound.signal_to_noise
    assert 20 * np.log10(np.median(levels) / sound.noise) == pytest.approx(wanted, abs=4.0)


def test_what_the_gap_says_of_the_modes_is_drawn_about_it(bench: NominalBench) -> None:
    factors = []
    for seed in range(40):
        sound = sound_of_draw(seed)
        factors.append(sound)
    frequency, spread, damping = np.array(factors).T
    assert np.std(frequency) == pytest.approx(0.03, rel=0.35)
    assert np.mean(spread) == pytest.approx(0.003, rel=0.35)
    assert np.std(damping) == pytest.approx(0.3, rel=0.5)


def sound_of_draw(seed: int) -> tuple[float, float, float]:
    from mocks.world.gap_draw import GapDraw
    from mocks.world.sound import SoundDraw

    draw = SoundDraw(GapDraw(load_gap("default"), seed))
    nominal = np.linspace(1e3, 1e4, 30)
    ratios = draw.frequencies(nominal) / nominal
    return float(ratios.mean() - 1.0), float(ratios.std() / ratios.mean()), float(np.log(draw.damping))


def test_a_hand_takes_the_sound_out_of_every_mode(bench: NominalBench) -> None:
    free, held = (sound_of(bench, load_gap(name)) for name in ("default", "hand_held"))
    np.testing.assert_allclose(held.dampings - free.dampings, 150.0)


def counted(bench: NominalBench, gap: Gap, pose: FloatArray, step: int) -> tuple[FloatArray, FloatArray]:
    record = StrikeCounts(sound_of(bench, gap), shipped_acquisition("acquisition_bench")).record(
        pose, step, 1
    )
    return record[:, 0].astype(float), record[:, 1].astype(float)


@pytest.mark.parametrize(
    ("fault", "expected"),
    [
        ({}, (False, False, False)),
        ({"silent_strikes": (2,)}, (True, False, False)),
        ({"saturated_strikes": (2,)}, (False, True, False)),
        ({"double_strikes": (2,)}, (False, False, True)),
        ({"silent_strikes": (1,), "saturated_strikes": (0,), "double_strikes": (3,)}, (False, False, False)),
    ],
)
def test_a_fault_of_one_strike_is_read_as_what_it_is(
    bench: NominalBench, before: Before, fault: dict[str, object], expected: tuple[bool, bool, bool]
) -> None:
    force, pressure = counted(bench, changed("default", **fault), before(*PLACES[2]), 2)
    flags = judge(force, pressure, 147.0, 32767, 32767)
    assert (flags.silent, flags.overload, flags.double_hit) == expected


def test_a_hammer_that_meets_nothing_is_silent(bench: NominalBench, before: Before) -> None:
    away = translation(np.array([0.0, 0.0, 0.3])) @ before(*PLACES[0])
    sound = sound_of(bench, load_gap("default"))
    truth = sound.strike(away, 0, 1)
    assert truth.aim.met is None
    assert not truth.force.any()
    assert truth.pressure.std() == pytest.approx(sound.noise, rel=0.1)


def test_the_microphone_is_read_half_a_sample_after_the_force(bench: NominalBench, before: Before) -> None:
    gap = changed("none", **QUIET)
    calibration = shipped_acquisition("acquisition_bench")
    sound = sound_of(bench, gap)
    truth = sound.strike(before(*PLACES[0]), 0, 1)
    force, pressure = counted(bench, gap, before(*PLACES[0]), 0)
    newtons = (force - calibration.hammer_offset) * calibration.newtons_per_count
    np.testing.assert_allclose(newtons, truth.force, atol=6 * calibration.newtons_per_count)
    spectrum = np.fft.rfft((pressure - calibration.microphone_offset) * calibration.pascals_per_count)
    frequencies = np.fft.rfftfreq(len(pressure), 1 / RATE)
    loud = (frequencies > 800) & (frequencies < 1000)
    late = np.angle(np.vdot(np.fft.rfft(truth.pressure)[loud], spectrum[loud]))
    assert late == pytest.approx(2 * np.pi * 900 * 0.5 / RATE, rel=0.1)
