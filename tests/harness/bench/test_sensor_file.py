"""Sensors as data: what comes with the package, and files with mistakes in them."""

from pathlib import Path

import pytest

from harness.basics.errors import WrongUse
from harness.bench.sensor import (
    GELSIGHT_R15,
    TactileSensor,
    described_sensor,
    read_sensor,
    shipped_sensors,
)

PLAIN = """\
schema = 1
name = "bench"
[image]
rows = 60
columns = 80
basis = "measured"
source = "our own frame grabber"
[pitch]
value = "0.2 mm"
basis = "measured"
source = "a move of the arm by 1 mm"
[gel_thickness]
value = "3 mm"
basis = "assumed"
source = "not measured yet"
[housing]
x = "20 mm"
y = "18 mm"
basis = "measured"
source = "with a caliper"
[shadow]
casts = false
basis = "assumed"
source = "none were seen"
"""


def _written(folder: Path, text: str) -> Path:
    path = folder / "sensor.toml"
    path.write_text(text)
    return path


def test_the_papers_sensor_is_its_file_to_the_bit() -> None:
    assert described_sensor("gelsight-r1.5").sensor == GELSIGHT_R15
    assert TactileSensor("GelSight R1.5 (ObjectFolder 2.0)", 120, 160, 0.1245e-3, 2.5e-3) == GELSIGHT_R15
    taxim = TactileSensor("GelSight of Taxim", 480, 640, 0.0295e-3, 5.0e-3)
    assert described_sensor("taxim-gelsight").sensor == taxim


@pytest.mark.parametrize("name", shipped_sensors())
def test_every_figure_says_where_it_comes_from(name: str) -> None:
    described = described_sensor(name)
    assert {"image", "pitch", "gel_thickness", "housing", "shadow"} <= set(described.sources)
    assert set(described.assumed) <= set(described.sources)
    window, housing = described.sensor.window, described.sensor.housing
    assert window[0] < housing[0]
    assert window[1] < housing[1]


def test_four_makes_are_described() -> None:
    assert set(shipped_sensors()) == {"digit", "gelsight-mini", "gelsight-r1.5", "taxim-gelsight"}
    digit, mini = described_sensor("digit").sensor, described_sensor("gelsight-mini").sensor
    assert digit.gel_radius == pytest.approx(0.1)
    assert mini.gel_radius is None
    assert digit.window == pytest.approx((240e-3 / 19.58, 320e-3 / 19.58), rel=1e-5)


def test_a_file_is_read_as_it_stands(tmp_path: Path) -> None:
    markers = '[markers]\nrows = 7\ncolumns = 9\nspacing = "1.5 mm"\nradius = "0.2 mm"\n'
    said = PLAIN + markers + 'basis = "measured"\nsource = "under a microscope"\n'
    described = read_sensor(_written(tmp_path, said))
    assert described.assumed == ("gel_thickness", "shadow")
    assert described.sensor.markers is not None
    assert described.sensor.markers.spacing == pytest.approx(1.5e-3)
    assert described.sensor.pitch == pytest.approx(0.2e-3)


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ("[gel_thickness]", "[gel_thicknes]", "gel_thickness"),
        ('value = "0.2 mm"', "value = 0.2", "pitch"),
        ('value = "0.2 mm"', 'value = "0.2 kg"', "pitch"),
        ('value = "0.2 mm"', 'value = "-0.2 mm"', "pitch"),
        ('value = "0.2 mm"', 'value = "2 mm"', "housing"),
        ("rows = 60", "rows = 60.5", "image.rows"),
        ('basis = "measured"\nsource = "with', 'basis = "guessed"\nsource = "with', "housing.basis"),
        ('source = "with a caliper"', "", "housing.source"),
        ('source = "with a caliper"', 'source = ""', "housing.source"),
        ("schema = 1", "schema = 2", "schema"),
        (
            "[shadow]",
            '[gel_radius]\nvalue = "5 mm"\nbasis = "assumed"\nsource = "by eye only"\n[shadow]',
            "dome",
        ),
    ],
)
def test_a_mistake_is_named(tmp_path: Path, old: str, new: str, says: str) -> None:
    assert old in PLAIN
    with pytest.raises(WrongUse, match=says):
        read_sensor(_written(tmp_path, PLAIN.replace(old, new)))


def test_a_name_that_is_not_described() -> None:
    with pytest.raises(WrongUse, match=r"'gelsight-mimi'.*'gelsight-mini'"):
        described_sensor("gelsight-mimi")
