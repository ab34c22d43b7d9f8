"""Asked of every effect: a run answers it, or refuses before anything moves, naming what is missing."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from experiments.contact_localization.answer import ScoredContact
from experiments.contact_localization.experiment import EXPERIMENT
from harness.basics.errors import WrongUse
from harness.bench.scene import SceneFile, scene_from_json
from harness.bench.station_file import load_station, station_path
from harness.effects.catalogue import EFFECTS
from harness.experiment.compare import compare, require_sources
from harness.recording.recording import Recording
from harness.recording.run_folder import RunFiles, station_calibration
from tests.support.localization import chosen
from tests.support.sessions import score, start
from tests.support.whole_run import copied, edited

NAMES = [effect.provides for effect in EFFECTS]


def observing(name: str) -> SceneFile:
    tree: dict[str, Any] = {
        "schema": 1,
        "object": {"mesh": "builtin:mug"},
        "observe": [name],
        "localization": {"contacts": 1},
    }
    return scene_from_json(tree, "the test")


def refusal(name: str) -> str | None:
    station = load_station(station_path("mock"))
    try:
        require_sources(EXPERIMENT, observing(name), station, station_calibration(station))
    except WrongUse as error:
        return str(error)
    return None


def test_some_are_answered_and_some_are_refused() -> None:
    refused = [name for name in NAMES if refusal(name)]
    assert "touch.image" not in refused
    assert "object.touch_codes" in refused
    assert 0 < len(refused) < len(NAMES)


@pytest.fixture(scope="module")
def answered(done: Recording) -> ScoredContact:
    return score(done, chosen([]))


@pytest.mark.parametrize("name", NAMES)
def test_every_effect_is_answered_by_a_run_or_refused_before_it_begins(
    name: str, done: Recording, answered: ScoredContact, tmp_path: Path
) -> None:
    why = refusal(name)
    if why is not None:
        assert name in why or "asked for" in why  # a quantity that another stands in for is named as that
        with pytest.raises(WrongUse):
            start(observing(name), load_station(station_path("mock")), 1, None, tmp_path / "never")
        assert not (tmp_path / "never").exists()
        return
    run = copied(done, tmp_path / "run")

    def ask(tree: dict[str, Any]) -> None:
        tree["scene"]["observe"] = [name]

    scored = replace(answered, run=RunFiles(edited(run, ask)))
    comparison = compare(scored, EXPERIMENT.sources(scored))
    assert list(comparison.observed()) == [name]
    for array in comparison.arrays().values():
        assert not np.issubdtype(array.dtype, np.floating) or not np.isnan(array).any()
