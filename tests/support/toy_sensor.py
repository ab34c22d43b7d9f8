"""A tactile sensor that nobody sells: one TOML file and one calibration, and a station that carries it."""

from dataclasses import replace
from pathlib import Path

import numpy as np

from harness.bench.sensor import TactileSensor
from harness.bench.station_file import station_path
from harness.sim.gel.gel import skirt_for
from harness.sim.optics.tactile_calibration import save_calibration, shipped_calibration

TOY_SENSOR = TactileSensor("Toy", 60, 80, 0.2e-3, 2e-3, housing=(20e-3, 16e-3))

TOY = """\
schema = 1
name = "Toy"
calibration = "toy.npz"
[image]
rows = 60
columns = 80
basis = "measured"
source = "made up for a test"
[pitch]
value = "0.2 mm"
basis = "measured"
source = "made up for a test"
[gel_thickness]
value = "2 mm"
basis = "measured"
source = "made up for a test"
[housing]
x = "20 mm"
y = "16 mm"
basis = "measured"
source = "made up for a test"
[shadow]
casts = false
basis = "measured"
source = "made up for a test"
"""


def write_toy(folder: Path) -> Path:
    """The two files of the toy in a folder; the path of the TOML one."""
    path = folder / "toy.toml"
    path.write_text(TOY, encoding="utf-8")
    write_calibration(folder / "toy.npz", 60, 80, 0.2e-3)
    return path


def write_calibration(path: Path, rows: int, columns: int, pitch: float) -> None:
    """The R1.5's colours and skirt, for ``rows`` x ``columns`` pixels of ``pitch`` m over an even grey."""
    known = shipped_calibration("gelsight_r15_bench")
    even = np.full((rows, columns, 3), 110, np.uint8)
    skirt = skirt_for(TactileSensor("", rows, columns, pitch, 1e-3))
    header = replace(known.header, pitch=pitch, skirt=skirt)
    save_calibration(replace(known, background=even, header=header), path)


def write_station(folder: Path, make: str, calibration: str) -> Path:
    """The mocked station, with another gel."""
    text = station_path("mock").read_text(encoding="utf-8")
    text = text.replace('"gelsight-r1.5"', f'"{make}"').replace('"gelsight_r15_bench"', f'"{calibration}"')
    path = folder / "bench.toml"
    path.write_text(text, encoding="utf-8")
    return path
