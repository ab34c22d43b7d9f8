"""What is written of an answer: JSON whatever the contacts did, scores only against a truth."""

import json
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from experiments.contact_localization.answer import Answer, ScoredContact
from experiments.contact_localization.experiment import EXPERIMENT
from experiments.contact_localization.model import Model, Prior
from experiments.contact_localization.posterior.consistency import Gate
from experiments.contact_localization.posterior.estimate import Estimate, locate
from experiments.contact_localization.posterior.likelihood import Noise
from experiments.contact_localization.posterior.policy import Readings
from experiments.contact_localization.report.result import estimate_of, flags_of
from experiments.contact_localization.settings import KNOBS
from experiments.contact_localization.touch.touch import Contact
from harness.basics.errors import RecordingDamaged
from harness.basics.geometry import translation
from harness.basics.symmetry import SymmetryGroup, find_symmetries
from harness.effects.accuracy import Accuracy
from harness.experiment.answer import levels_of_result
from harness.experiment.experiment import Scored
from harness.experiment.truth import Truth, read_truth
from harness.recording.observation import Observation
from harness.recording.recording import Recording
from harness.recording.truth_file import write_truth_file
from harness.sim.optics.inverse import GelReading
from tests.samples.synthetic_press import PRESSES
from tests.support.localization import chosen, dials

QUICK = dials(spacing=3e-3, rounds=1, samples=300)
TRUE = {k: np.array(press.point) for k, press in enumerate(PRESSES)}


@pytest.fixture(scope="module")
def symmetry(block: Model) -> SymmetryGroup:
    return find_symmetries(block.mesh)


def answered(contacts: tuple[Contact, ...], block: Model, prior: Prior) -> Answer:
    last: Estimate = locate(contacts, block, prior, QUICK, Noise())[-1]
    image = np.zeros((1, 120, 160, 3), np.uint8)
    observations = tuple(Observation(c.base_from_gel, image) for c in contacts)
    flat = np.zeros((120, 160))
    gels = tuple(GelReading(flat, flat, "", (0.0, 0.0)) for _ in contacts)
    return Answer(Readings(observations, gels, block, prior, 0), last, 0.1)


@pytest.fixture(scope="module")
def found(contacts: tuple[Contact, ...], block: Model, prior: Prior) -> Answer:
    return answered(contacts, block, prior)


def scored(found: Answer, symmetry: SymmetryGroup, truth: Truth | None) -> ScoredContact:
    """Only what the estimate by touch is made from."""
    nothing = cast(Any, None)
    answering = cast(Any, SimpleNamespace(symmetry=symmetry))
    return Scored(nothing, answering, found, truth, Accuracy.default(KNOBS), ())


def as_written(one: ScoredContact) -> dict[str, Any]:
    return estimate_of(one, one.found.last)


def test_scores_are_distances_to_the_truth(found: Answer, symmetry: SymmetryGroup) -> None:
    written = as_written(scored(found, symmetry, Truth(TRUE, {})))
    errors = np.linalg.norm(found.last.contacts - np.array(list(TRUE.values())), axis=1)
    assert written["error_m"] == pytest.approx(errors[-1])
    assert written["error_mean_m"] == pytest.approx(errors.mean())
    assert [c["error_m"] for c in written["contacts"]] == pytest.approx(errors.tolist())
    top = np.linalg.norm(found.last.candidates - TRUE[len(TRUE) - 1], axis=1).mean()
    assert written["error_top10_m"] == pytest.approx(top)
    assert written["error_symmetric_m"] <= written["error_m"] + 1e-12
    assert written["in_region90"] is True


def test_without_a_truth_or_with_half_of_one_nothing_is_scored(
    found: Answer, symmetry: SymmetryGroup
) -> None:
    """A run that was killed has no truth of its last contacts."""
    half = Truth({k: TRUE[k] for k in (0, 1, 2)}, {})
    for truth in (None, half):
        written = as_written(scored(found, symmetry, truth))
        for key in ("error_m", "error_mean_m", "error_top10_m", "error_symmetric_m", "in_region90"):
            assert written[key] is None
        assert written["position_m"] == found.last.position_in_object.tolist()


def test_a_truth_elsewhere_is_an_error_outside_the_region(found: Answer, symmetry: SymmetryGroup) -> None:
    """The last contact said to have been where the fourth was."""
    wrong = Truth({**TRUE, len(TRUE) - 1: TRUE[3]}, {})
    written = as_written(scored(found, symmetry, wrong))
    assert written["error_m"] == pytest.approx(np.linalg.norm(TRUE[3] - TRUE[5]), abs=1e-3)
    assert written["in_region90"] is False


def test_a_contact_off_the_object_is_written_as_json_and_flagged(
    contacts: tuple[Contact, ...], block: Model, prior: Prior, symmetry: SymmetryGroup
) -> None:
    """It fits nowhere, and JSON has no number for that."""
    away = replace(
        contacts[1], base_from_gel=translation(np.array([0.3, 0.0, 0.0])) @ contacts[1].base_from_gel
    )
    found = answered((contacts[0], away, *contacts[2:]), block, prior)
    written = as_written(scored(found, symmetry, None))
    assert json.loads(json.dumps(written, allow_nan=False)) == written
    assert [bool(c["flags"]) for c in written["contacts"]] == [k == 1 for k in range(len(PRESSES))]
    assert "slipped" in written["contacts"][1]["flags"][0]
    assert written["contacts"][1]["fit_nats"] is None


def test_every_estimate_is_json(found: Answer, symmetry: SymmetryGroup) -> None:
    written = as_written(scored(found, symmetry, Truth(TRUE, {})))
    assert json.loads(json.dumps(written, allow_nan=False)) == written
    shares = [mode["weight"] for mode in written["modes"]]
    assert sum(shares) <= 1.0 + 1e-9
    assert written["seconds"] == pytest.approx(sum(found.last.seconds.values()))


@pytest.mark.parametrize(
    ("gate", "said"),
    [
        (Gate(-1.0, False, False, None), []),
        (Gate(None, True, False, None), ["missed"]),
        (Gate(-40.0, False, True, None), ["slipped"]),
        (Gate(-1.0, False, False, 0), ["repeated: the same place as contact 1"]),
        (Gate(-40.0, False, True, 2), ["slipped", "repeated: the same place as contact 3"]),
    ],
)
def test_flags_are_said_in_words_an_operator_counts_by(gate: Gate, said: list[str]) -> None:
    flags = flags_of(gate)
    assert len(flags) == len(said)
    for flag, beginning in zip(flags, said, strict=True):
        assert flag.startswith(beginning)


def test_a_run_without_a_truth_beside_it_has_none(tmp_path: Path) -> None:
    class Header:
        run_id, seed = "one", 3

    class Bare:
        truth_path, folder, header = tmp_path / "run.truth.json", tmp_path / "run", Header()

    assert read_truth(cast(Recording, Bare())) is None
    contacts = [
        {"step": 0, "point_in_object_m": [1.0, 2.0, 3.0]},
        {"step": 2, "point_in_object_m": [0, 0, 1]},
    ]
    fields = {"schema": 2, "run_id": "one", "seed": 3, "surface_sha256": None}
    write_truth_file(Bare.truth_path, {**fields, "contacts": contacts, "differences": {"mesh_faces": 7}})
    truth = read_truth(cast(Recording, Bare()))
    assert truth is not None
    assert sorted(truth.points) == [0, 2]
    assert truth.points[0].tolist() == [1.0, 2.0, 3.0]
    assert truth.differences == {"mesh_faces": 7}


@pytest.mark.parametrize(
    "written",
    ["", "[]", "{}", '{"accuracy": 3}', '{"accuracy": {"old": 1}}', '{"accuracy": {"touch.gel": "x"}}'],
)
def test_a_result_that_does_not_say_its_levels_is_damaged(tmp_path: Path, written: str) -> None:
    assert levels_of_result(EXPERIMENT, tmp_path) == {}
    (tmp_path / "result.json").write_text(written)
    with pytest.raises(RecordingDamaged, match=r"result\.json.*levels"):
        levels_of_result(EXPERIMENT, tmp_path)


def test_a_result_says_the_levels_it_was_found_at(tmp_path: Path) -> None:
    levels = dict(chosen(["localization.spacing=0.0015", "localization.senses=touch"]))
    (tmp_path / "result.json").write_text(json.dumps({"accuracy": levels}))
    assert levels_of_result(EXPERIMENT, tmp_path) == levels
    earlier = {"sound.radiation": "bound", "camera.look": "onnx"}
    (tmp_path / "result.json").write_text(json.dumps({"accuracy": levels | earlier}))
    assert levels_of_result(EXPERIMENT, tmp_path) == levels | {"camera.look": "network"}
