"""What the report says of the instruments, and of the calibrations that a run relied on."""

import datetime as dt
from collections.abc import Mapping

from harness.bench import microphone_take
from harness.bench.acquisition import AcquisitionCalibration
from harness.bench.acquisition_channels import CLOCK, FLAGS, FORCE, PRESSURE
from harness.bench.device import Health
from harness.bench.reading import Reading
from harness.bench.station_file import Station
from harness.recording.run_folder import RunFiles
from harness.report.data import Artefact, InstrumentRow
from harness.report.values import Missing

_IN_BLOCKS = (FORCE, PRESSURE)
"""Channels whose every reading is a block of samples."""

_REMARKS = (CLOCK, FLAGS, microphone_take.CLOCK, microphone_take.FLAGS, microphone_take.CALLBACK)
"""Channels that say something of a capture and hold no sample."""

_HEARD_WITH = {"hammer": ("microphone",)}
"""Instruments whose box reads another's channels too."""


def instruments(run: RunFiles, health: Mapping[str, Health] | None) -> tuple[InstrumentRow, ...] | Missing:
    """One row an instrument.

    Args:
        run: the folder.
        health: at the end of the session; None for a replay.
    """
    if health is None:
        return Missing("estimated again from the recording: no instrument was open")
    nominal = nominal_rates(run.station)
    counts: dict[str, int] = {}
    for step in run.recording.steps():
        for reading in step.readings.values():
            whose = reading.channel.name.split(".")[0]
            counts[whose] = counts.get(whose, 0) + samples(reading)
    return tuple(
        InstrumentRow(
            name=" and ".join(names),
            address=said.identity,
            rate=said.rate,
            nominal_rate=nominal.get(name),
            readings=sum(counts.get(one, 0) for one in names),
            drops=said.drops,
            latency_median=said.latency,
            remark=said.detail,
        )
        for name, said in health.items()
        for names in [_read_by(name, health)]
    )


def _read_by(name: str, health: Mapping[str, Health]) -> list[str]:
    """Whose channels an instrument reads: its own, and those of one that has no box of its own."""
    return [name, *(other for other in _HEARD_WITH.get(name, ()) if other not in health)]


def nominal_rates(station: Station) -> dict[str, float]:
    """Hz that each instrument should have, by name; of the hammer's box, each channel."""
    rates = {"arm": station.arm.rate, "gel": station.gel.rate}
    if station.hammer is not None:
        rates["hammer"] = station.hammer.rate
    if station.microphone is not None and station.microphone.rate is not None:
        rates["microphone"] = station.microphone.rate
    return rates


def samples(reading: Reading) -> int:
    """How many samples a reading holds: each count of a block is one, a remark on a capture is none."""
    if reading.channel.name in _REMARKS:
        return 0
    return int(reading.values.size) if reading.channel.name in _IN_BLOCKS else len(reading.times)


def artefacts(run: RunFiles) -> tuple[Artefact, ...]:
    """The gel's calibration and, where the run was to be heard, that of the hammer's box."""
    header, acquisition = run.calibration.header, run.acquisition
    gel = Artefact(
        name=f"tactile optics of {header.sensor}",
        serial=header.serial,
        made=header.date,
        age_days=_age(run, header.date),
        residual=f"{header.held_out_db:.1f} dB on presses held out, {header.residual_rms:.1f} counts rms",
        sha256=run.calibration.sha256,
    )
    return (gel,) if acquisition is None else (gel, _of_box(run, acquisition))


def _of_box(run: RunFiles, box: AcquisitionCalibration) -> Artefact:
    return Artefact(
        name=f"newtons and pascals of {box.model}",
        serial=f"{box.serial}, hammer {box.hammer_serial}, microphone {box.microphone_serial}",
        made=box.date,
        age_days=_age(run, box.date),
        residual=f"{100.0 * box.residual:.1f} % of {box.made_from}",
        sha256=box.hash,
    )


def _age(run: RunFiles, date: str) -> float:
    """Days from an artefact's date to the run."""
    made = dt.datetime.fromisoformat(date)
    made = made if made.tzinfo is not None else made.replace(tzinfo=dt.UTC)
    age = dt.datetime.fromisoformat(run.recording.header.created) - made
    return age.total_seconds() / 86400.0
