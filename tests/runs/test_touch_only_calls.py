"""A run that only touches computes no mode, no room, no microphone and no sound: calls are counted."""

import importlib
import inspect
import sys
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from harness.bench.acquisition import Strike
from harness.effects.catalogue import SOUND_EFFECTS
from harness.recording.recording import Recording
from harness.strikes import peaks as sound_analysis
from tests.support import sessions as session_of
from tests.support.localization import chosen
from tests.support.whole_run import in_process_run, touch_scene

OF_SOUND = (
    "harness.bench.acquisition",
    "harness.sim.sound.room",
    "harness.sim.modal.modal",
    "harness.sim.modal.solve",
    "harness.sim.solid.tetrahedra",
    "harness.sim.sound.modal_sound",
    "harness.sim.modal.system",
    "harness.sim.modal.modes",
    "harness.sim.sound.room",
    "harness.sim.solid.tetrahedra",
    "harness.strikes.peaks",
    "experiments.contact_localization.sound.gains",
    "experiments.contact_localization.sound.likelihood",
    "experiments.contact_localization.posterior.baselines",
    "experiments.contact_localization.posterior.strikes",
    "harness.strikes.spectra",
    "mocks.daq.strike_counts",
    "mocks.world.instrument",
    "mocks.world.sound",
)
"""Modules of which no function may be called."""

ALLOWED = {
    # The world's box, hammer and microphone have a calibration in the station's file, heard or not.
    "harness.bench.acquisition.shipped_acquisition",
    "harness.bench.acquisition._check_number",
    # The baselines that use no sound stand beside the one that does.
    "experiments.contact_localization.posterior.baselines.mean_random_error",
    "experiments.contact_localization.posterior.baselines.without_images",
}


def count_calls(patch: pytest.MonkeyPatch) -> Counter[str]:
    """Counts the calls of every function of the modules of sound, wherever it was imported to."""
    calls: Counter[str] = Counter()
    for home in OF_SOUND:
        module = importlib.import_module(home)
        own = {k: f for k, f in vars(module).items() if inspect.isfunction(f) and f.__module__ == home}
        for name, function in own.items():
            replace_everywhere(patch, name, function, counted(f"{home}.{name}", function, calls))
    provided = {effect.provides for effect in SOUND_EFFECTS}
    assert {"object.modes", "object.sound", "room.reverberation"} <= provided
    return calls


def counted(name: str, function: Callable[..., Any], calls: Counter[str]) -> Callable[..., Any]:
    def count(*arguments: Any, **named: Any) -> Any:
        calls[name] += 1
        return function(*arguments, **named)

    return count


def replace_everywhere(
    patch: pytest.MonkeyPatch, name: str, function: Callable[..., Any], by: Callable[..., Any]
) -> None:
    for module in list(sys.modules.values()):
        if vars(module).get(name) is function:
            patch.setattr(module, name, by)


def test_a_run_that_only_touches_calls_nothing_of_sound(tmp_path: Path) -> None:
    with pytest.MonkeyPatch.context() as patch:
        calls = count_calls(patch)
        recording = in_process_run(tmp_path / "run", touch_scene(contacts=2), seed=3)
        scored = session_of.score(Recording(recording.folder), chosen([]))
    assert {name: count for name, count in calls.items() if name not in ALLOWED} == {}
    assert scored.found.readings.model.modes is None
    assert list(scored.found.by_sense) == ["touch"]
    assert "sounds" not in scored.found.last.seconds


def test_calls_of_sound_would_be_counted() -> None:
    noise = np.random.default_rng(0).standard_normal(25_000)
    strike = Strike(50e3, noise, noise, 1000, 0.0, False, False, False)
    with pytest.MonkeyPatch.context() as patch:
        calls = count_calls(patch)
        sound_analysis.analyse([strike, strike])
    assert calls["harness.strikes.spectra.spectra_of"] == 1
