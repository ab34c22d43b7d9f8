"""The one printer of results: notes and progress beside the answer, JSON and text from the same fields."""

import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import pytest

from harness.basics.arrays import FloatArray
from harness.basics.result import HIDDEN, JSON_ONLY, Result, json_value
from harness.commands.output import MAX_ROWS, print_result, share_progress


@dataclass(frozen=True)
class Part:
    file: Path
    size_m: float


@dataclass(frozen=True, eq=False)
class Thing(Result):
    edge_m: float = 0.004
    ratio: float = float("inf")
    part: Part = Part(Path("a.wav"), 0.01)
    frequencies_hz: FloatArray = field(default_factory=lambda: np.arange(1.0, 61.0))
    errors: Mapping[str, Mapping[str, float]] = field(
        default_factory=lambda: {"network": {"median": 0.5}, "table": {"median": 0.25, "p95": 1.0}}
    )
    seconds: Mapping[str, float] = field(default_factory=lambda: {"solve": 1.5})
    notes: tuple[str, ...] = ("holes were closed", "its [wall] is thin")
    listed: tuple[int, ...] = field(default=(1, 2), metadata=JSON_ONLY)
    pixels: FloatArray = field(default_factory=lambda: np.zeros((2, 2)), metadata=HIDDEN)

    def summary(self) -> tuple[str, ...]:
        return ("a thing of [steel]",)


@pytest.mark.parametrize("script", [True, False])
def test_notes_go_beside_the_answer(script: bool, capsys: pytest.CaptureFixture[str]) -> None:
    print_result(Thing(), script)
    out, err = capsys.readouterr()
    assert err.index("holes were closed") < err.index("its [wall] is thin")
    assert "wall" not in out or script


def test_json_has_every_field_but_hidden_ones(capsys: pytest.CaptureFixture[str]) -> None:
    print_result(Thing(), True)
    found = json.loads(capsys.readouterr().out)
    assert list(found) == [
        *("schema", "edge_m", "ratio", "part", "frequencies_hz", "errors", "seconds", "notes", "listed")
    ]
    assert found["part"] == {"file": "a.wav", "size_m": 0.01}
    assert found["ratio"] is None
    assert found["frequencies_hz"][-1] == 60.0
    assert found["listed"] == [1, 2]


def test_text_has_units_tables_and_no_more_rows_than_fit(capsys: pytest.CaptureFixture[str]) -> None:
    print_result(Thing(), False)
    out = capsys.readouterr().out
    lines = {line.split("  ")[0]: line.split("  ")[-1].strip() for line in out.splitlines()}
    assert out.splitlines()[0] == "a thing of [steel]"
    assert lines["edge"] == "4 mm"
    assert lines["part"] == "file a.wav, size 10 mm"
    assert lines["seconds"] == "solve 1.5 s"
    assert "frequencies Hz" in out
    assert f"{60 - MAX_ROWS} more rows" in out
    assert "listed" not in out
    assert [row for row in out.splitlines() if "table" in row and "0.25" in row and "1" in row]


def test_what_has_no_json_is_refused() -> None:
    with pytest.raises(TypeError, match="no JSON for a object"):
        json_value(object())


def test_progress_is_shown_to_people_and_not_to_scripts(capsys: pytest.CaptureFixture[str]) -> None:
    for script in (False, True):
        with share_progress(quiet=script) as report:
            report("casting", 0.5)
        assert ("casting: 50 %" in capsys.readouterr().err) is not script
