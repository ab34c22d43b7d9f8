"""A run's strikes heard by a sound card: the driver, unchanged, on a null sink that plays with the box."""

import os
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from experiments.contact_localization.plan import plan_contacts
from experiments.contact_localization.section import Localization
from harness.basics.errors import BenchFault
from harness.basics.mesh import Mesh
from harness.bench.acquisition import Strike
from harness.bench.acquisition_channels import FORCE, PRESSURE
from harness.bench.device import HAMMER, MICROPHONE
from harness.bench.instruments.sound import rest_levels
from harness.bench.microphone_take import BAD, CALLBACK, CLOCK, FLAGS, UNSURE, take_of
from harness.bench.named_files import SHIPPED
from harness.bench.scene import SceneFile, load_scene
from harness.bench.station import RunContext, open_station
from harness.bench.station_file import load_station
from harness.effects.scene_object import known_object
from harness.recording.observation import synchronised
from harness.skills.planning import RunPlan
from mocks.in_process.bench import in_process_bench
from mocks.sound_card.card import why_not
from tests.support.heard_strikes import Readings, delay, performed, strikes_on

pytestmark = [
    pytest.mark.slow,  # the card by itself is in test_sound_card.py
    pytest.mark.skipif(bool(why_not()), reason=why_not() or "a sound card can be mocked here"),
]

BOX = load_station(SHIPPED / "stations" / "mock.toml")
CARD = load_station(SHIPPED / "stations" / "mock_sound_card.toml")
SEED, GAP = 5, "none"


@pytest.fixture(scope="module")
def scene() -> SceneFile:
    read = load_scene(SHIPPED / "scenes" / "mug_both.toml")
    twice = read.section(Localization).model_copy(update={"contacts": 2})
    return read.with_section(twice)


@pytest.fixture(scope="module")
def mesh(scene: SceneFile) -> Mesh:
    return known_object(scene).mesh


@pytest.fixture(scope="module")
def plan(scene: SceneFile, mesh: Mesh) -> RunPlan:
    """Two places whose sounds only one delay explains: of a round body many pairs are refused for less."""
    return plan_contacts(scene, CARD, mesh, 6)


@pytest.fixture(scope="module")
def wired(
    scene: SceneFile, mesh: Mesh, plan: RunPlan, tmp_path_factory: pytest.TempPathFactory
) -> dict[str, Any]:
    """Two contacts over the wires, a moment in which nothing is struck, then the card is taken away."""
    folder = tmp_path_factory.mktemp("card")
    with open_station(CARD, scene, RunContext(folder / "wire.json", mesh, SEED, GAP)) as bench:
        contacts, calibration = performed(bench, plan), bench.station.require_hammer()[0].acquisition
        found = {
            "contacts": contacts,
            "levels": rest_levels(bench.get(HAMMER), bench.get(MICROPHONE), calibration),
            "health": bench.get(MICROPHONE).health(),
        }
        assert bench.lab is not None
        bench.lab.fault("microphone", "unplug")
        with pytest.raises(BenchFault) as gone:
            rest_levels(bench.get(HAMMER), bench.get(MICROPHONE), calibration)
        return {**found, "gone": str(gone.value)}


@pytest.fixture(scope="module")
def by_box(
    scene: SceneFile, mesh: Mesh, plan: RunPlan, tmp_path_factory: pytest.TempPathFactory
) -> list[Strike]:
    """The same contacts in process, heard by the hammer's box."""
    context = RunContext(tmp_path_factory.mktemp("box") / "t.json", mesh, SEED, GAP)
    return strikes_on(BOX, performed(in_process_bench(scene, BOX, context), plan))


def whole(contacts: list[Readings]) -> list[Readings]:
    """Those that a busy computer did not spoil; it said so of the others."""
    takes = [take_of(readings) for readings in contacts]
    assert None not in takes
    return [r for r, take in zip(contacts, takes, strict=True) if take is not None and not take.flags & BAD]


def test_every_contact_has_the_force_of_the_box_and_the_sound_of_the_card(wired: dict[str, Any]) -> None:
    for readings in wired["contacts"]:
        assert {FORCE, PRESSURE, FLAGS, CALLBACK, CLOCK} <= set(readings)
        assert readings[PRESSURE].channel.nominal_rate == 48e3
        assert readings[FORCE].channel.nominal_rate == 50e3


def test_force_and_sound_are_of_one_strike_on_one_axis(wired: dict[str, Any], by_box: list[Strike]) -> None:
    """The latency is one for all strikes of a stream, and small; the sound is the world's."""
    contacts = whole(wired["contacts"])
    if len(contacts) < 2:
        pytest.skip("the computer was too busy for a whole take, and the takes say so")
    strikes = strikes_on(CARD, contacts)
    found = [delay(there, here) for there, here in zip(by_box, strikes, strict=True)]
    for strike, (late, alike) in zip(strikes, found, strict=True):
        assert strike.fault == ""
        assert strike.jitter < UNSURE
        assert abs(late) < 1e-3
        assert alike > 0.99  # the press came to rest a little elsewhere
    together = [strike for strike in synchronised(strikes) if strike is not None]
    assert [strike.fault for strike in together] == ["", ""]
    found = [delay(there, here) for there, here in zip(by_box, together, strict=True)]
    assert found[0][0] == pytest.approx(found[1][0], abs=8e-6)


def test_it_says_how_it_does_and_how_loud_it_is_at_rest(wired: dict[str, Any]) -> None:
    health, levels = wired["health"], wired["levels"]
    assert health.rate == pytest.approx(48e3, rel=1e-4)
    assert "mock_microphone mock-378B02 by PortAudio" in health.identity
    assert 0.0 < levels.pressure_rms_pa < 0.01
    assert np.isfinite(levels.sound_level_db)


def test_a_card_taken_away_is_named(wired: dict[str, Any]) -> None:
    assert "0.5 s" in wired["gone"]


def test_the_environment_is_as_before_when_the_bench_is_closed(wired: dict[str, Any]) -> None:
    assert "ALSA_CONFIG_PATH" not in os.environ


def test_without_pipewire_the_lab_s_reason_reaches_the_operator(
    scene: SceneFile, mesh: Mesh, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:

    monkeypatch.setenv("PATH", str(tmp_path))  # no pipewire there
    context = RunContext(tmp_path / "t.json", mesh, SEED, GAP)
    with (
        pytest.raises(BenchFault, match=r"pipewire.*apt-get install"),
        open_station(CARD, scene, context),
    ):
        pytest.fail("the bench was opened")
