"""The ``touchstone`` program: a literal table of commands, each imported when it is used.

``--help`` imports none of them; the text beside each name is all it shows.
"""

import importlib
import json
import os
import sys
import traceback
from collections.abc import Callable, Mapping, Sequence
from contextlib import nullcontext
from dataclasses import dataclass, field
from functools import wraps
from inspect import cleandoc, signature
from typing import Annotated, Any

import typer
from rich.markup import escape
from typer.exceptions import TyperException

from harness.basics.answers import answers_alone, write_answer
from harness.basics.errors import TouchstoneError, WrongUse
from harness.bench.experiments import EXPERIMENTS
from harness.commands.terminal import SafeConsole, escape_controls, escape_message


class Interrupted(TouchstoneError):
    """Ctrl-C ended a command before it had an answer."""

    exit_code = 130

    def __init__(self, resumes: bool = False) -> None:
        kept = "; what was recorded is kept, go on with --resume" if resumes else ""
        super().__init__(f"interrupted{kept}")


PROGRAM = "touchstone"


@dataclass(frozen=True)
class Command:
    """Where a command lives, and what it is for."""

    target: str  #: module and name of its function.
    summary: str  #: beside its name in help.
    removed: Mapping[str, str] = field(default_factory=dict)
    """options that it had, each with what to do instead."""


ONE_SAMPLE = "there is one way to a picture, one sample a ray where it meets the surface"

COMMANDS = {
    "demo": Command(
        "harness.commands.run.demo:demo",
        "Localize a contact on the mocked bench from end to end, and write the report.",
    ),
    "init": Command(
        "harness.commands.init:init", "Write a station, a scene and a README to start a project from."
    ),
    "run": Command(
        "harness.commands.run.run:run",
        "Run an experiment on a bench, or resume a run with --resume.",
    ),
    "replay": Command(
        "harness.commands.run.replay:replay", "Estimate again from a recording alone; no bench is opened."
    ),
    "compare": Command(
        "harness.commands.run.compare:compare",
        "Hold a run's readings against its object's networks, the simulation and the twin.",
    ),
    "explain": Command(
        "harness.commands.explain:explain", "Say which effects a scene calls for, which not, and why."
    ),
    "check": Command(
        "harness.commands.check:check", "Open every instrument of a station: rate, drops, latency."
    ),
    "camera": Command(
        "harness.commands.camera:camera", "Write what a camera of the station sees now, as a picture."
    ),
    "mock-lab": Command(
        "harness.commands.mock_lab:mock_lab", "Keep a mocked bench running, to try drivers on."
    ),
    "depth": Command(
        "harness.commands.press.depth:depth",
        "How deep a gel is pressed, from live pictures of it, with the error of every pixel.",
    ),
    "cost vision": Command(
        "harness.commands.object.cost_vision:vision",
        "Error against seconds of an object's pictures, knob by knob.",
    ),
    "object build": Command(
        "harness.commands.object.build:build",
        "Build an object's sound, touch or look: networks, and what they are off by.",
        {"--finish": "networks no longer learn from pictures; say --profile paper for larger ones"},
    ),
    "object info": Command(
        "harness.commands.object.object:info",
        "Say what an ObjectFile holds: modes, networks, sources, licence.",
    ),
    "object import": Command(
        "harness.commands.object.published:import_published",
        "Read a published ObjectFile (ObjectFolder 1.0 or 2.0) into a folder of ONNX networks.",
    ),
    "object render queries": Command(
        "harness.commands.object.published:render_queries",
        "Answer ObjectFolder's own query files by an object: sounds, touches, pictures.",
    ),
    "object render audio": Command(
        "harness.commands.object.render:render",
        "Render the sound of a strike at a place: a WAV, and a picture of it and of the modes.",
    ),
    "object render touch": Command(
        "harness.commands.object.render_touch:render",
        "Render a press at a place: what a gel's camera sees, and how far that is from the mesh's.",
    ),
    "object render vision": Command(
        "harness.commands.object.render_vision:render",
        "Render a picture from any side in any light, or a turntable of them, by the networks.",
        {
            "--level": f"{ONE_SAMPLE}; leave --level out, and say --rays 2 for a finer picture",
            "--compare": f"{ONE_SAMPLE}; `touchstone cost vision` compares it with exact pictures",
        },
    ),
    "object view": Command(
        "harness.commands.object.view:view",
        "Turn an object with the mouse, in a browser on this machine.",
    ),
    "object compare vision": Command(
        "harness.commands.object.compare_vision:compare",
        "A camera's picture beside the networks': exposure and white balance fitted, what is left.",
        {"--level": f"{ONE_SAMPLE}; leave --level out"},
    ),
    "object verify": Command(
        "harness.commands.object.object:verify", "Check an ObjectFile: hashes, graphs, shapes, known answers."
    ),
    "catalogue check": Command(
        "harness.commands.catalogue.check:check",
        "What intake finds of every object of a catalogue: units, labels, openings, walls, masses.",
    ),
    "catalogue build": Command(
        "harness.commands.catalogue.build:build",
        "Build every object of a catalogue, side by side; a stopped build goes on.",
    ),
    "catalogue status": Command(
        "harness.commands.catalogue.status:status", "What a build has made, how well, and what failed why."
    ),
    "catalogue publish": Command(
        "harness.commands.catalogue.publish:publish",
        "Copy what a build has made to a folder or an object store.",
    ),
    "catalogue page": Command(
        "harness.commands.catalogue.status:page",
        "One page of all objects of a build, with a picture of each.",
    ),
    "calibrate taxim": Command(
        "calibration.commands.taxim:taxim",
        "Calibrate a tactile camera by ball presses, made by the arm or in pictures; no marks.",
    ),
    "calibrate markers": Command(
        "calibration.commands.markers:markers",
        "Find the dots printed on a gel, from pictures of it at rest.",
    ),
    "tables rendering": Command(
        "experiments.paper.command:rendering",
        "Time and quality of rendering: the paper's tables 1 and 2, with its 1.0 trained and measured here.",
    ),
    "sim modes": Command(
        "harness.commands.sound.modes:modes",
        "Frequencies and dampings of a mesh, counted so that none is missing.",
    ),
    "sim touch": Command(
        "harness.commands.press.touch:touch",
        "What a gel's camera sees of a height map, or of a mesh it is pressed onto.",
    ),
}


def commands() -> dict[str, Command]:
    """Every command by its words: the literal ones, and the table and the cost curve of every experiment."""
    found = dict(COMMANDS)
    for name, row in EXPERIMENTS.items():
        if row.value is not None:
            found[f"tables {name}"] = Command(
                "harness.commands.run.tables:tables", f"A table of: {row.about}"
            )
            found[f"cost {name}"] = Command(
                "harness.commands.run.cost:cost", f"Error against seconds of: {row.about}"
            )
    return found


GROUPS = {
    "tables": "The tables a paper would print, measured on the mocked bench.",
    "cost": "What accuracy costs in seconds, measured on this machine.",
    "object": "ObjectFiles: what is known of one object, in a folder of open files.",
    "object render": "What an ObjectFile's networks say, for ears and eyes: audio, touch, vision, queries.",
    "object compare": "What instruments read of an object beside what its ObjectFile says: vision.",
    "catalogue": "A folder of objects becomes ObjectFiles, on this machine or a cluster.",
    "calibrate": "Instruments' own calibrations, each an artefact with its residual and its reasons.",
    "sim": "What the simulators compute, one at a time.",
}

SYSTEM = "system error"
"""The kind of a failure of the computer's: a full disk, a folder that may not be written."""

UNFORESEEN = "unforeseen"
"""The kind of a defect of Touchstone's own."""

_MOST_WORDS = 3
"""Of a command's name."""

EPILOG = (
    "Start with `touchstone demo`. Exit codes: 0 answered; 1 a named failure of the bench or the data; "
    "2 wrong use; 3 stopped by a safety limit; 130 interrupted."
)


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the command line and exit with the code the design promises."""
    sys.exit(invoke(list(sys.argv[1:] if arguments is None else arguments)))


def invoke(arguments: list[str]) -> int:
    """Run the command line and return the exit code; the program and its groups alone print their help."""
    if (not arguments and not _completed()) or " ".join(arguments) in GROUPS:
        arguments = [*arguments, "--help"]
    as_json = "--json" in arguments
    with answers_alone() if as_json else nullcontext():
        return _ended(arguments, as_json)


def _ended(arguments: list[str], as_json: bool) -> int:
    try:
        _refuse_removed(arguments)
        result = _app(_chosen(_completed() or arguments))(arguments, standalone_mode=False, prog_name=PROGRAM)
    except TouchstoneError as error:
        return _report(str(error), error.kind(), error.exit_code, as_json)
    except KeyboardInterrupt:
        return _report(str(Interrupted()), Interrupted.kind(), Interrupted.exit_code, as_json)
    except FileNotFoundError as error:
        return _report(_of_system(error), WrongUse.kind(), WrongUse.exit_code, as_json)
    except OSError as error:
        return _report(_of_system(error), SYSTEM, 1, as_json)
    except TyperException as error:
        # The library's checker of values puts its own kind of error before what is said.
        said = error.format_message().replace("Value error, ", "")
        return _report(said, WrongUse.kind(), error.exit_code, as_json)
    except Exception as error:  # noqa: BLE001 - the last place where a program can still get an answer
        # Ours name what is not there; a library's do not.
        if isinstance(error, NotImplementedError) and error.args:
            return _report(str(error), WrongUse.kind(), WrongUse.exit_code, as_json)
        sys.stderr.write(escape_controls(traceback.format_exc()))
        return _report(_unforeseen(error), UNFORESEEN, 1, as_json)
    return result if isinstance(result, int) else 0


def _refuse_removed(arguments: Sequence[str]) -> None:
    """Refuse an option that the command had, and name what replaced it."""
    command = commands().get(_chosen(arguments) or "")
    for option in (word.partition("=")[0] for word in arguments):
        if command is not None and option in command.removed:
            raise WrongUse(f"{option} was removed: {command.removed[option]}")


def _completed() -> list[str]:
    """The words that a shell asks to complete, whose command it wants the options of; else none."""
    return os.environ.get("COMP_WORDS", "").split()[1:] if "_TOUCHSTONE_COMPLETE" in os.environ else []


def _chosen(arguments: Sequence[str]) -> str | None:
    words = [word for word in arguments if not word.startswith("-")]
    candidates = (" ".join(words[:count]) for count in range(_MOST_WORDS, 0, -1))
    return next((name for name in candidates if name in commands()), None)


def _app(chosen: str | None) -> typer.Typer:
    app = typer.Typer(
        name=PROGRAM,
        help="Touch an object, compare it with its model, estimate, replay.",
        epilog=EPILOG,
        rich_markup_mode="rich",
        pretty_exceptions_enable=False,
    )
    app.callback()(_root)
    groups = {name: typer.Typer(help=text) for name, text in GROUPS.items()}
    for name, command in commands().items():
        group, _, last = name.rpartition(" ")
        parent = groups[group] if group else app
        body = _interruptible(load(command.target)) if name == chosen else _stub
        told = _paragraphs(body.__doc__ or "") if name == chosen else command.summary
        parent.command(last, help=told, short_help=command.summary)(body)
    for name, group_app in groups.items():
        group, _, last = name.rpartition(" ")
        (groups[group] if group else app).add_typer(group_app, name=last)
    return app


def _print_version(wanted: bool) -> None:
    if wanted:
        from harness.recording.run_folder import versions

        for name, number in sorted(versions().items(), key=lambda row: not row[0].startswith(PROGRAM)):
            sys.stdout.write(f"{name} {number}\n")
        raise typer.Exit


def _root(
    version: Annotated[
        bool,
        typer.Option(
            "--version",
            help="Print the versions of all that numbers come from.",
            callback=_print_version,
            is_eager=True,
        ),
    ] = False,
) -> None:
    """Take what belongs to no command."""


def load(target: str) -> Callable[..., Any]:
    """The object a ``"module:name"`` string names."""
    module, _, name = target.partition(":")
    loaded: Callable[..., Any] = vars(importlib.import_module(module))[name]
    return loaded


def _paragraphs(said: str) -> str:
    """A docstring whose lines end only with its paragraphs: how wide a screen is decides the rest."""
    return "\n\n".join(" ".join(each.split()) for each in cleandoc(said).split("\n\n"))


def _interruptible(body: Callable[..., Any]) -> Callable[..., Any]:
    """The command, with Ctrl-C named as every other end is: typer would leave without a word."""

    @wraps(body)
    def command(*arguments: Any, **options: Any) -> Any:
        try:
            return body(*arguments, **options)
        except KeyboardInterrupt as interrupt:
            raise Interrupted("resume" in signature(body).parameters) from interrupt

    return command


def _stub() -> None:
    """Stand in for a command that is listed but not run."""


def _report(message: str, kind: str, code: int, as_json: bool) -> int:
    SafeConsole(stderr=True).print(f"[bold red]error:[/] {escape(escape_message(message))}")
    if as_json:
        write_answer(json.dumps({"schema": 1, "error": message, "kind": kind, "exit_code": code}))
    return code


def _of_system(error: OSError) -> str:
    """A folder that may not be written, a full disk: what, and of which file."""
    reason = error.strerror or type(error).__name__
    return f"{error.filename}: {reason}" if error.filename is not None else reason


def _unforeseen(error: Exception) -> str:
    return (
        f"Touchstone failed in a way that nobody foresaw ({type(error).__name__}); report the lines above "
        "this one, with the command and its files"
    )
