"""The command line keeps its promises: fast help, exit codes, one JSON object."""

import json
import os
import re
import subprocess
import sys
from itertools import pairwise
from pathlib import Path

import pytest

from drivers.dataq.link import LinkCut
from harness.basics.answers import answers_alone, write_answer
from harness.basics.errors import TouchstoneError, WrongUse
from harness.cli import COMMANDS, GROUPS, SYSTEM, UNFORESEEN, Interrupted, invoke, load

FORBIDDEN_AT_START = ("torch", "mujoco", "numba", "scipy", "cv2", "matplotlib", "pydantic")


@pytest.mark.parametrize("name", COMMANDS)
def test_every_command_resolves_and_teaches(name: str) -> None:
    function = load(COMMANDS[name].target)
    assert callable(function)
    assert function.__doc__


@pytest.mark.parametrize("name", COMMANDS)
def test_every_command_has_help(name: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert invoke([*name.split(), "--help"]) == 0
    assert "Usage" in capsys.readouterr().out


@pytest.mark.parametrize("name", COMMANDS)
def test_help_is_as_wide_as_the_screen(
    name: str, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """No line ends where the next one's first word had room: an author's own line ends are not shown."""
    monkeypatch.setattr("typer.rich_utils.MAX_WIDTH", 70)
    assert invoke([*name.split(), "--help"]) == 0
    told = capsys.readouterr().out.partition("\u256d")[0].splitlines()
    usage = next(n for n, line in enumerate(told) if line.strip() == "" and n > 1)
    for line, after in pairwise(told[usage:]):
        if line.strip() and after.strip():
            assert len(line.rstrip()) + 1 + len(after.split()[0]) > 69, line


def test_help_imports_no_command_and_no_heavy_library() -> None:
    program = (
        "import sys; from harness.cli import invoke; invoke(['--help'])\n"
        f"print([m for m in {FORBIDDEN_AT_START!r} if m in sys.modules], file=sys.stderr)\n"
        "print([m for m in sys.modules if m.startswith('experiments')], file=sys.stderr)"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert done.stderr.split("\n")[:2] == ["[]", "[]"]


def test_the_version_is_printed_with_those_of_all_that_shapes_numbers(
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert invoke(["--version"]) == 0
    out = capsys.readouterr().out
    assert re.search(r"^touchstone-lab \d+\.\d+", out, flags=re.M)
    assert "numpy" in out


@pytest.mark.parametrize(
    ("words", "completed"),
    [
        ("touchstone obj", "object"),
        ("touchstone object ren", "render"),
        ("touchstone run --pre", "--presses"),
    ],
)
def test_a_shell_completes_commands_and_their_options(
    words: str, completed: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("_TOUCHSTONE_COMPLETE", "complete_bash")
    monkeypatch.setenv("COMP_WORDS", words)
    monkeypatch.setenv("COMP_CWORD", str(len(words.split()) - 1))
    with pytest.raises(SystemExit):
        invoke([])
    assert completed in capsys.readouterr().out


@pytest.mark.parametrize("words", ["", *GROUPS])
def test_the_program_and_its_groups_alone_print_their_help(
    words: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert invoke(words.split()) == 0
    captured = capsys.readouterr()
    assert "Usage" in captured.out
    assert "Commands" in captured.out
    assert captured.err == ""


def test_wrong_use_exits_with_2() -> None:
    assert invoke(["no-such-command"]) == 2
    assert invoke(["run", "--no-such-option"]) == 2


def test_a_mistyped_word_is_told_in_the_programs_own_words(capsys: pytest.CaptureFixture[str]) -> None:
    assert invoke(["run", "contact-localisation"]) == 2
    said = capsys.readouterr().err
    assert "'contact-localisation'; did you mean 'contact-localization'?" in said
    assert "Value error" not in said


def test_json_is_one_object_even_for_an_error(capsys: pytest.CaptureFixture[str]) -> None:
    code = invoke(["explain", "no_such_scene.toml", "--json"])
    captured = capsys.readouterr()
    answer = json.loads(captured.out)
    assert code == answer["exit_code"] == 2
    assert "no_such_scene.toml" in answer["error"]
    assert "error" in captured.err


def test_nothing_at_the_bench_imports_torch() -> None:
    targets = [command.target for command in COMMANDS.values()]
    program = (
        "import sys; from harness.cli import load\n"
        f"[load(t) for t in {targets!r}]\n"
        "assert 'torch' not in sys.modules"
    )
    subprocess.run([sys.executable, "-c", program], check=True)


def test_the_readme_lists_every_kind_of_error() -> None:
    text = (Path(__file__).parents[2] / "README.md").read_text(encoding="utf-8")
    listed = text.partition("`kind`, which stays")[2].partition("\n\n")[0]
    known = set(_every(TouchstoneError))
    assert {LinkCut, Interrupted} <= known
    expected = {each.kind() for each in known - {TouchstoneError}} | {SYSTEM, UNFORESEEN}
    assert {name.replace("\n", " ") for name in re.findall(r"`([^`]+)`", listed)} == expected


def _every(of: type[TouchstoneError]) -> list[type[TouchstoneError]]:
    return [of, *(found for each in of.__subclasses__() for found in _every(each))]


def test_a_failure_says_its_kind(capsys: pytest.CaptureFixture[str]) -> None:
    assert invoke(["replay", "nowhere", "--json"]) == 2
    assert json.loads(capsys.readouterr().out)["kind"] == "wrong use"
    assert invoke(["sim", "modes", "--no-such-option", "--json"]) == 2
    assert json.loads(capsys.readouterr().out)["kind"] == "wrong use"


def test_what_a_library_prints_is_beside_the_one_json_object(
    capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    def printing(*_: object, **__: object) -> None:
        sys.stdout.write("\n")
        os.write(1, b"a compiled library prints\n")
        raise WrongUse("no such thing")

    monkeypatch.setattr("harness.cli._app", lambda *_: printing)
    assert invoke(["explain", "--json"]) == 2
    captured = capfd.readouterr()
    assert json.loads(captured.out)["error"] == "no such thing"
    assert captured.out.count("\n") == 1
    assert "a compiled library prints" in captured.err


def test_what_nobody_foresaw_is_one_json_object_too(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    def broken(*_: object, **__: object) -> None:
        raise ZeroDivisionError

    monkeypatch.setattr("harness.cli._app", broken)
    assert invoke(["explain", "--json"]) == 1
    captured = capsys.readouterr()
    assert json.loads(captured.out)["kind"] == UNFORESEEN
    assert "ZeroDivisionError" in captured.err


def test_what_is_not_built_is_wrong_use_in_its_own_words(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    def unbuilt(*_: object, **__: object) -> None:
        raise NotImplementedError("printed markers in the gel: no world has them")

    monkeypatch.setattr("harness.cli._app", unbuilt)
    assert invoke(["explain", "--json"]) == 2
    captured = capsys.readouterr()
    answer = json.loads(captured.out)
    assert answer["kind"] == WrongUse.kind()
    assert answer["error"].startswith("printed markers in the gel: ")
    assert "Traceback" not in captured.err


NOISY = """
import os, sys
from harness.basics.answers import answers_alone, write_answer
with answers_alone():
    print("a library prints")
    os.write(1, b"a compiled library prints\\n")
    write_answer('{"answer": 1}')
print("after")
"""


def test_answers_alone_are_on_standard_output() -> None:
    done = subprocess.run([sys.executable, "-c", NOISY], capture_output=True, text=True, check=True)
    assert done.stdout == '{"answer": 1}\nafter\n'
    assert "a library prints" in done.stderr
    assert "a compiled library prints" in done.stderr


def test_answers_alone_are_on_a_standard_output_that_was_replaced(capsys: pytest.CaptureFixture[str]) -> None:
    with answers_alone():
        sys.stdout.write("a library prints")
        write_answer("1")
    captured = capsys.readouterr()
    assert (captured.out, captured.err) == ("1\n", "a library prints")
