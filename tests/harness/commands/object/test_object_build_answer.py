"""What ``object build`` says of any part: sentences to look at, and one answer, for people or for scripts."""

import json
import sys
from collections.abc import Callable
from dataclasses import dataclass

import pytest

from harness.commands.object.build import build_and_print


@dataclass(frozen=True)
class Thing:
    said: tuple[str, ...]


def of_steel(report: Callable[[str, float], None]) -> Thing:
    report("casting", 0.5)
    return Thing(("holes were closed", "its [wall] is thin"))


def shown(thing: Thing) -> None:
    sys.stdout.write(f"for people: {len(thing.said)}\n")


@pytest.mark.parametrize("script", [True, False])
def test_notes_go_beside_the_answer_and_the_answer_is_one(
    script: bool, capsys: pytest.CaptureFixture[str]
) -> None:
    assert build_and_print(of_steel, lambda thing: {"said": list(thing.said)}, shown, script) == 0
    out, err = capsys.readouterr()
    assert err.index("holes were closed") < err.index("its [wall] is thin")
    if script:
        assert json.loads(out) == {"said": ["holes were closed", "its [wall] is thin"]}
    else:
        assert out == "for people: 2\n"


def test_progress_is_shown_to_people_and_not_to_scripts(capsys: pytest.CaptureFixture[str]) -> None:
    for script in (False, True):
        build_and_print(of_steel, lambda _: {}, shown, script)
        assert ("casting: 50 %" in capsys.readouterr().err) is not script
