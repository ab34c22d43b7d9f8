"""A strike after a press: the hammer is brought before the same nominal place, fired, and listened to.

The arm stays clear of the object; only the striker's tip crosses the last millimetres. Where the
press has found the surface a little nearer or farther than planned, the strike follows it.
"""

import logging
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from harness.basics.arrays import FloatArray
from harness.basics.errors import BenchFault, WrongUse
from harness.basics.geometry import quaternion_from_rotation, translation
from harness.bench.device import HAMMER, MICROPHONE, Channel, Reading
from harness.bench.instruments.sound import capture
from harness.bench.microphone_take import BAD, take_of
from harness.bench.scene import SceneFile
from harness.bench.station import STRIKE, Bench
from harness.bench.station_file import Station
from harness.twin.bench import TwinBench
from harness.twin.motion import PlannedStrike, StrikePlanner

_LOG = logging.getLogger(__name__)

POSE = "hammer.base_from_flange"
"""Channel of the flange's pose when the striker was fired: x, y, z in m, then the quaternion."""

READY = "hammer.ready_joints"
"""Channel of the posture, rad, that a strike planned after its contact begins and ends in."""

BEFORE, AFTER = 0.02, 0.5
"""s recorded before and after the hammer touches."""

ON = 0.05
"""s for which the striker's output is on: a solenoid has come out after half of it."""

TIMEOUT = 1.0
TIMEOUT_BY_HAND = 60.0

ATTEMPTS = 3
"""Times that a strike is made where samples of it were lost: the next one is as good."""

FARTHEST = 0.01
"""m between the planned and the touched surface that a strike follows; beyond it nothing was rehearsed."""

Ask = Callable[[str], None]
"""Shows a person what to do now."""

_ARRAYS = ("start_rad", "travel_rad", "base_from_ready", "base_from_firing", "axis_in_base")


@dataclass(frozen=True, eq=False)
class StrikeMotion:
    """One strike, ready to be performed."""

    start: FloatArray  #: ``(6,)`` rad, where the travel was planned to start.
    travel: FloatArray  #: ``(n, 6)`` rad, joint way points to where the straight way begins.
    base_from_ready: FloatArray  #: ``(4, 4)`` of the flange, there.
    base_from_firing: FloatArray
    """``(4, 4)`` of the flange, the tip at its stand-off from the nominal surface."""
    axis: FloatArray  #: ``(3,)`` unit in base, the way of the strike.

    @classmethod
    def planned(cls, strike: PlannedStrike) -> "StrikeMotion":
        """The motion of a planned strike."""
        return cls(strike.start, strike.travel, strike.base_from_ready, strike.base_from_firing, strike.axis)

    def to_parameters(self) -> dict[str, Any]:
        """As JSON values, with the unit in each key."""
        return {
            "start_rad": self.start.tolist(),
            "travel_rad": self.travel.tolist(),
            "base_from_ready": self.base_from_ready.tolist(),
            "base_from_firing": self.base_from_firing.tolist(),
            "axis_in_base": self.axis.tolist(),
        }

    @classmethod
    def from_parameters(cls, parameters: Mapping[str, Any]) -> "StrikeMotion":
        """The motion that ``to_parameters`` wrote."""
        arrays = {name: np.asarray(parameters[name], dtype=np.float64) for name in _ARRAYS}
        return cls(
            arrays["start_rad"],
            arrays["travel_rad"].reshape(-1, 6),
            arrays["base_from_ready"],
            arrays["base_from_firing"],
            arrays["axis_in_base"],
        )


@dataclass(frozen=True)
class StrikeSpeeds:
    """How fast the arm may go near the object (SI)."""

    approach: float = 0.045  #: m/s on the straight way to the object and back.
    acceleration: float = 0.2  #: m/s^2.


def planner(
    scene: SceneFile, station: Station, bench: TwinBench, travels: TwinBench | None = None
) -> StrikePlanner | None:
    """Plans the strikes that the scene asks for and the arm is to make; None where there are none.

    ``travels`` is the twin that is travelled in, where it is another; see ``plan_contact``.

    Raises:
        WrongUse: the scene asks for sound and the station has no hammer.
    """
    if not scene.sensors.sound:
        return None
    hammer, flange_from_hammer = station.require_hammer()
    if hammer.strike != "arm":
        return None
    return StrikePlanner(bench, flange_from_hammer, hammer.stand_off, travels)


@dataclass(frozen=True)
class SearchGuard:
    """How a way is followed that may end at any place."""

    speed: float  #: m/s.
    force: float  #: N of resistance that end it.


def strike(
    motion: StrikeMotion,
    step: int,
    moved: float,
    bench: Bench,
    speeds: StrikeSpeeds | None = None,
    guard: SearchGuard | None = None,
) -> tuple[Reading, ...]:
    """Go before the object, fire, listen, go back; the arm begins and ends where the straight way does.

    Args:
        motion: planned.
        step: of the run.
        moved: m along the axis by which the touched surface lies behind the planned one.
        bench: with a hammer.
        speeds: of the straight way.
        guard: how the way to the object is followed where its shape is not known; None where it is.

    Returns:
        Nothing where the guarded way met something: nothing was struck.

    Raises:
        BenchFault: the surface is too far from where it was planned, or the hammer failed; the arm
            has then gone back.
    """
    speeds = speeds or StrikeSpeeds()
    if abs(moved) > FARTHEST:
        raise BenchFault(
            f"contact {step + 1}: the surface was touched {1e3 * moved:+.1f} mm from where it was planned; a "
            f"strike follows it by no more than {1e3 * FARTHEST:g} mm: check the object's pose in the scene"
        )
    output = bench.station.arm.striker_output
    assert output is not None

    def fire() -> None:
        try:
            bench.arm.set_digital_output(output, True)
            bench.pause(ON)
        finally:
            bench.arm.set_digital_output(output, False)

    there = translation(moved * motion.axis) @ motion.base_from_firing
    if guard is not None:
        way = float((there[:3, 3] - motion.base_from_ready[:3, 3]) @ motion.axis)
        bench.arm.zero_force()
        if meets(bench, motion.axis, way, guard):
            _LOG.warning("no strike: the hammer or what carries it met something before the place to strike")
            bench.arm.move_line(motion.base_from_ready, speeds.approach, speeds.acceleration)
            return ()
    bench.arm.move_line(there, speeds.approach, speeds.acceleration)
    try:
        bench.mark(step, STRIKE)
        state = bench.arm.state()
        flange = state.base_from_flange
        value = np.concatenate([flange[:3, 3], quaternion_from_rotation(flange[:3, :3])])
        channel = Channel(POSE, "m, 1", (7,), "float64", "base")
        pose = Reading(channel, np.array([state.time]), value[None])
        heard = _captured(bench, fire)
    finally:
        bench.arm.move_line(motion.base_from_ready, speeds.approach, speeds.acceleration)
    return (pose, *heard)


def strike_by_hand(step: int, bench: Bench, ask: Ask | None) -> tuple[Reading, ...]:
    """Ask a person to strike the place that was just touched, and listen.

    Args:
        step: of the run.
        bench: with a hammer.
        ask: shows the question; None where nobody is there to answer.

    Raises:
        WrongUse: nobody is there.
        BenchFault: the hammer failed.
    """
    ask = somebody(ask)
    bench.mark(step, STRIKE)
    what = f"contact {step + 1}: strike the place that was touched, along the way of the gel, within"
    return _capture(bench, lambda: ask(f"{what} {TIMEOUT_BY_HAND:.0f} s"), TIMEOUT_BY_HAND)


def by_hand(scene: SceneFile, station: Station) -> bool:
    """Whether a person is to strike."""
    return scene.sensors.sound and station.hammer is not None and station.hammer.strike == "operator"


def somebody(ask: Ask | None) -> Ask:
    """``ask``.

    Raises:
        WrongUse: it is None: nobody is there to strike.
    """
    if ask is None:
        raise WrongUse(
            "the station says hammer.strike = 'operator', and nobody can be asked here; run without --json "
            "at a terminal, or let the arm strike (strike = 'arm')"
        )
    return ask


def _captured(bench: Bench, fire: Callable[[], None]) -> tuple[Reading, ...]:
    """The strike, repeated where samples of it were lost; the last attempt as it is, flagged."""
    for _ in range(ATTEMPTS - 1):
        try:
            heard = _capture(bench, fire, TIMEOUT)
            take = take_of({reading.channel.name: reading for reading in heard})
            if take is None or not take.flags & BAD:
                return heard
            _LOG.warning("the strike is repeated: %s", take.fault)
        except BenchFault as fault:
            _LOG.warning("the strike is repeated: %s", fault)
    return _capture(bench, fire, TIMEOUT)


def _capture(bench: Bench, fire: Callable[[], None], timeout: float) -> tuple[Reading, ...]:
    return capture(bench.get(HAMMER), bench.find(MICROPHONE), fire, BEFORE, AFTER, timeout)


def meets(bench: Bench, axis: FloatArray, travel: float, guard: SearchGuard) -> bool:
    """Move along an axis until something resists; a long way in pieces, as the station limits a search.

    Args:
        bench: whose arm moves.
        axis: ``(3,)`` unit in base.
        travel: m.
        guard: how.

    Returns:
        False where nothing was met; the arm is then at the end of the way.
    """
    left, longest = travel, bench.station.arm.safety.travel
    while left > longest:
        if bench.arm.move_until_contact(axis, guard.speed, guard.force, longest):
            return True
        left -= longest
    return bench.arm.move_until_contact(axis, guard.speed, guard.force, left)
