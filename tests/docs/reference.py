"""Writes docs/reference from the models and the literal tables: ``make reference``."""

from collections.abc import Iterable, Mapping
from dataclasses import replace
from enum import Enum
from inspect import cleandoc
from pathlib import Path
from typing import Any, get_args

import typer
from pydantic import BaseModel

from harness.basics.errors import WrongUse
from harness.basics.files.json_file import CHECKSUM
from harness.bench.experiments import EXPERIMENTS, experiment_names, loaded
from harness.bench.gap import Gap
from harness.bench.scene import SceneFile, scene_from_json
from harness.bench.sensor import MarkerGrid, SensorFile, described_sensor
from harness.bench.station_file import Station
from harness.cli import commands, load
from harness.effects.accuracy import Knob
from harness.effects.catalogue import EFFECTS
from harness.effects.effect import Effect, Facts, knobs_of, needs_of
from harness.effects.plan import default_accuracy, plan
from harness.experiment.compare import CARRIED
from harness.experiment.lookup import find_experiment
from harness.objectfile.description import Description
from harness.objectfile.published.entries import PublishedDescription
from harness.recording.recording import SCHEMA, RunHeader
from tests.docs.model_tables import dataclass_keys, keys, markdown, nested, summary, table
from tests.docs.result_keys import ASKED, COMMON, ESTIMATE, LOCALIZATION, SHAPE, SHAPE_ESTIMATE

FOLDER = Path(__file__).parents[2] / "docs" / "reference"
NOTE = "Generated from the code by `make reference`; do not edit."
OF_A_FILE = ("key", "written as", "default", "meaning")
UNITS = (
    'A quantity is written as text with its unit (`"1.2 mm"`); a number without a unit is refused, and so is '
    "an unknown key, with the nearest known one. None in a meaning: the key is left out."
)


def pages() -> dict[str, str]:
    """Every page by the name of its file."""
    found = {
        "scene.md": _scene(),
        "station.md": _of_model("The station file", Station, f"`stations/NAME.toml`: the bench. {UNITS}"),
        "sensor.md": _of_model("The sensor file", SensorFile, f"A make of tactile sensor. {UNITS}"),
        "gap.md": _of_model(
            "The reality gap file",
            Gap,
            "How a mocked world differs from its model. A value is the standard deviation of a normal "
            f"distribution of mean zero unless its meaning says otherwise. {UNITS}",
        ),
        "run.md": _run(),
        "result.md": _result(),
        "object.md": _of_model(
            "`object.json`",
            Description,
            "The description in an ObjectFile's folder. Keys carry their unit; an unknown key, "
            "NaN, infinity and a key given twice are refused. "
            "[What an ObjectFile is](../explanation/objectfile.md).",
        ),
        "published_object.md": _of_model(
            "`object.json` of published networks",
            PublishedDescription,
            "The description in a folder that `touchstone object import` made. Strict as a built object's. "
            "[How to use one](../how-to/published_objectfiles.md).",
        ),
        "effects.md": _effects(),
        "commands.md": _commands(),
    }
    return {name: "\n".join(lines) + "\n" for name, lines in found.items()}


def main() -> None:
    """Write every page."""
    FOLDER.mkdir(parents=True, exist_ok=True)
    for name, text in pages().items():
        (FOLDER / name).write_text(text, encoding="utf-8")


def _page(title: str, about: str) -> list[str]:
    return [f"# {title}", "", NOTE, "", about, ""]


def _of_model(title: str, model: type[BaseModel], about: str) -> list[str]:
    return [*_page(title, about), *_tables(model, "")]


def _tables(model: type[BaseModel], name: str) -> list[str]:
    inner = nested(model, name, {})
    lines = table(OF_A_FILE, keys(model, inner))
    for part, where in inner.items():
        lines += ["", f"## `{where}`", "", summary(part), "", *table(OF_A_FILE, keys(part, inner))]
    return lines


def _scene() -> list[str]:
    lines = _of_model("The scene file", SceneFile, f"`scene.toml`: what is on the table. {UNITS}")
    for name, model in ((row.section, row.model) for row in EXPERIMENTS.values()):
        if name is None or model is None:
            continue
        section = loaded(model)
        lines += ["", f"## `{name}`", "", f"The table of an experiment. {summary(section)}", ""]
        lines += table(OF_A_FILE, keys(section, nested(section, name, {})))
    return lines


def _run() -> list[str]:
    about = (
        "What a run is, written once before anything moves. The readings are in "
        "`steps/NNN.mcap`, one file a step. "
        f"The schema's number is {SCHEMA}; runs of schema 1 had no checksums and are read as before."
    )
    rows = [*dataclass_keys(RunHeader), (f"`{CHECKSUM}`", "the SHA-256 of all the other values.")]
    return [*_page("`run.json`", about), *table(("key", "meaning"), rows)]


def _result() -> list[str]:
    about = "The answer of a run, in its folder and in that of a replay. Keys carry their unit."
    lines = _page("`result.json`", about)
    for heading, keys_of in (
        ("Every experiment", {**COMMON, **ASKED}),
        ("Contact localization", LOCALIZATION),
        ("One estimate of contact localization", ESTIMATE),
        ("Shape reconstruction", SHAPE),
        ("One estimate of shape reconstruction", SHAPE_ESTIMATE),
    ):
        rows = [(f"`{key}`", meaning) for key, meaning in keys_of.items()]
        lines += [f"## {heading}", "", *table(("key", "meaning"), rows), ""]
    return lines[:-1]


def _effects() -> list[str]:
    about = (
        "Every quantity that the simulation computes on demand. A quantity that no effect provides "
        "is a *source*: the run or the command gives it. A run can observe a quantity (`observe` in the "
        "scene) if all sources behind it are in the run's folder or in the answer. "
        "`--level DIAL=LEVEL` turns a dial."
    )
    lines = _page("Effects and dials", about)
    rows = [
        (f"`{e.provides}`", _listed(e.needs), _when(e), _listed(k.name for k in knobs_of([e])), _observed(e))
        for e in EFFECTS
    ]
    lines += table(("effect", "computed from", "runs", "dials", "a run can observe it"), rows)
    lines += ["", "## Other implementations", "", "Chosen by the dial of the effect.", ""]
    ways = [
        (f"`{e.provides}`", f"`{e.choice.name}={level}`", _listed(needs_of(way.compute)))
        for e in EFFECTS
        if e.choice is not None
        for level, way in e.ways.items()
    ]
    lines += table(("effect", "level", "computed from"), ways)
    lines += ["", "## Dials of the simulation", "", "Levels run from cheap to exact.", ""]
    lines += _dials(knobs_of(EFFECTS))
    for name in experiment_names():
        own = _dials(find_experiment(name).own_knobs)
        lines += ["", f"## Dials of {name}", "", EXPERIMENTS[name].about, "", *own]
    return lines


def _dials(knobs: Iterable[Knob[Any]]) -> list[str]:
    rows = [
        (f"`{k.name}`", _listed(k.levels), f"`{k.default}`", k.unit or "", markdown(k.meaning)) for k in knobs
    ]
    return table(("dial", "levels", "default", "unit", "meaning"), rows)


def _when(effect: Effect) -> str:
    if effect.when is None:
        return "always"
    otherwise = "" if effect.bypass is None else f"; else `{effect.bypass}` passes through"
    return f"if {markdown(effect.when.because)}{otherwise}"


def _observed(effect: Effect) -> str:
    sensors = {"touch": True, "sound": True, "camera": True}
    room, light = {"size": ["4 m", "5 m", "3 m"]}, {"position": ["0 m", "0 m", "2 m"]}
    tree = {
        "schema": 1,
        "object": {"mesh": "builtin:mug"},
        "sensors": sensors,
        "room": room,
        "lights": [light],
    }
    scene = scene_from_json(tree, "the reference")
    named_file = scene.object.model_copy(update={"objectfile": "of"})
    made = described_sensor("gelsight-r1.5").sensor
    marked = replace(made, casts_shadow=True, markers=MarkerGrid(7, 9, 2e-3, 4e-4))
    plain, rich = Facts(scene, made), Facts(scene.model_copy(update={"object": named_file}), marked)
    given = set(CARRIED).union(*(find_experiment(name).gives for name in experiment_names()))
    for facts, carried in ((plain, given), (rich, {*given, "sensor.shadow_table"})):
        try:
            sources = plan(EFFECTS, facts, (effect.provides,), default_accuracy(EFFECTS)).sources
        except WrongUse:  # the sensor or the scene does not call for it
            continue
        missing = [name for name in sources if name not in carried]
        return f"no: {_listed(missing)}" if missing else "yes"
    return "only with `sensors.noise`, whose level no run carries"


def _listed(items: Iterable[object]) -> str:
    return ", ".join(f"`{item}`" for item in items)


def _commands() -> list[str]:
    about = "Every command with its options. `touchstone COMMAND --help` says the same."
    lines = _page("Commands", about)
    for name, command in sorted(commands().items()):
        body = load(command.target)
        lines += [f"## `touchstone {name}`", "", _prose(cleandoc(body.__doc__ or "")), ""]
        app = typer.Typer(add_completion=False)
        app.command("one")(body)
        rows = [_option(vars(one)) for one in typer.main.get_command(app).params if one.name != "help"]
        lines += [*table(("option", "value", "default", "meaning"), rows), ""]
    return lines[:-1]


def _prose(said: str) -> str:
    paragraphs = [" ".join(each.split()) for each in said.replace("``", "`").split("\n\n")]
    return "\n\n".join(
        f"Example: `{each.removeprefix('Try: ')}`" if each.startswith("Try: ") else each
        for each in paragraphs
    )


def _option(one: Mapping[str, Any]) -> tuple[str, ...]:
    names_of = [*one["opts"], *one["secondary_opts"]]
    argument = not names_of[0].startswith("-")
    shown = ", ".join(f"`{name}`" for name in (n.upper() if argument else n for n in names_of))
    value = "" if one.get("is_flag") else f"`{one['metavar'] or _type(one['type_descriptor'].annotation)}`"
    several = " (again for more)" if one["multiple"] or one["nargs"] == -1 else ""
    return shown, value + several, _default(one), markdown(one["help"] or "")


def _type(annotation: Any) -> str:
    kind = get_args(annotation)[0] if get_args(annotation) else annotation
    if issubclass(kind, Enum):
        return "|".join(str(level.value) for level in kind).replace("|", r"\|")
    return {int: "NUMBER", float: "NUMBER", str: "TEXT", Path: "PATH"}[kind]


def _default(one: Mapping[str, Any]) -> str:
    value = one["default"]
    if one["required"]:
        return "required"
    if value is None or value in ((), [], "") or callable(value):
        return ""
    if isinstance(value, bool):
        return "" if not value else "on"
    return f"`{value.value if isinstance(value, Enum) else value}`"


if __name__ == "__main__":
    main()
