"""Whatever happens to the bytes of a run's files: they are refused by name, or the values are unchanged."""

import itertools
import json
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import TypeVar

import numpy as np
import pytest

from harness.basics.errors import RecordingDamaged
from harness.basics.files.json_file import CHECKSUM
from harness.recording.recording import Recording, RunHeader, header_of
from harness.recording.step_file import StepRecord, step_of
from tests.samples.recorded_step import OFFSET_NS, OLD_RUN, sample_header, sample_step
from tests.support.whole_run import in_process_run, touch_scene

R = TypeVar("R")

OLD_STEP = OLD_RUN / "steps" / "000.mcap"


@pytest.fixture
def run(tmp_path: Path) -> Recording:
    recording = Recording.create(tmp_path / "run", sample_header(plan={"contacts": [{"depth_m": 1e-3}]}))
    record = sample_step()
    recording.commit(record.step, list(record.readings.values()), record.seconds)
    return recording


def flipped(data: bytes, count: int, seed: int = 0) -> Iterator[bytes]:
    """So many copies with one bit of any byte changed."""
    random = np.random.default_rng(seed)
    for bit in random.permutation(8 * len(data))[:count]:
        changed = bytearray(data)
        changed[bit // 8] ^= 1 << bit % 8
        yield bytes(changed)


def truncated(data: bytes, step: int = 1) -> Iterator[bytes]:
    """Every length, or every so many, that is not the whole."""
    yield from (data[:length] for length in range(0, len(data), step))


def zeroed(data: bytes, count: int, longest: int = 4096, seed: int = 0) -> Iterator[bytes]:
    """So many copies with a block of zeros somewhere."""
    random = np.random.default_rng(seed)
    while count:
        first, length = int(random.integers(len(data))), int(random.integers(1, longest))
        changed = data[:first] + bytes(len(data[first : first + length])) + data[first + length :]
        if changed != data:
            count -= 1
            yield changed


def read_or_damage(read: Callable[[], R]) -> tuple[R | None, str | None]:
    """What is read, or what the refusal says; any other exception goes on."""
    try:
        return read(), None
    except RecordingDamaged as damage:
        return None, str(damage)


def refused(path: Path, data: bytes, summed: bool = True) -> bool:
    """Whether the file with these bytes is refused by name; any other exception is a failure."""
    _, damage = read_or_damage(partial(step_of, data, path, OFFSET_NS, summed))
    assert damage is None or str(path) in damage
    return damage is not None


def same(one: StepRecord, other: StepRecord) -> bool:
    return (
        one.step == other.step
        and one.seconds == other.seconds
        and one.readings.keys() == other.readings.keys()
        and all(
            again.channel == read.channel
            and again.values.tobytes() == read.values.tobytes()
            and again.encoded == read.encoded
            and np.allclose(again.times, read.times, rtol=0.0, atol=1e-9)
            for again, read in ((one.readings[name], other.readings[name]) for name in one.readings)
        )
    )


def test_a_step_reads_back(run: Recording) -> None:
    assert same(Recording(run.folder).step(0), sample_step())


def test_a_step_of_schema_1_reads_as_before() -> None:
    recording = Recording(OLD_RUN)
    assert recording.header == sample_header(schema=1)
    assert same(recording.step(0), sample_step())


def test_any_bit_that_flips_in_a_step_is_noticed(run: Recording) -> None:
    path = run.folder / "steps" / "000.mcap"
    assert all(refused(path, damaged) for damaged in flipped(path.read_bytes(), 3000))


def test_a_step_cut_anywhere_is_noticed(run: Recording) -> None:
    path = run.folder / "steps" / "000.mcap"
    assert all(refused(path, damaged) for damaged in truncated(path.read_bytes()))


def test_a_block_of_zeros_in_a_step_is_noticed(run: Recording) -> None:
    path = run.folder / "steps" / "000.mcap"
    assert all(refused(path, damaged) for damaged in zeroed(path.read_bytes(), 500))


def test_bytes_after_the_end_of_a_step_are_noticed(run: Recording) -> None:
    path = run.folder / "steps" / "000.mcap"
    assert refused(path, path.read_bytes() + b"\0")


@pytest.mark.slow
def test_no_damage_to_a_real_step_passes(tmp_path: Path) -> None:
    recording = in_process_run(tmp_path / "run", touch_scene(contacts=1), seed=0)
    data = (recording.folder / "steps" / "000.mcap").read_bytes()
    path = tmp_path / "000.mcap"
    assert not refused(path, data)
    for damage in (flipped(data, 3000), zeroed(data, 500), truncated(data)):
        assert all(refused(path, damaged) for damaged in damage)


def test_a_damaged_step_without_checksum_is_a_refusal_and_nothing_else(tmp_path: Path) -> None:
    data, path = OLD_STEP.read_bytes(), tmp_path / "000.mcap"
    for damage in (flipped(data, 600), zeroed(data, 100), truncated(data, 97)):
        assert sum(refused(path, damaged, summed=False) for damaged in damage) > 50


def test_a_message_without_checksum_is_held_to_the_crc_of_its_chunk(tmp_path: Path) -> None:
    data, path = OLD_STEP.read_bytes(), tmp_path / "000.mcap"
    at = data.index(b'"values": [0.0, 0.1, -4.5')
    assert refused(path, data[: at + 11] + b"7" + data[at + 12 :], summed=False)


def test_a_run_with_checksums_takes_no_step_without(run: Recording) -> None:
    path = run.folder / "steps" / "000.mcap"
    path.write_bytes(OLD_STEP.read_bytes())
    with pytest.raises(RecordingDamaged, match=r"000\.mcap"):
        run.step(0)


def headers(path: Path, damages: Iterator[bytes]) -> list[RunHeader]:
    """What is read of the damaged files that are not refused; any exception but the refusal is a failure."""
    found = []
    for damaged in damages:
        header, damage = read_or_damage(partial(header_of, damaged, path))
        assert damage is None or str(path) in damage
        found += [] if header is None else [header]
    return found


def test_run_json_is_refused_or_says_what_was_written(run: Recording) -> None:
    path = run.folder / "run.json"
    data = path.read_bytes()
    for damage in (flipped(data, 3000), truncated(data), zeroed(data, 300, 200)):
        # A blank between two values that becomes another blank changes none.
        assert all(header == run.header for header in headers(path, damage))


def test_run_json_of_schema_1_is_refused_or_a_header(tmp_path: Path) -> None:
    data, path = (OLD_RUN / "run.json").read_bytes(), tmp_path / "run.json"
    for damage in (flipped(data, 3000), truncated(data), zeroed(data, 300, 200)):
        for header in headers(path, damage):
            assert isinstance(header.scene, dict)
            assert isinstance(header.seed, int)


@pytest.mark.parametrize(
    "text",
    [
        "",
        "null",
        "[]",
        "3",
        '"run"',
        "[" * 100_000,
        '{"schema":' * 5000,
        "\ufeff{}",
        '{"schema": true}',
        "NaN",
    ],
    ids=lambda text: text[:12] or "empty",
)
def test_run_json_that_is_something_else(run: Recording, text: str) -> None:
    (run.folder / "run.json").write_text(text)
    with pytest.raises(RecordingDamaged, match=r"run\.json"):
        Recording(run.folder)


def test_a_value_of_run_json_of_schema_1_that_is_of_another_kind(tmp_path: Path) -> None:
    kinds = {name: type(value) for name, value in vars(sample_header(mock={})).items()}
    others = (None, "x", [1], {"a": 1}, 1.5, float("nan"))
    written = json.loads((OLD_RUN / "run.json").read_text())
    for key, value in itertools.product(kinds, others):
        data = json.dumps({**written, key: value}).encode()
        for header in headers(tmp_path / "run.json", iter([data])):
            read = vars(header)[key]
            assert type(read) is kinds[key] or (key == "mock" and read is None)


def test_a_plan_that_is_not_there_is_refused(run: Recording) -> None:
    assert run.planned("contacts") == [{"depth_m": 1e-3}]
    with pytest.raises(RecordingDamaged, match=r"run\.json"):
        run.planned("looks")


def test_a_value_of_run_json_that_was_changed_does_not_agree_with_its_checksum(run: Recording) -> None:
    """Another seed is a header like any other; only the checksum shows that it is not the run's."""
    path = run.folder / "run.json"
    fields = json.loads(path.read_text())
    for changed in (
        {**fields, "seed": fields["seed"] + 1},
        {k: v for k, v in fields.items() if k != CHECKSUM},
    ):
        path.write_text(json.dumps(changed))
        with pytest.raises(RecordingDamaged, match="checksum"):
            Recording(run.folder)
    path.write_text(json.dumps(fields))
    assert Recording(run.folder).header == run.header
    assert Recording(OLD_RUN).header.schema == 1
