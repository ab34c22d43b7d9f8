"""How each kind of reading is written as messages of Foxglove's well-known schemas.

A viewer that knows those schemas shows a run without conversion; numbers that have no
well-known form are JSON with a schema. Every codec returns what it was given, to the bit.
"""

import json
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from foxglove_schemas_protobuf.CompressedImage_pb2 import CompressedImage
from foxglove_schemas_protobuf.FrameTransform_pb2 import FrameTransform
from foxglove_schemas_protobuf.JointStates_pb2 import JointStates
from foxglove_schemas_protobuf.RawAudio_pb2 import RawAudio
from google.protobuf.message import Message
from google.protobuf.timestamp_pb2 import Timestamp
from mcap_protobuf.schema import build_file_descriptor_set

from harness.basics.arrays import AnyArray
from harness.basics.errors import RecordingDamaged
from harness.bench.acquisition_channels import FORCE, PRESSURE
from harness.bench.reading import Channel, Reading
from harness.picture.jpeg import decode_jpeg
from harness.picture.picture_size import require_modest_picture

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
    """One way to write a sample.

    Attributes:
        schema: name, encoding and bytes of the MCAP schema.
        encoding: of the messages: ``"protobuf"`` or ``"json"``.
        encode: from a reading, the index of a sample and its wall time in ns, to bytes.
        decode: from bytes and the channel, to the value and the bytes it arrived as (or none).
    """

    schema: tuple[str, str, bytes]
    encoding: str
    encode: Callable[[Reading, int, int], bytes]
    decode: Callable[[bytes, Channel], tuple[AnyArray, bytes]]


def codec_of(channel: Channel) -> Codec:
    """The codec of a channel, by its name; JSON numbers where no well-known schema fits."""
    if channel.name.endswith(".image"):
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
