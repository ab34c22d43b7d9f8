"""One step of a run as one MCAP file: on disk whole, or not at all.

Each kind of reading is written as messages of Foxglove's well-known schemas: a viewer that knows them shows
a run without conversion. Numbers that have no well-known form are JSON with a schema. Every codec returns
what it was given, to the bit.

MCAP's checksums cover the messages alone: not what a step was asked to do, nor what its channels mean. So a
step file carries the SHA-256 of all of its bytes in its head, where viewers show it as the library's name;
the checksum's own place counts as zeros.
"""

import copy
import json
import threading
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass, replace
from hashlib import sha256
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
from foxglove_schemas_protobuf.CompressedImage_pb2 import CompressedImage
from foxglove_schemas_protobuf.FrameTransform_pb2 import FrameTransform
from foxglove_schemas_protobuf.JointStates_pb2 import JointStates
from foxglove_schemas_protobuf.RawAudio_pb2 import RawAudio
from google.protobuf.message import Message
from google.protobuf.timestamp_pb2 import Timestamp
from mcap.reader import make_reader
from mcap.writer import CompressionType, Writer
from mcap_protobuf.schema import build_file_descriptor_set

from harness.basics.arrays import AnyArray
from harness.basics.errors import RecordingDamaged
from harness.basics.whole_file import write_bytes_whole
from harness.bench.acquisition_channels import FORCE, PRESSURE
from harness.bench.device import Channel, Reading
from harness.picture.image_file import decode_jpeg, require_modest_picture

MAX_RECENT_BYTES = 64 * 2**20
"""Memory of decoded steps that are kept for the next reading."""


@dataclass(frozen=True)
class Step:
    """One indivisible piece of an experiment: all of it is performed and recorded, or none."""

    index: int  #: from 0, without gaps.
    kind: str  #: what is done, for example ``"press"``.
    parameters: Mapping[str, Any]  #: what was asked for, JSON values with the unit in the key.


@dataclass(frozen=True)
class StepRecord:
    """A step as it was performed."""

    step: Step  #: what was asked for.
    readings: Mapping[str, Reading]  #: by channel name.
    seconds: float  #: how long it took on the bench.


def write_step(path: Path, record: StepRecord, clock_offset_ns: int) -> None:
    """Write a step atomically: to a file next to ``path``, flushed to the disk, then renamed.

    The file includes the clock offset of the session, wall clock minus bench clock.
    """
    stream = BytesIO()
    # JPEG does not compress again; the numbers are few.
    writer = Writer(stream, compression=CompressionType.NONE)
    writer.start(profile="", library=UNSUMMED_LIBRARY)
    for reading in record.readings.values():
        _write_reading(writer, reading, clock_offset_ns)
    described = {"step": asdict(record.step), "seconds": record.seconds, "clock_offset_ns": clock_offset_ns}
    writer.add_metadata("touchstone.step", {"json": json.dumps(described, allow_nan=False)})
    writer.finish()  # type: ignore[no-untyped-call]  # mcap leaves it unannotated
    data = stream.getvalue()
    write_bytes_whole(path, data[: _SUM_AT.start] + _sum_of(data) + data[_SUM_AT.stop :])


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
    """Read the step of a file.

    ``clock_offset_ns``, wall clock minus bench clock, is for files that do not include it.
    Only files of runs of schema 1 need no checksum.

    Raises:
        RecordingDamaged: the file is missing, or its bytes are not those that were written.
    """
    return step_of(_read(path), path, clock_offset_ns, summed)


def step_of(data: bytes, path: Path, clock_offset_ns: int, summed: bool = True) -> StepRecord:
    """Decode the bytes of a step file; the arguments are those of ``read_step``."""
    _require_intact(data, path, summed)
    try:
        return _RECENT.decoded(data, clock_offset_ns)
    # Without a checksum the libraries that decode a file meet any bytes, and fail on them in any way.
    except Exception as error:
        raise _damaged(path, "it does not decode") from error


def _read(path: Path) -> bytes:
    try:
        return path.read_bytes()
    except OSError as error:
        raise RecordingDamaged(f"{path} cannot be read: {(error.strerror or str(error)).lower()}") from error


def _require_intact(data: bytes, path: Path, summed: bool) -> None:
    # Step files of schema 1 were written without a checksum.
    has_checksum = data[_TITLE_AT : _SUM_AT.start] == _TITLE.encode()
    if (summed or has_checksum) and not (has_checksum and data[_SUM_AT] == _sum_of(data)):
        raise _damaged(path, "its bytes do not agree with its checksum")


def read_wall_span(path: Path, summed: bool = True) -> tuple[int, int] | None:
    """Read a step's first and last time stamp, in ns of the wall clock; None for a step without readings.

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
    grouped: dict[tuple[str, str], list[tuple[int, bytes]]] = {}
    for _, source, message in reader.iter_messages(log_time_order=False):
        key = source.metadata["channel"], source.message_encoding
        grouped.setdefault(key, []).append((message.log_time, message.data))
    clock_offset_ns = int(described.get("clock_offset_ns", clock_offset_ns))
    step = Step(**described["step"])
    readings: dict[str, Reading] = {}
    for (text, encoding), samples in grouped.items():
        fields = json.loads(text)
        channel = Channel(**{**fields, "shape": tuple(fields["shape"])})
        # Images of the bare bench were once written as JSON numbers.
        codec = _NUMBERS if encoding == _NUMBERS.encoding else codec_of(channel)
        decoded: list[tuple[AnyArray, bytes]] = [codec.decode(data, channel) for _, data in samples]
        times = np.array([(wall_ns - clock_offset_ns) / 1e9 for wall_ns, _ in samples])
        encoded = tuple(data for _, data in decoded) if decoded[0][1] else ()
        readings[channel.name] = Reading(channel, times, np.array([value for value, _ in decoded]), encoded)
    return StepRecord(step, readings, float(described["seconds"]))


class _RecentSteps:
    """Steps that were decoded last: an answer and its report read each step several times.

    A step is found by the SHA-256 of its bytes, so that it is never out of date; readings cannot be changed.
    """

    def __init__(self) -> None:
        self._steps: dict[tuple[bytes, int], StepRecord] = {}
        self._lock = threading.Lock()

    def decoded(self, data: bytes, clock_offset_ns: int) -> StepRecord:
        """Decode the bytes of a step file, or return the step of the same bytes."""
        key = sha256(data).digest(), clock_offset_ns
        with self._lock:
            record = self._steps.pop(key, None)
        if record is None:
            record = _decoded(data, clock_offset_ns)
        with self._lock:
            self._steps[key] = record
            while len(self._steps) > 1 and sum(map(_size, self._steps.values())) > MAX_RECENT_BYTES:
                self._steps.pop(next(iter(self._steps)))
        step = replace(record.step, parameters=copy.deepcopy(record.step.parameters))
        return replace(record, step=step, readings=dict(record.readings))


def _size(record: StepRecord) -> int:
    """Memory of the samples of a step, in bytes."""
    readings = record.readings.values()
    return sum(each.times.nbytes + each.values.nbytes + sum(map(len, each.encoded)) for each in readings)


_RECENT = _RecentSteps()

_JSON_SCHEMA = {
    "type": "object",
    "properties": {
        "timestamp": {
            "type": "object",
            "properties": {"sec": {"type": "integer"}, "nsec": {"type": "integer"}},
        },
        "values": {"type": "array", "items": {"type": "number"}},
    },
    "required": ["timestamp", "values"],
}


@dataclass(frozen=True)
class Codec:
    """One way to write a sample."""

    schema: tuple[str, str, bytes]  #: name, encoding and bytes of the MCAP schema.
    encoding: str  #: of the messages: ``"protobuf"`` or ``"json"``.
    encode: Callable[[Reading, int, int], bytes]
    """from a reading, the index of a sample and its wall time in ns, to bytes."""
    decode: Callable[[bytes, Channel], tuple[AnyArray, bytes]]
    """from bytes and the channel, to the value and the bytes it arrived as (or none)."""


def codec_of(channel: Channel) -> Codec:
    """The codec of a channel, by its name; JSON numbers where no well-known schema fits."""
    if channel.name.endswith((".image", ".bare")):
        return _IMAGE
    return _BY_NAME.get(channel.name, _NUMBERS)


def _stamp(wall_ns: int) -> Timestamp:
    return Timestamp(seconds=wall_ns // 10**9, nanos=wall_ns % 10**9)


def _protobuf(
    message: type[Message],
    encode: Callable[[Reading, int, int], Message],
    decode: Callable[[bytes, Channel], tuple[AnyArray, bytes]],
) -> Codec:
    schema = (
        message.DESCRIPTOR.full_name,
        "protobuf",
        build_file_descriptor_set(message).SerializeToString(),
    )
    return Codec(schema, "protobuf", lambda r, k, ns: encode(r, k, ns).SerializeToString(), decode)


def _encode_image(reading: Reading, index: int, wall_ns: int) -> Message:
    if not reading.encoded:
        raise ValueError(
            f"{reading.channel.name}: an image is recorded as the JPEG it arrived as; none given"
        )
    return CompressedImage(
        timestamp=_stamp(wall_ns),
        frame_id=reading.channel.frame,
        data=reading.encoded[index],
        format="jpeg",
    )


def _decode_image(data: bytes, _: Channel) -> tuple[AnyArray, bytes]:
    jpeg = CompressedImage.FromString(data).data
    require_modest_picture(jpeg, "an image", RecordingDamaged)
    return decode_jpeg(jpeg, RecordingDamaged), jpeg


def _encode_joints(reading: Reading, index: int, wall_ns: int) -> Message:
    message = JointStates(timestamp=_stamp(wall_ns))
    for number, angle in enumerate(reading.values[index]):
        message.joints.add(name=f"joint_{number + 1}", position=float(angle))
    return message


def _decode_joints(data: bytes, _: Channel) -> tuple[AnyArray, bytes]:
    joints = JointStates.FromString(data).joints
    return np.array([joint.position for joint in joints]), b""


def _encode_pose(reading: Reading, index: int, wall_ns: int) -> Message:
    x, y, z, qw, qx, qy, qz = (float(value) for value in reading.values[index])
    message = FrameTransform(timestamp=_stamp(wall_ns), parent_frame_id="base", child_frame_id="flange")
    message.translation.x, message.translation.y, message.translation.z = x, y, z
    message.rotation.w, message.rotation.x = qw, qx
    message.rotation.y, message.rotation.z = qy, qz
    return message


def _decode_pose(data: bytes, _: Channel) -> tuple[AnyArray, bytes]:
    message = FrameTransform.FromString(data)
    t, q = message.translation, message.rotation
    return np.array([t.x, t.y, t.z, q.w, q.x, q.y, q.z]), b""


def _encode_audio(reading: Reading, index: int, wall_ns: int) -> Message:
    """A block of raw counts; in 16 bits where they fit, which is what viewers play."""
    counts = reading.values[index]
    name = "pcm-s16" if np.array_equal(counts, counts.astype(np.int16)) else "pcm-s32"
    return RawAudio(
        timestamp=_stamp(wall_ns),
        data=counts.astype(_SAMPLES[name]).tobytes(),
        format=name,
        sample_rate=round(reading.channel.nominal_rate or 0.0),
        number_of_channels=1,
    )


def _decode_audio(data: bytes, channel: Channel) -> tuple[AnyArray, bytes]:
    message = RawAudio.FromString(data)
    if message.format not in _SAMPLES:
        raise RecordingDamaged(f"{channel.name}: a block of the unknown format {message.format!r}")
    return np.frombuffer(message.data, _SAMPLES[message.format]).astype(channel.dtype), b""


def _encode_numbers(reading: Reading, index: int, wall_ns: int) -> bytes:
    sample = np.asarray(reading.values[index], dtype=np.float64).ravel().tolist()
    stamp = {"sec": wall_ns // 10**9, "nsec": wall_ns % 10**9}
    return json.dumps({"timestamp": stamp, "values": sample}, allow_nan=False).encode()


def _decode_numbers(data: bytes, channel: Channel) -> tuple[AnyArray, bytes]:
    values = np.array(json.loads(data)["values"], dtype=channel.dtype)
    return values.reshape(channel.shape), b""


_SAMPLES = {"pcm-s16": "<i2", "pcm-s32": "<i4"}
"""Formats of the RawAudio schema, little-endian; the second goes beyond what it names."""

_IMAGE = _protobuf(CompressedImage, _encode_image, _decode_image)
_NUMBERS = Codec(
    ("touchstone.Numbers", "jsonschema", json.dumps(_JSON_SCHEMA).encode()),
    "json",
    _encode_numbers,
    _decode_numbers,
)
_AUDIO = _protobuf(RawAudio, _encode_audio, _decode_audio)
_BY_NAME = {
    FORCE: _AUDIO,
    PRESSURE: _AUDIO,
    "arm.joints": _protobuf(JointStates, _encode_joints, _decode_joints),
    "arm.base_from_flange": _protobuf(FrameTransform, _encode_pose, _decode_pose),
}


_TITLE = "touchstone step 2 sha256 "
_BLANK = "0" * 64
UNSUMMED_LIBRARY = _TITLE + _BLANK
"""The library's name of a step file whose checksum is still to be filled in."""

_TITLE_AT = 25
"""Bytes of an MCAP file before the library's name: magic, the head's opcode and length, an empty profile."""
_SUM_AT = slice(_TITLE_AT + len(_TITLE), _TITLE_AT + len(UNSUMMED_LIBRARY))


def _sum_of(step_file: bytes) -> bytes:
    state = sha256(step_file[: _SUM_AT.start])
    state.update(_BLANK.encode())
    state.update(memoryview(step_file)[_SUM_AT.stop :])
    return state.hexdigest().encode()
