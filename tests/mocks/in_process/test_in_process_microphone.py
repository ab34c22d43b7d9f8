"""The sound card in simulated time: what the box would have heard, on another clock and a little late."""

from pathlib import Path

import numpy as np
import pytest

from experiments.contact_localization.plan import plan_contacts
from experiments.contact_localization.section import Localization
from harness.basics.mesh import Mesh
from harness.bench.acquisition import Strike, strike_from_readings
from harness.bench.acquisition_channels import PRESSURE
from harness.bench.device import MICROPHONE, Microphone
from harness.bench.microphone_take import UNSURE, take_of
from harness.bench.named_files import SHIPPED
from harness.bench.scene import SceneFile, load_scene
from harness.bench.station import Bench, RunContext
from harness.bench.station_file import Station, load_station
from harness.effects.scene_object import known_object
from harness.recording.observation import synchronised
from harness.recording.recording import Recording
from harness.recording.run_folder import RunFiles, create_run, station_acquisition, station_calibration
from harness.recording.step_file import Step
from harness.skills.planning import RunPlan
from harness.strikes.peaks import analyse
from mocks.in_process.bench import in_process_bench
from mocks.in_process.microphone import DRIFT_PPM, LATENCY, WANDER
from tests.support.heard_strikes import Readings, delay, performed, strikes_on

SEED, RATE = 5, 48e3


@pytest.fixture(scope="module")
def scene() -> SceneFile:
    read = load_scene(SHIPPED / "scenes" / "mug_both.toml")
    thrice = read.section(Localization).model_copy(update={"contacts": 3})
    return read.with_section(thrice)


@pytest.fixture(scope="module")
def mesh(scene: SceneFile) -> Mesh:
    return known_object(scene).mesh


BOX = load_station(SHIPPED / "stations" / "mock.toml")
CARD = load_station(SHIPPED / "stations" / "mock_sound_card.toml")


@pytest.fixture(scope="module")
def plan(scene: SceneFile, mesh: Mesh) -> RunPlan:
    return plan_contacts(scene, BOX, mesh, 1)


def opened(scene: SceneFile, station: Station, mesh: Mesh, folder: Path) -> Bench:
    return in_process_bench(scene, station, RunContext(folder / "t.json", mesh, SEED, "none"))


@pytest.fixture(scope="module")
def heard(
    scene: SceneFile, mesh: Mesh, plan: RunPlan, tmp_path_factory: pytest.TempPathFactory
) -> dict[str, list[Readings]]:
    folder = tmp_path_factory.mktemp("heard")
    stations = {"box": BOX, "card": CARD}
    return {name: performed(opened(scene, s, mesh, folder), plan) for name, s in stations.items()}


def strikes(heard: dict[str, list[Readings]], name: str) -> list[Strike]:
    return strikes_on(CARD if name == "card" else BOX, heard[name])


def test_it_is_a_microphone_that_listens_on_a_bench_of_its_own_station(
    scene: SceneFile, mesh: Mesh, tmp_path: Path
) -> None:
    bench = opened(scene, CARD, mesh, tmp_path)
    known: Microphone = bench.get(MICROPHONE)
    assert known.health().rate == pytest.approx(RATE * (1 + 1e-6 * DRIFT_PPM))
    assert "microphone" not in opened(scene, BOX, mesh, tmp_path).instruments
    with pytest.raises(NotImplementedError, match=r"InProcessMicrophone\.capture"):
        known.capture(lambda: None, 0.0, 0.1, 1.0)


def test_every_strike_has_force_and_sound_on_one_axis(heard: dict[str, list[Readings]]) -> None:
    for there, here in zip(strikes(heard, "box"), strikes(heard, "card"), strict=True):
        assert here.fault == there.fault == ""
        assert here.rate == pytest.approx(there.rate)
        a, b = (strike.force[strike.onset - 50 :][:2000] for strike in (there, here))
        assert np.abs(a - b).max() < 0.1  # N: another box's noise
        assert len(here.pressure) == len(here.force)


def test_the_sound_is_the_box_s_but_for_one_latency(heard: dict[str, list[Readings]]) -> None:
    """The two clocks wander between strikes; by their sounds the strikes are brought together."""
    there, here = strikes(heard, "box"), strikes(heard, "card")
    together = [strike for strike in synchronised(here) if strike is not None]
    found = [delay(a, b) for a, b in zip(there, here, strict=True)]
    for late, alike in found:
        assert late == pytest.approx(LATENCY, abs=5 * WANDER)
        assert alike > 0.999
    assert np.ptp([late for late, _ in found]) > 20e-6
    placed = [delay(a, b)[0] for a, b in zip(there, together, strict=True) if not b.fault]
    assert len(placed) >= 2
    assert np.ptp(placed) < 8e-6


def test_an_estimate_reads_the_same_shares_of_the_same_peaks(
    heard: dict[str, list[Readings]],
) -> None:
    """The latency turns all strikes' shares of a peak by one angle, which is no part of them."""
    together = [strike for strike in synchronised(strikes(heard, "card")) if strike is not None]
    pairs = [(a, b) for a, b in zip(strikes(heard, "box"), together, strict=True) if not b.fault]
    there, here = (analyse(found).peaks for found in zip(*pairs, strict=True))
    assert len(there) >= 3
    for peak in there:
        nearest = min(here, key=lambda other: abs(other.frequency - peak.frequency))
        # A latency bends the flanks of a broad peak: 1.7 ms turn 90 Hz of it by a radian. Its half width is
        # what two modes that are read as one peak leave open.
        assert nearest.frequency == pytest.approx(peak.frequency, abs=peak.damping / (2.0 * np.pi))
        assert abs(np.vdot(nearest.y, peak.y)) > 0.98


def test_a_silent_bench_is_heard_in_any_stretch_of_time(scene: SceneFile, mesh: Mesh, tmp_path: Path) -> None:
    microphone = opened(scene, CARD, mesh, tmp_path).get(MICROPHONE)
    readings = {reading.channel.name: reading for reading in microphone.record(0.3)}
    counts = readings[PRESSURE].values
    assert counts.size >= 0.3 * RATE
    assert 0 < np.abs(counts).max() < 2**20
    take = take_of(readings)
    assert take is not None
    assert (take.flags, take.fault) == (0, "")
    assert take.uncertainty < UNSURE


def test_a_strike_by_sound_card_is_recorded_whole_and_read_back(
    scene: SceneFile, mesh: Mesh, heard: dict[str, list[Readings]], plan: RunPlan, tmp_path: Path
) -> None:
    recording = create_run(
        tmp_path / "run",
        "contact-localization",
        scene,
        CARD,
        mesh,
        station_calibration(CARD),
        {"contacts": plan.parameters()},
        SEED,
        None,
        station_acquisition(scene, CARD),
    )
    step = Step(0, "press", plan.parameters()[0])
    recording.commit(step, list(heard["card"][0].values()), 1.0)
    again = RunFiles(Recording(tmp_path / "run"))
    (record,) = again.recording.steps()
    assert again.acquisition is not None
    found, wanted = strike_from_readings(record.readings, again.acquisition), strikes(heard, "card")[0]
    np.testing.assert_allclose(found.pressure, wanted.pressure, atol=1e-4)
    assert (found.fault, found.jitter) == ("", wanted.jitter)
    assert again.station.microphone == CARD.microphone
