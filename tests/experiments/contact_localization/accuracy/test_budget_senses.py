"""Answers in time or to an error where senses cost differently: images are read only where looked at."""

from dataclasses import replace

import numpy as np
import pytest

from experiments.contact_localization.accuracy.run import ContactRun
from experiments.contact_localization.answer import Models, solve
from experiments.contact_localization.model import Model, Prior
from experiments.contact_localization.posterior.estimate import SENSES, SPACING, needs_images
from experiments.contact_localization.posterior.policy import read
from experiments.contact_localization.settings import (
    needs_sound,
    setting_name,
)
from harness.basics.errors import WrongUse
from harness.basics.geometry import frame_facing, transform
from harness.basics.materials import Material
from harness.bench.sensor import GELSIGHT_R15
from harness.cost.curve import Point, Sample
from harness.effects.accuracy import Accuracy, Setting
from harness.experiment.budget import ask
from harness.experiment.front import Front
from harness.experiment.solving import Target
from harness.recording.observation import Observation
from harness.sim.optics.inverse import GelReader
from harness.sim.optics.tactile_calibration import shipped_calibration
from tests.samples import sounding_plate as plate

K = 5
AUDIO: Setting = {SENSES.name: "audio", "localization.method": "grid", SPACING.name: 3e-3}
TOUCH: Setting = {
    SENSES.name: "touch",
    "localization.method": "grid",
    SPACING.name: 4e-3,
    "localization.rounds": 0,
    "localization.samples": 600,
}
MODES = plate.plate_modes()
MODEL = Model(
    plate.box(plate.LENGTH, plate.WIDTH, plate.THICKNESS),
    GELSIGHT_R15,
    shipped_calibration("gelsight_r15_bench"),
    MODES,
    Material("as the strikes are made", 2500.0, 6e10, 0.2, alpha=50.0, beta=0.0),
)


def never(*_: object) -> None:
    raise AssertionError("an image was read")


@pytest.fixture(scope="module")
def observations() -> tuple[Observation, ...]:
    """A plate struck at five places, its images blank."""
    rng = np.random.default_rng(4)
    points = plate.places(K, rng)
    down = frame_facing(np.array([0.0, 0.0, -1.0]), 0.0)
    blank = np.full((1, GELSIGHT_R15.rows, GELSIGHT_R15.columns, 3), 128, dtype=np.uint8)
    poses = [transform(down, point - [0.0, 0.0, 1e-3]) for point in points]
    strikes = plate.strikes(MODES, points, rng)
    return tuple(Observation(pose, blank, strike) for pose, strike in zip(poses, strikes, strict=True))


@pytest.fixture
def run(observations: tuple[Observation, ...]) -> ContactRun:
    reader = GelReader(MODEL.calibration)
    return ContactRun(observations, reader, Models(lambda _: MODEL), Prior(np.eye(3)), 0, "plate", {})


def front(audio_seconds: float, touch_seconds: float, audio_error: float = 2e-3) -> Front:
    """Touch is the better and, it says, of such seconds."""

    def point(setting: Setting, cpu: float, error: float) -> Point:
        shared = 0.05 if needs_images(setting) else 0.0
        samples = tuple(
            Sample(f"r{k}", "plate", error, 0.5, shared, cpu * (1.0 + 1e-3 * k), cpu) for k in range(40)
        )
        return Point(setting_name(setting), setting, {"contacts": K}, samples)

    points = (point(TOUCH, touch_seconds, 1e-3), point(AUDIO, audio_seconds, audio_error))
    return Front(points, 1.0, K, (), "", shipped=False)


def test_a_budget_that_only_sound_keeps_reads_no_image(
    run: ContactRun, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(GelReader, "read", never)
    found = ask(run, front(0.01, 1e4), Target(seconds=60.0))
    assert found.point.levels == AUDIO
    assert found.kept
    assert found.solved.found is not None


def test_an_error_that_sound_promises_first_reads_no_image(
    run: ContactRun, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(GelReader, "read", never)
    found = ask(run, front(0.01, 1e4), Target(error=5e-3))
    assert found.tried == (setting_name(AUDIO),)
    assert found.kept
    assert found.promise == 2e-3


def test_where_sound_promises_too_little_touch_is_tried_and_reads_the_images(run: ContactRun) -> None:
    found = ask(run, front(0.01, 1.0, audio_error=9e-3), Target(error=5e-3))
    assert found.tried == (setting_name(TOUCH),)
    assert not found.kept  # blank images are refused, and a refusal promises nothing
    assert found.solved.refusal is not None


def test_settings_that_need_sound_are_left_out_where_nothing_was_heard(run: ContactRun) -> None:
    unheard = replace(run, observations=tuple(replace(one, strike=None) for one in run.observations))
    both = front(0.01, 1.0)
    assert [point.levels for point in both.fitting(unheard.explain_refusal).points] == [TOUCH]
    assert both.fitting(run.explain_refusal).points == both.points
    with pytest.raises(WrongUse, match="contact-localization --sense touch"):
        replace(both, points=both.points[1:]).fitting(unheard.explain_refusal)


def test_sound_is_answered_the_same_whether_images_were_read_or_not(run: ContactRun) -> None:
    without = run.solve(AUDIO)
    with_images = solve(read(run.observations, run.reader, MODEL, run.prior, 0), AUDIO)
    assert with_images.found is not None
    assert without.found is not None
    np.testing.assert_array_equal(with_images.found.position_in_object, without.found.position_in_object)


def test_each_choice_of_the_modes_is_made_once_and_touch_takes_the_default() -> None:
    asked: list[Accuracy] = []

    def make(accuracy: Accuracy) -> Model:
        asked.append(accuracy)
        return MODEL

    models = Models(make)
    for _ in range(2):
        models.at({**AUDIO, "sound.modes": 32})
        models.at(AUDIO)
        models.at({**TOUCH, "sound.modes": 16})
    assert [accuracy["sound.modes"] for accuracy in asked] == [32, 128]
    assert len(models.all()) == 2
    assert not needs_sound(TOUCH)
