"""Contacts with strikes on mocked benches, and how much later one bench hears a strike than another."""

from collections.abc import Mapping, Sequence

import numpy as np

from harness.basics.arrays import AnyArray
from harness.bench.acquisition import Strike, strike_from_readings
from harness.bench.device import Reading
from harness.bench.station import Bench
from harness.bench.station_file import Station
from harness.recording.step_file import Step
from harness.skills.planning import RunPlan
from harness.skills.press import PressPerformer
from harness.twin.bench_of import way_between

Readings = dict[str, Reading]


def performed(bench: Bench, plan: RunPlan) -> list[Readings]:
    """Every contact of a plan, its readings by channel."""
    experiment = PressPerformer(lambda here, there: way_between(plan.bench, here, there))
    steps = [Step(index, "press", parameters) for index, parameters in enumerate(plan.parameters())]
    return [{reading.channel.name: reading for reading in experiment.perform(s, bench)} for s in steps]


def strikes_on(station: Station, contacts: Sequence[Mapping[str, Reading]]) -> list[Strike]:
    """What the station's calibration makes of each contact's strike."""
    assert station.hammer is not None
    return [strike_from_readings(readings, station.hammer.acquisition) for readings in contacts]


def delay(first: Strike, second: Strike, samples: int = 15000) -> tuple[float, float]:
    """Seconds by which the second's pressure follows later upon its force, and how alike the two then are."""
    frequencies = np.fft.rfftfreq(samples, 1 / first.rate)
    band = (frequencies > 300) & (frequencies < 8000)
    here, there = (_spectrum(strike, samples)[band] for strike in (first, second))
    cross, turns = there * np.conj(here), 2j * np.pi * frequencies[band]
    power = float(np.linalg.norm(here) * np.linalg.norm(there))
    best, alike = 0.0, 0.0
    for reach, step in ((4e-3, 10e-6), (20e-6, 0.1e-6)):
        tried = best + np.arange(-reach, reach, step)
        fit = np.array([np.sum(cross * np.exp(turns * t)).real for t in tried])
        best, alike = float(tried[np.argmax(fit)]), float(fit.max()) / power
    return best, alike


def _spectrum(strike: Strike, samples: int) -> AnyArray:
    """From where the force is half its greatest: no threshold's noise is in that."""
    peak = int(np.argmax(strike.force))
    rise = np.interp(
        0.5 * strike.force[peak], strike.force[peak - 12 : peak + 1], np.arange(peak - 12, peak + 1)
    )
    shift = rise - np.floor(rise)
    piece = strike.pressure[int(rise) - 50 :][:samples]
    spectrum: AnyArray = np.fft.rfft(piece) * np.exp(2j * np.pi * shift * np.fft.rfftfreq(samples))
    return spectrum
