"""One ball press by the arm: travel, look, sink in step by step, wait until it is still, look, retreat.

A ball of two millimetres pushes back by a tenth of a newton, which no force sensor in an arm's wrist tells
from nothing. The picture does: it shows a ball that is a few hundredths of a millimetre deep.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace

import numpy as np

from calibration.taxim.arm.channels import DESCENT, STATE, UNREST, UNTOUCHED, WAY
from calibration.taxim.arm.plan import PressMotion, PressSettings, settings_of
from calibration.taxim.arm.settled import Settling, look, settle
from calibration.taxim.arm.watch import PressWatch, touch_seen
from harness.basics.arrays import FloatArray
from harness.basics.errors import BenchFault, NotTouched
from harness.bench.reading import Channel, Reading
from harness.bench.station import PRESS, Bench
from harness.bench.travel import Trajectory, travel
from harness.recording.recording import Recording
from harness.recording.step_file import Step

AT_REST = 0.2
"""s of the arm's packets that are kept with a picture."""

MISSES = 3
"""Presses in a row that met nothing, after which the ball is taken to be somewhere else."""


_TRAVEL, _TRAVEL_ACCELERATION = 0.9, 1.2
"""rad/s and rad/s^2 of the fastest joint between presses."""

_APPROACH, _PRESS = 0.040, 0.005
"""m/s: down to where looking begins, and back; of a step."""

_ACCELERATION = 0.2
"""m/s^2 of every straight line."""


class BallPresses:
    """Presses the gel on a ball where the plan says, and hands on what was seen.

    Args:
        way: used where the arm is not where a step's travel was planned from.
        ball: radius in pixels, by the stated pitch.
        say: is told in words how each press went.
    """

    def __init__(self, way: Trajectory, ball: float, say: Callable[[str], None] = lambda _: None) -> None:
        self._way = way
        self._ball = ball
        self._say = say
        self._settings = PressSettings()
        self._watch = PressWatch(ball)

    def steps(self, recording: Recording) -> Iterator[Step]:
        """What is not yet on the disk.

        Raises:
            NotTouched: several presses in a row met nothing.
            CalibrationRefused: most presses so far are refused, or light or gel have drifted.
        """
        self._settings = settings_of(dict(recording.header.plan))
        self._watch = PressWatch.of(recording, self._ball)
        for index, planned in enumerate(recording.planned("steps")):
            if index >= recording.committed:
                self._watch.require_sense(MISSES)
                yield Step(index, planned["kind"], planned["parameters"])

    def perform(self, step: Step, bench: Bench) -> Sequence[Reading]:
        """One press or one look at the untouched gel; the arm ends at the stand-off."""
        motion = PressMotion.from_parameters(dict(step.parameters))
        bench.mark(step.index, -1)
        self._travel(motion, bench)
        rest = settle(bench.gel, bench.pause, self._settings.still)
        self._watch.require_light(look(rest.frames))
        if step.kind == "background":
            readings = self._background(step, rest, bench)
        else:
            try:
                readings = self._press(step, motion, rest, bench)
            except BenchFault:
                self._back(bench, motion)  # the camera failed and the arm is well: not left pressed
                raise
        self._say(self._watch.seen(step, {reading.channel.name: reading for reading in readings}))
        return readings

    def _background(self, step: Step, rest: Settling, bench: Bench) -> tuple[Reading, ...]:
        if not rest.settled:
            raise BenchFault(
                f"step {step.index + 1}: the picture of the untouched gel did not come to rest in "
                f"{rest.seconds:.1f} s (it changes by {rest.unrest[-1]:.1f} grey levels from look to look, "
                f"at most {self._settings.still.limit:g} are wanted): is something moving before the gel, "
                "does a light flicker, does the exposure adapt? Fix it and go on with --resume"
            )
        bench.mark(step.index, PRESS)
        return (rest.frames, *_numbers(rest, touched=False), *bench.arm.history(AT_REST))

    def _press(self, step: Step, motion: PressMotion, rest: Settling, bench: Bench) -> tuple[Reading, ...]:
        seen, way = self._descend(motion, look(rest.frames), bench)
        touched = bool(seen)
        if touched:
            self._to(bench, motion, min(way[0] + self._settings.depth, motion.lowest), _PRESS)
        pressed = settle(bench.gel, bench.pause, self._settings.still)
        bench.mark(step.index, PRESS)
        history = bench.arm.history(AT_REST)
        self._back(bench, motion)
        descent = (_joined(DESCENT, seen), _way(seen, way)) if touched else ()
        return (
            pressed.frames,
            _renamed(UNTOUCHED, rest.frames),
            *descent,
            *_numbers(pressed, touched),
            *history,
        )

    def _descend(
        self, motion: PressMotion, rest: FloatArray, bench: Bench
    ) -> tuple[list[Reading], list[float]]:
        """Looks on the way down from the first that shows the ball on, and how far down each was; or none."""
        known = self._watch.offset
        ways = (self._settings.far,) if known is None else (self._settings.ahead, self._settings.far)
        for ahead in ways:
            seen, way = self._looks(motion, motion.touch + (known or 0.0) - ahead, rest, bench)
            if not seen or way[0] > motion.touch + (known or 0.0) - ahead:
                return seen, way
        # It was met at once, even from afar: how deep it is there is not known.
        raise NotTouched(
            f"the gel is touched {1e3 * self._settings.far:.1f} mm above where the scene says the ball is: "
            "something else is before it, or the ball stands higher; correct [object.pose] and begin again"
        )

    def _looks(
        self, motion: PressMotion, first: float, rest: FloatArray, bench: Bench
    ) -> tuple[list[Reading], list[float]]:
        wanted, last = self._settings, motion.lowest - self._settings.depth
        seen: list[Reading] = []
        way: list[float] = []
        down = max(first, 0.0)
        self._to(bench, motion, down, _APPROACH)
        while down <= last and len(seen) < wanted.pictures:
            # The frame before the last may have been exposed while the arm still moved.
            frame = _last(bench.gel.read(2, wanted.still.timeout))
            if seen or touch_seen(look(frame) - rest) >= wanted.notice:
                seen.append(frame)
                way.append(down)
                last = min(way[0] + wanted.depth, motion.lowest - wanted.step)
            down += wanted.step
            if down <= last and len(seen) < wanted.pictures:
                self._to(bench, motion, down, _PRESS)
        return seen, way

    def _to(self, bench: Bench, motion: PressMotion, down: float, speed: float) -> None:
        """To ``down`` m from the stand-off along the axis."""
        pose = motion.base_from_stand_off.copy()
        pose[:3, 3] += down * motion.axis
        bench.arm.move_line(pose, speed, _ACCELERATION)

    def _back(self, bench: Bench, motion: PressMotion) -> None:
        self._to(bench, motion, 0.0, _APPROACH)

    def _travel(self, motion: PressMotion, bench: Bench) -> None:
        travel(bench, motion.start, motion.travel, self._way, _TRAVEL, _TRAVEL_ACCELERATION)


def _numbers(settling: Settling, touched: bool) -> tuple[Reading, Reading]:
    """Whether the ball was met, whether the picture came to rest and after how long; and its unrest."""
    end = settling.frames.times[-1:]
    state = np.array([[float(touched), float(settling.settled), settling.seconds]])
    unrest = settling.unrest
    times = end - 1e-3 * np.arange(len(unrest))[::-1]
    return (
        Reading(Channel(STATE, "1, 1, s", (3,), "float64"), end, state),
        Reading(Channel(UNREST, "count", (), "float64"), times, unrest),
    )


def _way(seen: list[Reading], way: list[float]) -> Reading:
    times = np.array([frame.times[-1] for frame in seen])
    return Reading(Channel(WAY, "m", (), "float64"), times, np.array(way))


def _last(frames: Reading) -> Reading:
    return Reading(frames.channel, frames.times[-1:], frames.values[-1:], frames.encoded[-1:])


def _renamed(name: str, frames: Reading) -> Reading:
    channel = replace(frames.channel, name=name)
    return Reading(channel, frames.times, frames.values, frames.encoded)


def _joined(name: str, seen: list[Reading]) -> Reading:
    channel = replace(seen[0].channel, name=name)
    times, values = (np.concatenate([getattr(one, part) for one in seen]) for part in ("times", "values"))
    return Reading(channel, times, values, tuple(frame for one in seen for frame in one.encoded))
