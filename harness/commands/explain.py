"""``touchstone explain``: which effects a scene calls for."""

from pathlib import Path
from typing import Annotated

import typer

from harness.commands import options
from harness.commands.output import ANSWERS, emit


def _check(path: Path) -> Path:
    """Refuse what is neither a scene nor an ObjectFile."""
    from harness.bench.scene_objectfile import holds_objectfile, objectfile_folder

    return (
        path
        if holds_objectfile(objectfile_folder(str(path), Path.cwd()))
        else options.check_scene(path) or path
    )


def explain(
    scene: Annotated[
        Path,
        typer.Argument(
            help="A scene file, of which examples are under scenes/, or the folder of an ObjectFile.",
            metavar="SCENE",
            callback=_check,
        ),
    ],
    station: options.Station = "mock",
    level: options.LevelOption = None,
    json: options.Json = False,
) -> int:
    """Say which effects a scene calls for, which not, and why.

    Nothing is computed. An effect runs only where something asks for it and the scene has what causes it.
    Where the scene names an ObjectFile: which of its networks stand for which simulation, how far off they
    are and how long they take, as their model cards say.

    Try: touchstone explain scenes/mug_touch.toml
    """
    from harness.bench.scene import load_scene, scene_from_options
    from harness.bench.scene_objectfile import holds_objectfile, objectfile_folder
    from harness.bench.station_file import load_station, station_path
    from harness.effects.catalogue import EFFECTS, scene_levels
    from harness.effects.explain import (
        as_json,
        as_table,
        networks_as_json,
        networks_as_table,
        networks_in_use,
        scene_plan,
    )
    from harness.effects.plan import default_accuracy

    is_object = holds_objectfile(objectfile_folder(str(scene), Path.cwd()))
    wanted = scene_from_options(str(scene)) if is_object else load_scene(scene)
    sensor = load_station(station_path(station)).gel.sensor
    accuracy = default_accuracy(EFFECTS).with_(scene_levels(wanted)).with_texts(level or [])
    plan = scene_plan(wanted, sensor, accuracy)
    networks = networks_in_use(wanted, plan)
    if json:
        explained = {**as_json(plan), "networks": networks_as_json(networks)}
        emit({"schema": 1, "scene": str(scene), "observe": list(wanted.observe), **explained})
        return 0
    ANSWERS.print(as_table(plan))
    if networks:
        ANSWERS.print(networks_as_table(networks))
    return 0
