"""Inside the child: the frames, the force guard, and how a motion ends, against a scripted link."""

import os
import subprocess
import sys
import threading
import time
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivers.ur import dashboard, pipe
from drivers.ur import motion as ur_motion
from drivers.ur.child import Child
from drivers.ur.motion import CAUSE_WITHIN, Motion, Outcome
from drivers.ur.state import safety_words
from drivers.ur.stream import Guard, Stream
from harness.basics.arrays import FloatArray
from harness.basics.clock import now
from harness.basics.errors import BenchFault, ProtectiveStop, SafetyStop, TouchstoneError

Z = np.array([0.0, 0.0, 1.0])
Json = st.recursive(
    st.none()
    | st.booleans()
    | st.integers(-(2**53), 2**53)
    | st.floats(allow_nan=False, allow_infinity=False)
    | st.text(max_size=20),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(max_size=8), inner, max_size=4),
    max_leaves=12,
)


@given(
    st.lists(st.dictionaries(st.text(max_size=8), Json, max_size=3), min_size=1, max_size=5),
    st.integers(1, 40),
)
def test_frames_read_back_as_written_however_they_are_cut(messages: list[pipe.Message], piece: int) -> None:
    raw = b"".join(pipe.message_frame(message) for message in messages)
    out, into = os.pipe()

    def write() -> None:
        for start in range(0, len(raw), piece):
            os.write(into, raw[start : start + piece])
        os.close(into)

    writer = threading.Thread(target=write)
    writer.start()
    try:
        assert [pipe.unpack_message(payload) for _, payload in pipe.read_frames(out)] == messages
    finally:
        writer.join()
        os.close(out)


def test_packets_keep_every_bit() -> None:
    packets = np.random.default_rng(0).standard_normal((5, pipe.WIDTH))
    payloads = [pipe.packet_frame(packet)[pipe.HEADER.size :] for packet in packets]
    assert np.array_equal(pipe.unpack_packets(payloads), packets)
    assert sum(part.stop - part.start for part in pipe.FIELDS.values()) == pipe.WIDTH


def test_a_frame_longer_than_an_atomic_write_or_not_finite_is_refused() -> None:
    with pytest.raises(ValueError, match=r"\d{4} bytes"):
        pipe.message_frame({"text": "x" * 5000})
    with pytest.raises(ValueError, match="JSON"):
        pipe.message_frame({"value": float("nan")})


def test_a_full_pipe_refuses_whole_frames_and_never_tears_one() -> None:
    out, into = os.pipe()
    os.set_blocking(into, False)
    frame = pipe.message_frame({"text": "y" * 900})
    count = 0
    while pipe.write_now(into, frame):
        count += 1
    with pytest.raises(pipe.PipeBroken):
        pipe.write_within(into, frame, 0.01)
    os.close(into)
    assert [len(payload) for _, payload in pipe.read_frames(out)] == [len(frame) - pipe.HEADER.size] * count
    os.close(out)


def test_writing_to_a_closed_pipe_says_so() -> None:
    out, into = os.pipe()
    os.close(out)
    with pytest.raises(pipe.PipeBroken):
        pipe.write_now(into, b"x")
    os.close(into)


@pytest.mark.parametrize(
    ("bits", "words"),
    [
        (0b1, "normal"),
        (0b11, "reduced"),
        (0b100_0000_0100, "protective stop"),
        (0b101_1100_0000, "emergency stop"),
        (1 << 4, "safeguard stop"),
        (1 << 8 | 1 << 2, "violation"),
        (0, "unknown (bits 0x0)"),
    ],
)
def test_the_gravest_safety_state_is_the_one_told(bits: int, words: str) -> None:
    assert safety_words(bits) == words


def a_packet(clock: float, force: float = 0.0, speed: float = 0.0, bits: int = 1) -> FloatArray:
    packet = np.zeros(pipe.WIDTH)
    packet[pipe.FIELDS["time"]] = packet[pipe.FIELDS["controller_time"]] = clock
    packet[pipe.FIELDS["wrench"]][:3] = force * Z
    packet[pipe.FIELDS["joint_speeds"]] = speed
    packet[pipe.FIELDS["safety_bits"]] = bits
    return packet


@dataclass
class ScriptedLink:
    """A link that does what it is told and remembers it."""

    rate: float = 500.0
    address: str = "127.99.99.98"
    accepts: bool = True
    alive: bool = True
    older: bool = False
    count: int = 7
    running: bool = False
    done: list[str] = field(default_factory=list)

    def start_joints(self, *_: Any) -> None:
        if not self.accepts:
            raise BenchFault("could not start")
        self.done.append("joints")

    def start_line(self, *_: Any) -> None:
        self.done.append("line")

    def brake(self) -> None:
        self.done.append("brake")

    def halt(self) -> None:
        self.done.append("halt")

    def progress(self) -> tuple[int, bool]:
        return self.count, self.running

    def program_running(self) -> bool:
        return self.alive

    def state_is_older(self) -> bool:
        return self.older

    def why(self) -> TouchstoneError:
        return BenchFault("the controller says: program stopped")


def scripted_link() -> Any:
    return ScriptedLink()


class Rig:
    """A stream fed by hand, a link, and one motion."""

    def __init__(self, **details: Any) -> None:
        self.link = scripted_link()
        self.sent: list[FloatArray] = []
        self.woken = 0
        self.stream = Stream(self.link, self.sent.append, self._wake)
        self.clock = 100.0
        self.feed()
        message = {"id": 1, "what": "the test motion", "joints": [0.0] * 6, "speed": 0.5, "acceleration": 1.0}
        limits = {"force_press": 10.0, "force_any": 25.0, "seconds": 5.0}
        self.motion = Motion.from_message({**message, **limits, **details}, force=self.stream.force)
        self.stream.watch(self.motion.guard)
        self.motion.start(self.link)

    def _wake(self) -> None:
        self.woken += 1

    def feed(self, force: float = 0.0, speed: float = 0.0, skip: int = 0, count: int = 1) -> None:
        for _ in range(count):
            self.clock += 0.002 * (1 + skip)
            self.stream._accept(a_packet(self.clock, force, speed), 0.002)

    def begin(self) -> None:
        self.link.count, self.link.running = 8, True
        self.feed(speed=0.5)

    def look(self) -> Outcome | None:
        return self.motion.look(self.link, self.stream)


def test_each_packet_is_sent_and_gaps_are_counted() -> None:
    rig = Rig()
    rig.feed(count=3)
    rig.feed(skip=4)
    rig.feed()
    assert rig.stream.packets == len(rig.sent) == 6
    assert rig.stream.drops == 4
    assert rig.sent[-1][pipe.FIELDS["drops"]][0] == 4


def test_a_motion_ends_at_rest_at_its_target() -> None:
    rig = Rig()
    rig.feed(count=3)
    assert rig.look() is None, "it has not begun"
    rig.begin()
    assert rig.look() is None
    rig.link.running = False
    assert rig.look() is None, "the joints still turn"
    rig.feed(count=3)
    assert rig.look() == Outcome(value=True)


def test_a_motion_that_ends_elsewhere_is_a_fault(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(ur_motion, "SETTLE_WITHIN", 0.0)
    rig = Rig(joints=[0.1] * 6)
    rig.begin()
    rig.link.running = False
    rig.feed(count=3)
    outcome = rig.look()
    assert outcome is not None
    assert isinstance(outcome.error, BenchFault)
    assert "0.1 rad" in str(outcome.error)


def test_a_motion_that_never_begins_is_a_fault(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(ur_motion, "START_WITHIN", 0.0)
    rig = Rig()
    outcome = rig.look()
    assert outcome is not None
    assert "did not begin" in str(outcome.error)
    assert outcome.latch, "it may begin yet"


def test_a_dead_script_s_cause_is_waited_for_but_not_for_long() -> None:
    rig = Rig()
    rig.begin()
    rig.link.alive, rig.link.older = False, True
    assert rig.look() is None
    rig.link.older = False
    outcome = rig.look()
    assert outcome is not None
    assert "was cut short" in str(outcome.error)
    silent = Rig()
    silent.link.alive, silent.link.older = False, True
    assert silent.look() is None
    time.sleep(1.1 * CAUSE_WITHIN)
    assert silent.look() is not None


def test_a_dead_script_is_told_with_its_cause() -> None:
    rig = Rig()
    rig.begin()
    rig.link.alive = False
    outcome = rig.look()
    assert outcome is not None
    assert "program stopped" in str(outcome.error)


def test_a_motion_past_its_deadline_is_braked() -> None:
    rig = Rig(seconds=0.0)
    rig.begin()
    assert rig.look() is None
    assert rig.link.done == ["joints", "brake"]
    rig.feed(count=3)
    outcome = rig.look()
    assert outcome is not None
    assert "speed slider" in str(outcome.error)


def test_contact_needs_two_packets_in_a_row_and_ends_with_true() -> None:
    rig = Rig(joints=None, pose=[0.0] * 6, contact=3.0, direction=[0.0, 0.0, -1.0])
    rig.begin()
    rig.feed(force=4.0, speed=0.1)
    rig.feed(force=0.0, speed=0.1)
    rig.feed(force=4.0, speed=0.1)
    assert rig.look() is None
    assert rig.link.done == ["line"]
    rig.feed(force=4.0, speed=0.1)
    assert rig.woken == 1
    assert rig.look() is None, "braking, not yet at rest"
    assert rig.link.done == ["line", "brake"]
    rig.feed(force=4.0, count=3)
    assert rig.look() == Outcome(value=True)


def test_a_search_that_arrives_without_contact_ends_with_false() -> None:
    rig = Rig(joints=None, pose=[0.0] * 6, contact=3.0, direction=[0.0, 0.0, -1.0])
    rig.begin()
    rig.link.running = False
    rig.feed(force=1.0, count=3)
    assert rig.look() == Outcome(value=False)


def test_beyond_the_press_limit_the_motion_is_braked_and_refused() -> None:
    rig = Rig()
    rig.begin()
    rig.feed(force=10.1, speed=0.1)
    assert rig.look() is None
    rig.feed(force=10.0, count=3)
    outcome = rig.look()
    assert outcome is not None
    assert isinstance(outcome.error, SafetyStop)
    assert not outcome.latch


def test_a_motion_that_begins_pressed_may_go_on_while_the_force_falls() -> None:
    rig = Rig()
    rig.feed(force=14.0)
    rig.motion = Motion.from_message({**_bare(), "joints": [0.0] * 6}, force=rig.stream.force)
    rig.stream.watch(rig.motion.guard)
    rig.motion.start(rig.link)
    rig.link.count, rig.link.running = 9, True
    for force in (14.2, 12.0, 11.0):
        rig.feed(force=force, speed=0.1)
        assert rig.look() is None
    assert "brake" not in rig.link.done
    rig.feed(force=14.6, speed=0.1)
    rig.look()
    assert "brake" in rig.link.done


def test_beyond_the_hard_limit_the_arm_is_stopped_twice_and_latched() -> None:
    rig = Rig()
    rig.begin()
    rig.feed(force=12.0, speed=0.1)
    rig.look()
    rig.feed(force=26.0, speed=0.1)
    assert rig.look() is None
    assert rig.link.done == ["joints", "brake", "halt"]
    rig.feed(count=3)
    outcome = rig.look()
    assert outcome is not None
    assert outcome.latch
    assert "26.0 N" in str(outcome.error)


def test_where_the_brake_hangs_the_program_is_ended_through_the_dashboard(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    ended = threading.Event()

    def stop(address: str) -> bool:
        ended.set()
        return address == ScriptedLink.address

    class Hanging(ScriptedLink):
        def brake(self) -> None:
            self.done.append("brake" if ended.wait(60.0) else "brake that hung")

    monkeypatch.setattr(dashboard, "stop", stop)
    rig = Rig()
    link: Any = Hanging()
    rig.link = link
    rig.begin()
    rig.feed(force=26.0, speed=0.1)
    rig.look()
    assert link.done == ["brake", "halt"]


def test_the_watchdog_is_kicked_on_a_fresh_state_only() -> None:
    kicks: list[float] = []

    class Kicked(ScriptedLink):
        patience = 0.1

        def kick(self) -> None:
            kicks.append(now())

    link: Any = Kicked()
    child = Child(link, -1, os.open(os.devnull, os.O_WRONLY))
    for age, expected in ((0.2, 0), (0.0, 1)):
        child._watchdog._kicked = now() - 0.05
        child._stream._accept(a_packet(now() - age), 0.002)
        child._kick()
        assert len(kicks) == expected
    os.close(child._parent._replies)


def test_a_motion_asked_for_before_a_stop_is_not_begun() -> None:
    class Patient(ScriptedLink):
        patience = 0.1

    link: Any = Patient()
    requests, into = os.pipe()
    out, replies = os.pipe()
    child = Child(link, requests, replies)
    child._parent.listen()
    move = {**_bare(), "do": "move", "joints": [0.0] * 6}
    for message in ({"do": "stop", "id": 1, "epoch": 1}, {**move, "id": 2, "epoch": 0}):
        os.write(into, pipe.message_frame(message))
    for _ in range(2):
        request = child._parent.next(5.0)
        assert request is not None
        child._stream._accept(a_packet(now()), 0.002)
        child._serve(request)
    assert link.done == []
    os.write(into, pipe.message_frame({**move, "id": 3, "epoch": 1}))
    request = child._parent.next(5.0)
    assert request is not None
    child._stream._accept(a_packet(now()), 0.002)
    child._serve(request)
    assert link.done == ["joints"], "one asked for after it is"
    os.close(replies)
    answers = [
        pipe.unpack_message(payload) for kind, payload in pipe.read_frames(out) if kind == pipe.MESSAGE
    ]
    assert [answer["id"] for answer in answers] == [1, 2]
    assert "a stop was requested before" in answers[1]["text"]
    os.close(out)


def test_an_arm_that_does_not_come_to_rest_is_stopped_through_the_dashboard(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(ur_motion, "STOP_WITHIN", 0.0)
    rig = Rig()
    rig.begin()
    rig.motion.stop(rig.link, Outcome(error=SafetyStop("asked")))
    with pytest.raises(BenchFault, match=r" s .*dashboard"):
        rig.look()
    assert rig.link.done == ["joints", "brake", "halt"]


def test_the_first_reason_to_stop_stands() -> None:
    rig = Rig()
    rig.begin()
    rig.motion.stop(rig.link, Outcome(error=SafetyStop("first")))
    rig.motion.stop(rig.link, Outcome(error=SafetyStop("second")))
    rig.feed(count=3)
    outcome = rig.look()
    assert outcome is not None
    assert str(outcome.error) == "first"
    assert rig.link.done.count("brake") == 1


def test_no_guard_no_trip() -> None:
    rig = Rig()
    rig.stream.watch(None)
    rig.feed(force=100.0)
    assert rig.stream.trip is None
    rig.stream.watch(Guard(10.0, 25.0, None, Z))
    rig.feed(force=9.9)
    assert rig.stream.trip is None


def test_the_child_itself_refuses_an_address_outside_this_computer() -> None:
    command = [
        sys.executable,
        "-m",
        "drivers.ur.child",
        "--address",
        "10.1.2.3",
        "--model",
        "ur5e",
        "--rate",
        "500",
    ]
    done = subprocess.run(command, stdin=subprocess.DEVNULL, capture_output=True, text=True, check=False)
    assert done.returncode != 0
    assert "real arm" in done.stderr


def _bare() -> pipe.Message:
    return {
        "id": 2,
        "what": "the retreat",
        "speed": 0.1,
        "acceleration": 1.0,
        "seconds": 5.0,
        "force_press": 10.0,
        "force_any": 25.0,
    }


@pytest.mark.parametrize("cause", [BenchFault, ProtectiveStop])
def test_a_call_that_the_library_could_not_make_is_told_with_the_controllers_state(
    cause: type[TouchstoneError],
) -> None:
    """The library says only that its call failed; a starved watchdog or a safety stop is why."""

    class Failing(ScriptedLink):
        patience = 0.1

        def why(self) -> TouchstoneError:
            assert not self.done, "asked while the controller still ran the program"
            return cause("its watchdog kept waiting for 300 ms")

    link: Any = Failing()
    out, replies = os.pipe()
    Child(link, -1, replies)._give_up(RuntimeError("isProgramRunning() function did not succeed!"))
    os.close(replies)
    ((_, payload),) = pipe.read_frames(out)
    os.close(out)
    told = pipe.unpack_message(payload)
    assert link.done == ["halt"]
    assert told["error"] == cause.__name__
    assert told["text"] == (
        "ur_rtde failed (isProgramRunning() function did not succeed!); its watchdog kept waiting for 300 ms"
    )


@dataclass
class AskedLink(ScriptedLink):
    """A link whose script ends while it is asked for joints, as often as it is told to."""

    patience: float = 0.1
    ends: int = 1
    asked: int = 0

    def reachable(self, pose: list[float], near: list[float]) -> bool:
        self.asked += 1
        if self.asked > self.ends:
            return True
        self.alive = False
        raise RuntimeError("getInverseKinematicsHasSolution() function did not succeed!")

    def revive(self) -> None:
        self.done.append("revive")
        self.alive = True

    def kick(self) -> None:
        pass


@pytest.mark.parametrize("case", ["late once", "late twice", "not late", "not at rest"])
def test_joints_are_asked_for_again_only_where_a_late_kick_ended_the_script(case: str) -> None:
    link: Any = AskedLink(ends=2 if case == "late twice" else 1)
    out, replies = os.pipe()
    child = Child(link, -1, replies)
    child._watchdog.start()
    for k in range(3):
        child._stream._accept(a_packet(100.0 + 0.002 * k, speed=0.5 if case == "not at rest" else 0.0), 0.002)
    if case != "not late":
        child._watchdog._kicked -= 1.0
    if case == "late once":
        assert child._reachable([0.0] * 6, [0.0] * 6)
        assert link.done == ["revive"]
    else:
        with pytest.raises(RuntimeError, match="did not succeed"):
            child._reachable([0.0] * 6, [0.0] * 6)
        assert link.done == {"late twice": ["revive"], "not late": ["halt"], "not at rest": []}[case]
    os.close(out)
    os.close(replies)


def test_a_latched_arm_switches_off_and_not_on() -> None:
    @dataclass
    class Switching(ScriptedLink):
        patience: float = 0.1

        def set_tool_output(self, index: int, on: bool) -> None:
            self.done.append(f"{index} {on}")

    link: Any = Switching()
    out, replies = os.pipe()
    child = Child(link, -1, replies)
    switch = {"do": "tool_output", "index": 0}
    child._serve({**switch, "id": 1, "on": True})
    child._latch(SafetyStop("a program of somebody else"))
    child._serve({**switch, "id": 2, "on": True})
    child._serve({**switch, "id": 3, "on": False})
    os.close(replies)
    answers = [pipe.unpack_message(payload) for _, payload in pipe.read_frames(out)]
    assert [answer["ok"] for answer in answers] == [True, False, True]
    assert link.done == ["0 True", "halt", "0 False"]
    os.close(out)


def test_the_arm_is_halted_even_where_its_state_cannot_be_told() -> None:
    class Speechless(ScriptedLink):
        patience = 0.1

        def why(self) -> TouchstoneError:
            raise IndexError("a packet without the field")

    link: Any = Speechless()
    with pytest.raises(IndexError):
        Child(link, -1, -1)._give_up(RuntimeError("isProgramRunning() function did not succeed!"))
    assert link.done == ["halt"]
