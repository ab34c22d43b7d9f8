"""Strikes that failed are left out and said so; an object that sounds like another one is refused."""

import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
import pytest

from experiments.contact_localization.build_model import model_of_scene
from experiments.contact_localization.model import Model, Prior
from experiments.contact_localization.plan import plan_contacts
from experiments.contact_localization.posterior.estimate import Estimate, Senses
from experiments.contact_localization.posterior.policy import Readings, estimate_contacts
from experiments.contact_localization.posterior.strike_consistency import doubts_of_sound
from harness.basics.arrays import FloatArray
from harness.basics.errors import DataRefused, FitRefused
from harness.bench.acquisition import Strike
from harness.bench.gap import gap_path
from harness.bench.scene import SceneFile, scene_from_json
from harness.bench.station import RunContext
from harness.bench.station_file import Station, load_station, station_path
from harness.effects.scene_object import known_object
from harness.recording.observation import Observation, observe_step
from harness.recording.run_folder import station_acquisition, station_calibration
from harness.recording.step_file import Step, StepRecord
from harness.sim.optics.inverse import GelReader, GelReading
from harness.skills.planning import RunPlan
from harness.skills.press import PressPerformer
from harness.twin.bench_of import way_between
from mocks.in_process.bench import in_process_bench
from tests.support.localization import dials

SEED, CONTACTS = 1, 6

HARMED = {"silent": 1, "saturated": 2, "double": 3}
"""Contact, from 0, at which a strike of the harmed bench fails, by how."""

HEARD: tuple[Senses, ...] = ("audio", "both")


@dataclass(frozen=True, eq=False)
class Run:
    """One run of the mug with the default gap."""

    good: tuple[Observation, ...]  #: its contacts.
    harmed: tuple[Observation, ...]  #: the first four of them again, three of the strikes having failed.
    model: Model  #: of the mug.
    prior: Prior  #: its yaw known.
    true: FloatArray  #: ``(3,)`` metres, the last contact.
    gels: dict[int, GelReading] = field(default_factory=dict)  #: the gel in pictures, each read once.

    def gel(self, observation: Observation) -> GelReading:
        """Read the gel at a contact; changes of its strike leave its pictures as they are."""
        key = id(observation.images)
        if key not in self.gels:
            self.gels[key] = GelReader(self.model.calibration).read(observation.images)
        return self.gels[key]

    def error(self, found: Estimate) -> float:
        """Metres."""
        return float(np.linalg.norm(found.position_in_object - self.true))


def scene_of(name: str) -> SceneFile:
    tree = {
        "schema": 1,
        "object": {"mesh": f"builtin:{name}", "material": "ceramic"},
        "sensors": {"sound": True},
        "localization": {"contacts": CONTACTS, "spacing": "close"},
    }
    return scene_from_json(tree, "the test")


def performed(
    scene: SceneFile, station: Station, plan: RunPlan, truth: Path, gap: str, steps: int
) -> tuple[Observation, ...]:
    """The first contacts of a plan, on the bench in process."""
    mesh, acquisition = known_object(scene).mesh, station_acquisition(scene, station)
    experiment = PressPerformer(lambda here, planned: way_between(plan.bench, here, planned))
    bench = in_process_bench(scene, station, RunContext(truth, mesh, SEED, gap))
    observations = []
    for index, parameters in enumerate(plan.parameters()[:steps]):
        step = Step(index, "press", parameters)
        readings = {reading.channel.name: reading for reading in experiment.perform(step, bench)}
        record = StepRecord(step, readings, 0.0)
        observations.append(observe_step(record, station.flange_from_gel, acquisition))
    return tuple(observations)


def model_of(name: str, station: Station) -> Model:
    scene = scene_of(name)
    return model_of_scene(scene, station, known_object(scene).mesh, station_calibration(station))


@pytest.fixture(scope="module")
def station() -> Station:
    return load_station(station_path("mock"))


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory, station: Station) -> Run:
    folder, scene = tmp_path_factory.mktemp("struck"), scene_of("mug")
    failing = gap_path("default").read_text() + "".join(
        f"{how}_strikes = [{contact}]\n" for how, contact in HARMED.items()
    )
    (folder / "failing.toml").write_text(failing)
    mesh = known_object(scene).mesh
    plan = plan_contacts(scene, station, mesh, SEED)
    good = performed(scene, station, plan, folder / "good.json", "default", CONTACTS)
    harmed = performed(scene, station, plan, folder / "harmed.json", str(folder / "failing.toml"), 4)
    contacts = json.loads((folder / "good.json").read_text())["contacts"]
    prior = Prior(scene.base_from_object(mesh)[:3, :3])
    return Run(good, harmed, model_of("mug", station), prior, np.array(contacts[-1]["point_in_object_m"]))


@pytest.fixture(scope="module")
def whole(run: Run) -> dict[Senses, Estimate]:
    """The answers to the run as it went."""
    return {senses: by(senses, run.good, run) for senses in HEARD}


@pytest.fixture(scope="module")
def bowl(station: Station) -> Model:
    return model_of("bowl", station)


def by(senses: Senses, observations: Sequence[Observation], run: Run, model: Model | None = None) -> Estimate:
    gels = tuple(run.gel(observation) for observation in observations)
    readings = Readings(tuple(observations), gels, model or run.model, run.prior, SEED)
    return estimate_contacts(readings, dials(senses=senses))[-1]


def with_strikes(run: Run, change: Callable[[int, Strike], Strike | None]) -> tuple[Observation, ...]:
    """The run with some of its strikes changed, or taken away."""
    return tuple(replace(one, strike=change(k, strike_of(one))) for k, one in enumerate(run.good))


def strike_of(observation: Observation) -> Strike:
    assert observation.strike is not None
    return observation.strike


def silenced(_: int, strike: Strike) -> Strike:
    """What the box reads of a striker that reaches nothing: its own noise."""
    noise = np.random.default_rng(3).standard_normal((2, len(strike.force)))
    before = slice(0, strike.onset // 2)
    force, pressure = strike.force[before].std() * noise[0], strike.pressure[before].std() * noise[1]
    return replace(strike, force=force, pressure=pressure, onset=0, silent=True)


def radius99(found: Estimate) -> float:
    """Metres, of 99 answers in a hundred, of a Gaussian on a surface: one in ten is beyond ``credible90``.

    A region of nine tenths misses one true place in ten as well: what one run of a seed is held to, on any
    machine, is this; how many regions hold their place is counted by
    ``touchstone tables contact-localization``.
    """
    return float(np.sqrt(2.0) * found.credible90)


def assert_says_how_sure_it_is(found: Estimate, whole: Estimate, run: Run) -> None:
    """A strike less moves the answer by no more than it says it may, and by a few millimetres at most."""
    moved = float(np.linalg.norm(found.position_in_object - whole.position_in_object))
    assert moved < radius99(found)
    assert moved < 6e-3
    assert run.error(found) < radius99(found)


def assert_nothing_was_heard(
    observations: Sequence[Observation], run: Run, whole: dict[Senses, Estimate]
) -> None:
    """Sound alone is as wide as the places leave it, and adds nothing to touch."""
    alone = by("audio", observations, run)
    assert alone.region.contains(run.true)
    assert alone.credible90 > 2.0 * whole["audio"].credible90
    both, touched = by("both", observations, run), by("touch", observations, run)
    np.testing.assert_array_equal(both.position_in_object, touched.position_in_object)
    np.testing.assert_array_equal(both.region.inside, touched.region.inside)
    assert both.region.contains(run.true)


def test_the_run_itself_is_answered(run: Run, whole: dict[Senses, Estimate]) -> None:
    assert run.error(whole["both"]) < 4e-3
    assert run.error(whole["audio"]) < 10e-3
    assert doubts_of_sound(run.good) == ()


@pytest.mark.parametrize(
    ("how", "reason"),
    [("silent", "no strike came"), ("saturated", "overloaded"), ("double", "hit twice")],
)
def test_a_strike_that_failed_is_left_out_and_said(
    how: str, reason: str, run: Run, whole: dict[Senses, Estimate]
) -> None:
    contact = HARMED[how]
    observations = (*run.good[:contact], run.harmed[contact], *run.good[contact + 1 :])
    strike = strike_of(run.harmed[contact])
    assert (strike.silent, strike.overload, strike.double_hit) == tuple(how == one for one in HARMED)
    (doubt,) = doubts_of_sound(observations)
    assert f"contact {contact + 1}" in doubt
    assert reason in doubt
    assert_says_how_sure_it_is(by("both", observations, run), whole["both"], run)
    assert_says_how_sure_it_is(by("audio", observations, run), whole["audio"], run)


def test_a_strike_that_was_never_made_is_left_out_and_said(run: Run, whole: dict[Senses, Estimate]) -> None:
    observations = with_strikes(run, lambda k, strike: None if k == 2 else strike)
    (doubt,) = doubts_of_sound(observations)
    assert "contact 3 " in doubt
    assert_says_how_sure_it_is(by("both", observations, run), whole["both"], run)


def test_strikes_that_are_all_silent_say_nothing(run: Run, whole: dict[Senses, Estimate]) -> None:
    observations = with_strikes(run, silenced)
    (doubt,) = doubts_of_sound(observations)
    assert "0 of 6 strikes" in doubt
    assert_nothing_was_heard(observations, run, whole)


def test_one_strike_alone_says_nothing(run: Run) -> None:
    observations = with_strikes(run, lambda k, strike: strike if k == 0 else silenced(k, strike))
    (doubt,) = doubts_of_sound(observations)
    assert "1 of 6 strikes" in doubt
    assert by("audio", observations, run).region.contains(run.true)


def test_noise_in_place_of_sound_says_nothing(run: Run, whole: dict[Senses, Estimate]) -> None:
    random = np.random.default_rng(5)

    def noisy(_: int, strike: Strike) -> Strike:
        return replace(strike, pressure=strike.pressure.std() * random.standard_normal(len(strike.pressure)))

    observations = with_strikes(run, noisy)
    (doubt,) = doubts_of_sound(observations)
    assert "resonance" in doubt
    assert_nothing_was_heard(observations, run, whole)


@pytest.mark.parametrize("senses", [pytest.param("audio", marks=pytest.mark.slow), "both"])
def test_another_object_is_refused(senses: Senses, run: Run, bowl: Model) -> None:
    with pytest.raises(FitRefused, match=r"contact \d"):
        by(senses, run.good, run, bowl)


def raised(_: int, strike: Strike) -> Strike:
    """The same strike of an object of the same shape and another material: every frequency 1.3 times."""
    samples = np.arange(len(strike.pressure), dtype=np.float64)
    since = samples - strike.onset
    return replace(strike, pressure=np.interp(strike.onset + 1.3 * since, samples, strike.pressure))


def test_where_the_images_fit_and_the_sound_does_not_the_answer_warns(
    run: Run, whole: dict[Senses, Estimate]
) -> None:
    found = by("both", with_strikes(run, raised), run)
    (doubt,) = found.doubts
    assert "material" in doubt
    assert whole["both"].doubts == ()
    # Never a confident wrong number: what false sound moves, it makes as unsure. How far it is off and its
    # radius of 90 % are both 30 mm here: which is the larger depends on the processor's rounding.
    assert found.region.contains(run.true)
    assert np.linalg.norm(found.position_in_object - run.true) < 1.25 * found.credible90


def test_another_object_of_which_nothing_is_heard_is_refused(run: Run, bowl: Model) -> None:
    with pytest.raises(FitRefused, match=r"nats.*contact \d"):
        by("audio", with_strikes(run, silenced), run, bowl)


def test_contacts_all_at_one_place_are_one_witness(run: Run) -> None:
    """Touch alone may still know the place; sound then adds nothing and says so."""
    observations = [run.good[-1]] * CONTACTS
    (doubt,) = doubts_of_sound(observations)
    assert "1 of 6 strikes" in doubt
    assert "contact 1 " in doubt
    alone = by("audio", observations, run)
    assert alone.region.contains(run.true)
    assert alone.credible90 > 20e-3
    both, touched = by("both", observations, run), by("touch", observations, run)
    np.testing.assert_array_equal(both.position_in_object, touched.position_in_object)
    assert both.region.contains(run.true)


@pytest.mark.parametrize("channel", ["force", "pressure"])
@pytest.mark.parametrize("senses", HEARD)
def test_a_signal_that_is_not_finite_is_refused(senses: Senses, channel: str, run: Run) -> None:
    def spoiled(k: int, strike: Strike) -> Strike:
        if k != 1:
            return strike
        force, pressure = strike.force.copy(), strike.pressure.copy()
        (force if channel == "force" else pressure)[strike.onset + 5] = np.nan
        return replace(strike, force=force, pressure=pressure)

    with pytest.raises(DataRefused, match="finite"):
        by(senses, with_strikes(run, spoiled), run)


@pytest.mark.parametrize("senses", HEARD)
def test_the_gain_of_the_microphone_does_not_matter(
    senses: Senses, run: Run, whole: dict[Senses, Estimate]
) -> None:
    louder = with_strikes(run, lambda _, strike: replace(strike, pressure=1000.0 * strike.pressure))
    found = by(senses, louder, run)
    np.testing.assert_allclose(found.position_in_object, whole[senses].position_in_object, atol=1e-6)
    assert found.credible90 == pytest.approx(whole[senses].credible90, rel=1e-6)
