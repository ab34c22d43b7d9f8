"""Session, explorer, answer and report read each step once, solve each answer once; pages share one form."""

import re
import subprocess
import sys
from collections import Counter
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

import pytest

from experiments.contact_localization.posterior import policy
from experiments.scale_estimation.answer import ScaleAnswering
from experiments.shape_reconstruction import answer as shape_answer
from experiments.shape_reconstruction.explore import explorer
from experiments.shape_reconstruction.methods import QUICK
from harness.bench.scene import SceneFile, scene_from_json
from harness.bench.station_file import Station
from harness.effects.accuracy import Accuracy, Setting
from harness.experiment.answer import WrittenAnswer, add_report, write_answer
from harness.experiment.begin import begin
from harness.experiment.experiment import Answering
from harness.experiment.lookup import find_experiment
from harness.experiment.perform import Performed, perform_on_bench
from harness.experiment.report_content import COUNT
from harness.recording import run_folder
from harness.recording.recording import Recording
from harness.recording.run_folder import RunFiles
from harness.recording.session import Quiet
from harness.report.run_page import write_run_page
from harness.sim.optics import inverse
from tests.support.pages import Page

SENSES: Mapping[str, Any] = {"touch": True, "camera": False, "sound": False}
SCENES: Mapping[str, Mapping[str, Any]] = {
    "contact-localization": {"localization": {"contacts": 3, "choose": "active"}, "sensors": SENSES},
    "scale-estimation": {
        "object": {"mesh": "builtin:mug", "scale": "hidden"},
        "scale": {"contacts": 3},
        "sensors": {**SENSES, "camera": True},
    },
    "shape-reconstruction": {
        "shape": {"presses": 3, "choose": "farthest"},
        "sensors": {**SENSES, "camera": True},
    },
}
LEVELS: Mapping[str, Setting] = {"shape-reconstruction": {"shape.method": QUICK}}


@dataclass
class Calls:
    """Counts of inverted pictures and solved answers."""

    pictures: Counter[bytes] = field(default_factory=Counter)
    masks: int = 0
    answers: Counter[object] = field(default_factory=Counter)


@dataclass(frozen=True)
class Whole:
    """A run that was performed, answered and reported."""

    name: str  #: of the experiment.
    run: RunFiles
    calls: Calls
    result: Mapping[str, Any]


def count_calls(monkeypatch: pytest.MonkeyPatch) -> Calls:
    """Count the calls of a function from now on."""
    found = Calls()

    def counted(module: object, name: str, count: Callable[..., None]) -> None:
        inner = vars(module)[name]

        def outer(*arguments: Any, **named: Any) -> Any:
            count(*arguments, **named)
            return inner(*arguments, **named)

        monkeypatch.setattr(module, name, outer)

    def mask(*_: object) -> None:
        found.masks += 1

    def localization(
        contacts: Any, _model: Any, _prior: Any, accuracy: Accuracy, *rest: Any, **_named: Any
    ) -> None:
        if rest[-1]:  # judged: an answer, and not an estimate between contacts
            found.answers[len(contacts), str(accuracy["localization.senses"])] += 1

    counted(inverse, "_invert_one", lambda image, *_: found.pictures.update([image.tobytes()]))
    counted(run_folder, "mask_by_background", mask)
    counted(policy, "locate", localization)
    counted(ScaleAnswering, "answered", lambda *_: found.answers.update(["size"]))
    counted(
        shape_answer,
        "estimated",
        lambda _, seen: found.answers.update([(len(seen.touches), seen.look is None)]),
    )
    counted(
        explorer,
        "estimated",
        lambda _, seen: found.answers.update([("between presses", len(seen.touches))]),
    )
    return found


def scene_of(name: str) -> SceneFile:
    return scene_from_json({"schema": 1, "object": {"mesh": "builtin:mug"}, **SCENES[name]}, "the test")


def accuracy_of(name: str) -> Accuracy:
    return Accuracy.default(find_experiment(name).knobs).with_(LEVELS.get(name, {}))


@pytest.fixture(scope="module", params=SCENES)
def whole(
    request: pytest.FixtureRequest, station: Station, tmp_path_factory: pytest.TempPathFactory
) -> Whole:
    name, folder = str(request.param), tmp_path_factory.mktemp("whole")
    experiment, accuracy = find_experiment(name), accuracy_of(name)
    written = list[WrittenAnswer[Answering, object]]()
    run = RunFiles(begin(experiment, scene_of(name), station, 3, None, folder / "run").recording)

    def conclude(done: Performed) -> None:
        written.append(write_answer(experiment, run, accuracy, folder, done.answering))

    with pytest.MonkeyPatch.context() as monkeypatch:
        calls = count_calls(monkeypatch)
        done = perform_on_bench(experiment, run, Quiet(), accuracy=accuracy, conclude=conclude)
        result = add_report(experiment, written[0], partial(write_run_page, experiment), done.health, folder)
    return Whole(name, run, calls, result)


def test_each_picture_is_inverted_once_and_each_answer_is_solved_once(whole: Whole) -> None:
    run, calls = whole.run, whole.calls
    assert Path(whole.result["report"]).is_file()
    records = run.recording.steps()
    looks = [record for record in records if record.step.kind == "look"]
    pressed = [record for record in records if "gel.image" in record.readings]
    assert len(pressed) >= 2
    recorded = {inverse.mean_picture(run.observe(record).images).tobytes() for record in pressed}
    # Other pictures are those that load the kernels.
    assert Counter({picture: calls.pictures[picture] for picture in recorded}) == Counter(recorded)
    assert calls.masks == len(looks)
    assert calls.answers
    assert set(calls.answers.values()) == {1}


HEADINGS = [
    "Answer", "Readings and estimates", "Agreement with the model", "Bench", "Cost of the answer",
]  # fmt: skip
BENCH = [
    "Instruments", "Calibrations", "Simulated effects", "Differences of the mocked world", "Versions",
]  # fmt: skip
UNITS = {"mm", "mm²", "m/s", "%", COUNT}


def test_pages_of_all_experiments_have_one_form(whole: Whole) -> None:
    page = Page(Path(whole.result["report"]).read_text(encoding="utf-8"))
    assert page.headings["h2"] == HEADINGS
    assert len(page.headings["h3"]) > len(BENCH)
    assert page.headings["h3"][-len(BENCH) :] == BENCH
    rows = [row for row in page.rows["Answer"] if row]
    assert rows
    assert all(quantity and value for quantity, value, *_ in rows)
    assert {unit for _, _, unit, _ in rows} <= UNITS
    for knob in find_experiment(whole.name).knobs:
        assert f"{knob.name} {whole.result['accuracy'][knob.name]}" in page.text


def test_no_page_shows_python_or_lines_of_the_terminal(whole: Whole) -> None:
    text = Page(Path(whole.result["report"]).read_text(encoding="utf-8")).text
    for token in ("[0.", "{'", "array(", "_m ", "<class"):
        assert token not in text
    assert not {"None", "nan", "True", "False"} & set(re.findall(r"\w+", text))
    assert not [line for line in find_experiment(whole.name).lines(whole.result) if line in text]


def test_no_kernel_is_loaded_between_the_first_step_and_the_answer(whole: Whole) -> None:
    folder = str(whole.run.recording.folder)
    script = f"from {__name__} import answer_recording; answer_recording({whole.name!r}, {folder!r})"
    subprocess.run([sys.executable, "-c", script], check=True)


def answer_recording(name: str, folder: str) -> None:
    """Answer a recording in a process of its own; fail if that compiles or loads a kernel."""
    from numba.core.event import install_recorder

    run = RunFiles(Recording(Path(folder)))
    experiment = find_experiment(name)
    answering = experiment.answering(run, accuracy_of(name))
    records = run.recording.steps()
    with install_recorder("numba:compiler_lock") as loads:
        for record in records:
            answering.read(record)
        experiment.estimate(answering)
    assert not loads.buffer, f"{len(loads.buffer)} kernels were loaded"
