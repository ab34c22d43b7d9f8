"""A small step of every kind of channel, whose numbers are known without a file."""

from pathlib import Path

import cv2
import numpy as np

from harness.bench.acquisition_channels import FORCE
from harness.bench.device import Channel, Reading
from harness.picture.image_file import decode_jpeg
from harness.recording.recording import RunHeader
from harness.recording.step_file import Step, StepRecord

OFFSET_NS = 1_790_000_000_123_456_789
"""Wall clock minus bench clock."""

OLD_RUN = Path(__file__).parent / "recordings" / "schema_1"
"""A run of one step, ``sample_step()``, as it was recorded before files had checksums of their own."""


def sample_header(**changes: object) -> RunHeader:
    """Of a run that is nothing but a test."""
    fields: dict[str, object] = {
        "experiment": "test",
        "scene": {},
        "station": {},
        "plan": {},
        "files": {},
        "versions": {},
        "seed": 1,
        "mock": None,
        "clock_offset_ns": OFFSET_NS,
        "created": "2026-01-01T00:00:00+00:00",
    }
    return RunHeader(**{**fields, **changes})  # type: ignore[arg-type]


def joints(values: list[list[float]], start: float = 10.0) -> Reading:
    """Angles every 2 ms."""
    channel = Channel("arm.joints", "rad", (6,), "float64", "", 500.0)
    return Reading(channel, np.arange(len(values), dtype=np.float64) * 0.002 + start, np.array(values))


def poses(values: list[list[float]]) -> Reading:
    """Of the flange, every 2 ms."""
    channel = Channel("arm.base_from_flange", "m", (7,), "float64", "base", 500.0)
    return Reading(channel, np.arange(len(values), dtype=np.float64) * 0.002 + 1.0, np.array(values))


def wrenches(values: list[list[float]]) -> Reading:
    """Numbers without a well-known schema, every 2 ms."""
    channel = Channel("arm.wrench", "N", (6,), "float64", "base")
    return Reading(channel, np.arange(len(values), dtype=np.float64) * 0.002 + 1.0, np.array(values))


def images(count: int) -> Reading:
    """Noise of 12 x 16 pixels, every 40 ms."""
    rng = np.random.default_rng(0)
    pictures = rng.integers(0, 255, (count, 12, 16, 3), dtype=np.uint8)
    jpegs = tuple(cv2.imencode(".jpg", picture)[1].tobytes() for picture in pictures)
    channel = Channel("gel.image", "count", (12, 16, 3), "uint8", "gel", 25.0)
    return Reading(
        channel, np.arange(count, dtype=np.float64) * 0.04, np.array([decode_jpeg(j) for j in jpegs]), jpegs
    )


def counts(blocks: int) -> Reading:
    """Of the hammer, in blocks of 50 every 2.5 ms."""
    channel = Channel(FORCE, "count", (50,), "int32", "", 20_000.0)
    values = np.arange(blocks * 50, dtype=np.int32).reshape(blocks, 50) - 40
    return Reading(channel, np.arange(blocks, dtype=np.float64) * 0.0025 + 2.0, values)


def sample_step(index: int = 0) -> StepRecord:
    """One press with a strike."""
    read = [
        joints([[0.1 * k, -0.2, 1.5, k, 0.0, -1.0] for k in range(4)]),
        poses([[0.4, 0.01 * k, 0.2, 1.0, 0.0, 0.0, 0.0] for k in range(4)]),
        wrenches([[0.0, 0.1, -4.5, 0.0, 0.0, 0.001 * k] for k in range(3)]),
        images(2),
        counts(3),
    ]
    step = Step(index, "press", {"depth_m": 1e-3, "base_from_gel": [[1.0, 0.0], [0.0, 1.0]], "note": None})
    return StepRecord(step, {reading.channel.name: reading for reading in read}, 1.5)
