"""One step of a run as one MCAP file: on disk whole, or not at all."""

import json
from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
from mcap.reader import make_reader
from mcap.writer import CompressionType, Writer

from harness.basics.arrays import AnyArray
from harness.basics.errors import RecordingDamaged
from harness.basics.whole_file import write_bytes_whole
from harness.bench.reading import Channel, Reading
from harness.recording.checksums import UNSUMMED_LIBRARY, has_checksum, is_intact, with_checksum
from harness.recording.codecs import codec_of


@dataclass(frozen=True)
class Step:
    """One indivisible piece of an experiment: all of it is performed and recorded, or none.

    Attributes:
        index: from 0, without gaps.
        kind: what is done, for example ``"press"``.
        parameters: what was asked for, JSON values with the unit in the key.
    """

    index: int
    kind: str
    parameters: Mapping[str, Any]


@dataclass(frozen=True)
class StepRecord:
    """A step as it was performed.

    Attributes:
        step: what was asked for.
        readings: by channel name.
        seconds: how long it took on the bench.
    """

    step: Step
    readings: Mapping[str, Reading]
    seconds: float


def write_step(path: Path, record: StepRecord, clock_offset_ns: int) -> None:
    """Write beside ``path``, flush to the disk, then rename: a crash leaves the whole file or none.

    Args:
        path: of the file.
        record: readings of the step, on the bench clock of its session.
        clock_offset_ns: wall clock minus bench clock of that session; the file keeps it.
    """
    write_bytes_whole(path, with_checksum(_encoded(record, clock_offset_ns)))


def _encoded(record: StepRecord, clock_offset_ns: int) -> bytes:
    stream = BytesIO()
    # JPEG does not compress again; the numbers are few.
    writer = Writer(stream, compression=CompressionType.NONE)
    writer.start(profile="", library=UNSUMMED_LIBRARY)
    for reading in record.readings.values():
        _write_reading(writer, reading, clock_offset_ns)
    described = {
        "step": asdict(record.step),
        "seconds": record.seconds,
        "clock_offset_ns": clock_offset_ns,
    }
    writer.add_metadata("touchstone.step", {"json": json.dumps(described, allow_nan=False)})
    writer.finish()  # type: ignore[no-untyped-call]  # mcap leaves it unannotated
    return stream.getvalue()


def _write_reading(writer: Writer, reading: Reading, clock_offset_ns: int) -> None:
    codec = codec_of(reading.channel)
    name, encoding, data = codec.schema
    schema_id = writer.register_schema(name=name, encoding=encoding, data=data)
    channel_id = writer.register_channel(
        topic=reading.channel.name,
        message_encoding=codec.encoding,
        schema_id=schema_id,
        metadata={"channel": json.dumps(asdict(reading.channel))},
    )
    for index, time in enumerate(reading.times):
        wall_ns = round(float(time) * 1e9) + clock_offset_ns
        writer.add_message(
            channel_id=channel_id,
            log_time=wall_ns,
            publish_time=wall_ns,
            sequence=index,
            data=codec.encode(reading, index, wall_ns),
        )


def read_step(path: Path, clock_offset_ns: int, summed: bool = True) -> StepRecord:
    """The step of a file.

    Args:
        path: of the file.
        clock_offset_ns: wall clock minus bench clock, for files that do not keep that of their session.
        summed: whether the file must carry a checksum; only runs of schema 1 hold files without.

    Raises:
        RecordingDamaged: missing, or other bytes than were written; the file is named.
    """
    return step_of(_read(path), path, clock_offset_ns, summed)


def step_of(data: bytes, path: Path, clock_offset_ns: int, summed: bool = True) -> StepRecord:
    """Decode the bytes of a step file; the arguments are those of ``read_step``."""
    _require_intact(data, path, summed)
    try:
        return _decoded(data, clock_offset_ns)
    # Without a checksum the libraries that decode a file meet any bytes, and fail on them in any way.
    except Exception as error:
        raise _damaged(path, "it does not decode") from error


def _read(path: Path) -> bytes:
    try:
        return path.read_bytes()
    except OSError as error:
        raise RecordingDamaged(f"{path} cannot be read: {(error.strerror or str(error)).lower()}") from error


def _require_intact(data: bytes, path: Path, summed: bool) -> None:
    if (summed or has_checksum(data)) and not is_intact(data):
        raise _damaged(path, "its bytes do not agree with its checksum")


def read_wall_span(path: Path, summed: bool = True) -> tuple[int, int] | None:
    """Read a step's first and last time stamp, in ns of the wall clock; None for a step without readings.

    Args:
        path: of the file.
        summed: whether the file must carry a checksum.

    Raises:
        RecordingDamaged: missing, or other bytes than were written.
    """
    data = _read(path)
    _require_intact(data, path, summed)
    try:
        summary = make_reader(BytesIO(data)).get_summary()
        statistics = None if summary is None else summary.statistics
    # Without a checksum the library meets any bytes, and fails on them in any way.
    except Exception as error:
        raise _damaged(path, "it does not decode") from error
    if statistics is None or statistics.message_count == 0:
        return None
    return statistics.message_start_time, statistics.message_end_time


def _damaged(path: Path, why: str) -> RecordingDamaged:
    return RecordingDamaged(
        f"{path}: not a step as it was recorded: {why}; delete this file and every later step, then resume "
        "the run"
    )


def _decoded(data: bytes, clock_offset_ns: int) -> StepRecord:
    reader = make_reader(BytesIO(data), validate_crcs=True)
    described = next(json.loads(m.metadata["json"]) for m in reader.iter_metadata())
    messages = [
        (channel.metadata["channel"], message.log_time, message.data)
        for _, channel, message in reader.iter_messages(log_time_order=False)
    ]
    clock_offset_ns = int(described.get("clock_offset_ns", clock_offset_ns))
    step = Step(**described["step"])
    return StepRecord(step, _readings(messages, clock_offset_ns), float(described["seconds"]))


def _readings(messages: Iterable[tuple[str, int, bytes]], clock_offset_ns: int) -> dict[str, Reading]:
    grouped: dict[str, list[tuple[int, bytes]]] = {}
    for channel_text, log_time, data in messages:
        grouped.setdefault(channel_text, []).append((log_time, data))
    readings = (_reading(_channel(text), samples, clock_offset_ns) for text, samples in grouped.items())
    return {reading.channel.name: reading for reading in readings}


def _channel(text: str) -> Channel:
    fields = json.loads(text)
    return Channel(**{**fields, "shape": tuple(fields["shape"])})


def _reading(channel: Channel, samples: list[tuple[int, bytes]], clock_offset_ns: int) -> Reading:
    codec = codec_of(channel)
    decoded: list[tuple[AnyArray, bytes]] = [codec.decode(data, channel) for _, data in samples]
    times = np.array([(wall_ns - clock_offset_ns) / 1e9 for wall_ns, _ in samples])
    encoded = tuple(data for _, data in decoded) if decoded[0][1] else ()
    return Reading(channel, times, np.array([value for value, _ in decoded]), encoded)
