"""``touchstone camera``: what a camera of the station sees now, as a picture."""

import tempfile
from pathlib import Path
from typing import Annotated

import typer

from harness.commands import options
from harness.commands.output import ANSWERS, CONSOLE, emit

_FRAMES = 10
"""That are read before the rate is stated."""

_PATIENCE = 10.0
"""s for those."""


def camera(
    name: Annotated[str, typer.Argument(help="gel, or scene for the camera that looks on.", metavar="NAME")],
    out: Annotated[Path, typer.Option(help="The picture, a PNG.", metavar="FILE")] = Path("live.png"),
    station: options.Station = "mock",
    object_: options.Object = "builtin:mug",
    material: options.Material = None,
    units: options.Units = None,
    json: options.Json = False,
) -> int:
    """Write what a camera of the station sees now; the arm and all else stay closed.

    To aim a camera, to clean a gel, to see that a cable carries pictures. A mocked bench shows --object, or
    its gel at rest.

    Try: touchstone camera gel --station mock --out live.png
    """
    import numpy as np

    from harness.basics.errors import WrongUse
    from harness.basics.files.named_file import nearest
    from harness.basics.whole_file import write_bytes_whole
    from harness.bench.device import CAMERA, GEL
    from harness.bench.scene import scene_from_options
    from harness.bench.station import RunContext, open_station, scene_of_all
    from harness.bench.station_file import load_station, station_path
    from harness.effects.scene_object import known_object
    from harness.picture.image_file import png_bytes

    options.require_files(("--out", out, ".png"))
    cameras = {"gel": GEL, "scene": CAMERA}
    if name not in cameras:
        raise WrongUse(f"no camera {name!r}; {nearest(name, cameras)}")
    bench_file = load_station(station_path(station))
    scene = scene_of_all(bench_file, scene_from_options(object_ or "builtin:mug", material, units))
    with tempfile.TemporaryDirectory(prefix="touchstone-camera-") as folder:
        context = RunContext(Path(folder) / "truth.json", known_object(scene).mesh)
        with (
            CONSOLE.status(f"opening the {name} camera of {bench_file.title or station}"),
            open_station(bench_file, scene, context, only=[cameras[name]]) as bench,
        ):
            seeing = bench.get(cameras[name])
            frame = np.asarray(seeing.read(_FRAMES, timeout=_PATIENCE).values[-1], dtype=np.uint8)
            health = seeing.health()
    write_bytes_whole(out, png_bytes(frame))
    rows, columns = frame.shape[:2]
    if json:
        size = {"rows": rows, "columns": columns, "rate_hz": health.rate, "drops": health.drops}
        size["detail"] = health.detail
        emit({"schema": 1, "camera": name, "identity": health.identity, **size, "picture": str(out)})
    else:
        ANSWERS.print(
            f"{health.identity}: {columns} x {rows} pixels, {health.rate:.1f} Hz, {health.drops} frames "
            f"dropped{f'; {health.detail}' if health.detail else ''}; {out}"
        )
    return 0
