"""An answer is written and told before it is compared and drawn, and while the bench is still open."""

import json
from pathlib import Path
from typing import Any

import pytest

from experiments.contact_localization.answer import ContactAnswering
from experiments.contact_localization.experiment import EXPERIMENT
from harness.experiment import perform
from harness.experiment.answer import RESULT, finish
from harness.recording.recording import Recording
from harness.recording.run_folder import RunFiles
from harness.recording.session import Quiet
from mocks.in_process.bench import in_process_bench
from tests.support.localization import chosen
from tests.support.whole_run import copied


def test_the_result_is_written_and_told_before_anything_is_drawn(
    done: Recording, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    happened: list[str] = []
    written: dict[str, Any] = {}

    def compared(*_: Any) -> Any:
        written.update(json.loads((tmp_path / RESULT).read_text()))
        happened.append("compared")
        raise RuntimeError("drawn no further")

    monkeypatch.setattr("harness.experiment.answer.compare", compared)
    with pytest.raises(RuntimeError, match="no further"):
        finish(
            EXPERIMENT,
            RunFiles(done),
            chosen([]),
            lambda *_: tmp_path,
            folder=tmp_path,
            publish=lambda _: happened.append("told"),
        )
    assert happened == ["told", "compared"]
    assert written["estimates"]["touch"]["position_m"]
    assert written["report"] is None


def test_a_run_is_concluded_while_its_bench_is_open(
    done: Recording, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    run = copied(done, tmp_path / "run")
    (run.folder / "steps" / "002.mcap").unlink()
    is_open: list[bool] = []

    class Opened:
        def __init__(self, station: Any, scene: Any, context: Any) -> None:
            self._bench = in_process_bench(scene, station, context)

        def __enter__(self) -> Any:
            is_open.append(True)
            return self._bench

        def __exit__(self, *_: object) -> None:
            is_open.append(False)

    monkeypatch.setattr(perform, "open_station", Opened)
    seen: list[tuple[bool, bool]] = []
    performed = perform.perform_on_bench(
        EXPERIMENT,
        RunFiles(Recording(run.folder)),
        Quiet(),
        accuracy=chosen([]),
        conclude=lambda made: seen.append((made.complete, is_open[-1])),
    )
    assert seen == [(True, True)]
    assert isinstance(performed.answering, ContactAnswering)
    assert len(EXPERIMENT.estimate(performed.answering).readings.observations) == 3
