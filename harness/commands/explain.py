"""``touchstone explain``: which effects a scene calls for."""

from pathlib import Path
from typing import Annotated

import typer

from harness.commands import options
from harness.commands.output import ANSWERS, emit


def explain(
    scene: Annotated[Path, typer.Argument(help="A scene file; examples are under scenes/.", metavar="SCENE")],
    station: options.Station = "mock",
    level: options.LevelOption = None,
    json: options.Json = False,
) -> int:
    """Say which effects a scene calls for, which not, and why.

    Nothing is computed. An effect runs only where something asks for it and the scene has what causes it.

    Try: touchstone explain scenes/mug_touch.toml
    """
    from harness.bench.scene import load_scene
    from harness.bench.station_file import load_station, station_path
    from harness.effects.catalogue import EFFECTS
    from harness.effects.explain import as_json, as_table, scene_plan
    from harness.effects.plan import default_accuracy

    wanted = load_scene(scene)
    sensor = load_station(station_path(station)).gel.sensor
    plan = scene_plan(wanted, sensor, default_accuracy(EFFECTS).with_texts(level or []))
    if json:
        emit({"schema": 1, "scene": str(scene), "observe": list(wanted.observe), **as_json(plan)})
    else:
        ANSWERS.print(as_table(plan))
    return 0
