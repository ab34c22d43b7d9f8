"""``touchstone mock-lab``: the far ends of the cables, to try drivers on."""

import time
from pathlib import Path
from tempfile import TemporaryDirectory

from harness.commands import options
from harness.commands.output import ANSWERS, CONSOLE, emit

_REMARKS = {"arm": " (ports 29999, 30003, 30004, 30011)", "hammer": " (a serial port)"}
"""What an address leaves open, by instrument."""


def mock_lab(
    station: options.Station = "mock",
    scene: options.SceneOption = None,
    object_: options.Object = None,
    material: options.Material = None,
    units: options.Units = None,
    up_axis: options.UpAxis = None,
    seed: options.Seed = None,
    gap: options.GapOption = None,
    json: options.Json = False,
) -> int:
    """Keep a mocked bench running, to try drivers on; Ctrl-C ends it.

    Prints where the instruments are: a controller that UR's own clients connect to, and an MJPEG stream
    that any browser shows.

    Try: touchstone mock-lab --object builtin:mug
    """
    from harness.bench.gap import gap_path
    from harness.bench.mock_lab import MockLab
    from harness.bench.station_file import load_station, station_path
    from harness.effects.scene_object import known_object
    from harness.tasks.scenes import SceneOptions, resolve

    default = "builtin:mug" if scene is None and object_ is None else object_
    wanted = resolve(SceneOptions(scene, default, material, units, up_axis=up_axis))
    bench = load_station(station_path(station))
    gap_file = gap_path(gap or (bench.mock.gap if bench.mock is not None else "default"))
    with TemporaryDirectory(prefix="touchstone-truth-") as folder:
        truth = Path(folder) / "truth.json"
        lab = MockLab(wanted, bench, known_object(wanted).mesh, seed or 0, gap_file, truth)
        try:
            where = lab.start()
            if json:
                absent = dict.fromkeys(("arm", "gel", "camera", "hammer"))
                emit({"schema": 1, **absent, **where.addresses})
            else:
                for name, address in where.addresses.items():
                    ANSWERS.print(f"{name}: {address}{_REMARKS.get(name, '')}", markup=False)
            CONSOLE.print("Ctrl-C ends it")
            while True:
                time.sleep(3600)
        except KeyboardInterrupt:
            return 0
        finally:
            lab.close()
