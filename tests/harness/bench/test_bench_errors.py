"""What a station says of its own errors reaches whoever compares readings with a model."""

import json
from pathlib import Path

import pytest

from harness.basics.errors import WrongUse
from harness.bench.gap import USUAL, BenchErrors
from harness.bench.named_files import SHIPPED
from harness.bench.station_file import Station, load_station, station_from_json

MOCK = SHIPPED / "stations" / "mock.toml"


def stated(folder: Path, lines: str) -> Station:
    path = folder / "bench.toml"
    path.write_text(f"{MOCK.read_text()}\n[errors]\n{lines}\n")
    return load_station(path)


def test_a_station_that_states_none_has_the_usual_errors() -> None:
    assert load_station(MOCK).errors == USUAL


def test_what_a_station_states_is_read_in_si_and_survives_a_recording(tmp_path: Path) -> None:
    station = stated(tmp_path, 'tilt = "1 deg"\ngel_centre = "1.25 mm"\nscale = "2 %"')
    assert station.errors == BenchErrors(
        **{**USUAL.model_dump(mode="json"), "tilt": "1 deg", "gel_centre": "1.25 mm", "scale": "2 %"}
    )
    tree = json.loads(json.dumps(station.model_dump(mode="json", by_alias=True)))
    assert station_from_json(tree, "the run").errors == station.errors
    assert station.errors.gel_centre == 1.25e-3
    del tree["errors"]  # as runs carry it that were made before a station could state any
    assert station_from_json(tree, "the run").errors == USUAL


@pytest.mark.parametrize("line", ['tilt = "0 deg"', 'tilt = "1 mm"', 'tilted = "1 deg"', "tilt = 1.0"])
def test_errors_that_cannot_be_are_refused_by_name(line: str, tmp_path: Path) -> None:
    with pytest.raises(WrongUse, match="tilt"):
        stated(tmp_path, line)


def test_all_errors_grow_by_a_factor() -> None:
    twice = USUAL.times(2.0)
    assert all(value == 2.0 * getattr(USUAL, name) for name, value in twice)
    assert twice.times(0.5) == USUAL
