"""Readings that no place on the object explains are refused; one bad contact is named and costs little."""

from collections.abc import Sequence

import numpy as np
import pytest

from experiments.contact_localization.answer import observe, prior_of
from experiments.contact_localization.model import Model, Prior
from experiments.contact_localization.posterior.estimate import Estimate
from harness.basics.arrays import FloatArray
from harness.basics.errors import FitRefused, WrongUse
from harness.basics.mesh import Mesh
from harness.experiment.truth import read_truth
from harness.objects.household import build
from harness.recording.observation import Observation
from harness.recording.run_folder import RunFiles
from tests.support.localization import estimate
from tests.support.whole_run import in_process_run, touch_scene

CONTACTS = 6


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> tuple[RunFiles, FloatArray]:
    """Six spread contacts on the mug with the default gap, and the last true one."""
    scene = touch_scene(contacts=CONTACTS)
    recording = in_process_run(tmp_path_factory.mktemp("hard") / "mug", scene, seed=11)
    truth = read_truth(recording)
    assert truth is not None
    return RunFiles(recording), truth.points[CONTACTS - 1]


@pytest.fixture(scope="module")
def observations(run: tuple[RunFiles, FloatArray]) -> tuple[Observation, ...]:
    return observe(run[0])


@pytest.fixture(scope="module")
def model(run: tuple[RunFiles, FloatArray]) -> Model:
    return model_of(run[0], run[0].mesh)


@pytest.fixture(scope="module")
def prior(run: tuple[RunFiles, FloatArray]) -> Prior:
    return prior_of(run[0])


@pytest.fixture(scope="module")
def good(observations: tuple[Observation, ...], model: Model, prior: Prior) -> Estimate:
    return estimate(observations, model, prior)


def model_of(run: RunFiles, mesh: Mesh) -> Model:
    return Model(mesh, run.station.gel.sensor, run.calibration)


def with_contact(
    observations: Sequence[Observation], index: int, changed: Observation
) -> tuple[Observation, ...]:
    return (*observations[:index], changed, *observations[index + 1 :])


def moved(observation: Observation, by: FloatArray) -> Observation:
    pose = observation.base_from_gel.copy()
    pose[:3, 3] += by
    return Observation(pose, observation.images)


def error(found: Estimate, run: tuple[RunFiles, FloatArray]) -> float:
    return float(np.linalg.norm(found.position_in_object - run[1]))


def test_the_run_itself_is_answered(good: Estimate, run: tuple[RunFiles, FloatArray]) -> None:
    assert error(good, run) < 5e-3
    assert not any(gate.missed or gate.slipped or gate.repeats is not None for gate in good.gates)


def test_the_answer_lies_on_the_surface(good: Estimate, model: Model) -> None:
    points, faces = model.mesh.vertices, model.mesh.faces
    normals = model.mesh.face_normals
    planes = np.abs(np.einsum("ij,ij->i", good.position_in_object - points[faces[:, 0]], normals))
    assert planes.min() < 1e-9


def test_another_object_is_refused_naming_the_worst_contact(
    observations: tuple[Observation, ...], run: tuple[RunFiles, FloatArray], prior: Prior
) -> None:
    with pytest.raises(FitRefused, match=r"contact \d"):
        estimate(observations, model_of(run[0], build("plate")), prior)


def test_mirrored_images_are_refused(
    observations: tuple[Observation, ...], model: Model, prior: Prior
) -> None:
    flipped = [Observation(o.base_from_gel, np.ascontiguousarray(o.images[:, :, ::-1])) for o in observations]
    with pytest.raises(FitRefused, match="mirrored"):
        estimate(flipped, model, prior)


def test_inverted_normals_are_refused(
    observations: tuple[Observation, ...], run: tuple[RunFiles, FloatArray], prior: Prior
) -> None:
    mesh = run[0].mesh
    inverted = Mesh(mesh.vertices, mesh.faces[:, ::-1])
    with pytest.raises(FitRefused):
        estimate(observations, model_of(run[0], inverted), prior)


def test_a_missed_contact_is_named_and_costs_little(
    observations: tuple[Observation, ...], run: tuple[RunFiles, FloatArray], model: Model, prior: Prior
) -> None:
    nothing = np.repeat(run[0].calibration.background[None], len(observations[2].images), axis=0)
    missed = with_contact(observations, 2, Observation(observations[2].base_from_gel, nothing))
    found = estimate(missed, model, prior)
    assert [gate.missed for gate in found.gates] == [index == 2 for index in range(CONTACTS)]
    assert error(found, run) < 5e-3


def test_a_slipped_contact_is_named_and_costs_little(
    observations: tuple[Observation, ...], run: tuple[RunFiles, FloatArray], model: Model, prior: Prior
) -> None:
    # The second contact is at an edge: on the plain wall a slip along it cannot be felt at all.
    across = observations[1].base_from_gel[:3, 0]
    found = estimate(with_contact(observations, 1, moved(observations[1], 6e-3 * across)), model, prior)
    assert [gate.slipped for gate in found.gates] == [index == 1 for index in range(CONTACTS)]
    assert error(found, run) < 6e-3


def test_a_repeated_contact_is_named(
    observations: tuple[Observation, ...], model: Model, prior: Prior, run: tuple[RunFiles, FloatArray]
) -> None:
    found = estimate((*observations[:-1], observations[0], observations[-1]), model, prior)
    assert found.gates[CONTACTS - 1].repeats == 0
    assert error(found, run) < 5e-3


def test_no_contact_at_all_is_wrong_use(model: Model, prior: Prior) -> None:
    with pytest.raises(WrongUse, match="contact"):
        estimate([], model, prior)


def test_a_run_that_never_touched_is_refused(
    observations: tuple[Observation, ...], run: tuple[RunFiles, FloatArray], model: Model, prior: Prior
) -> None:
    background = run[0].calibration.background
    blank = [Observation(o.base_from_gel, np.repeat(background[None], 3, axis=0)) for o in observations]
    with pytest.raises(FitRefused, match="background"):
        estimate(blank, model, prior)


def test_a_first_contact_that_missed_does_not_stop_the_others(
    observations: tuple[Observation, ...], run: tuple[RunFiles, FloatArray], model: Model, prior: Prior
) -> None:
    background = run[0].calibration.background
    blank = Observation(observations[0].base_from_gel, np.repeat(background[None], 3, axis=0))
    found = estimate(with_contact(observations, 0, blank), model, prior)
    assert found.gates[0].missed
    assert error(found, run) < 5e-3
