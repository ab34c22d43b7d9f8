"""One ball press by the arm: travel, look, sink in step by step, wait until it is still, look, retreat.

A ball of two millimetres pushes back by a tenth of a newton, which no force sensor in an arm's wrist tells
from nothing. The picture does: it shows a ball that is a few hundredths of a millimetre deep.
"""

from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial

import numpy as np
from scipy.ndimage import gaussian_filter

from calibration.taxim.arm.plan import PressMotion, PressSettings, plan_presses
from calibration.taxim.arm.record import (
    DESCENT,
    IMAGE,
    NAME,
    STATE,
    UNREST,
    UNTOUCHED,
    WAY,
    changed,
    press_name,
    why_not,
)
from calibration.taxim.arm.touch_down import Settling, Stillness, look, settle
from calibration.taxim.gates import MOST_DRIFT, refusals, sightings
from calibration.taxim.pictures import Pictures, Refused
from harness.basics.arrays import FloatArray
from harness.basics.errors import BenchFault, CalibrationRefused, NotTouched, WrongUse
from harness.basics.mesh import Mesh
from harness.bench.device import Channel, Reading
from harness.bench.scene import SceneFile, scene_from_json
from harness.bench.station import PRESS, Bench
from harness.bench.station_file import Station
from harness.bench.travel import Trajectory, travel
from harness.experiment.experiment import Helpers, Planned, Procedure
from harness.objects.targets import BALL_RADIUS
from harness.recording.recording import Recording
from harness.recording.run_folder import RunFiles
from harness.recording.step_file import Step
from harness.twin.bench_of import twin_of, way_between

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

EARLY = 8
"""Presses after which it is asked whether most are refused."""

_BLUR = 1.0


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
        told = dict(recording.header.plan["settings"])
        self._settings = PressSettings(**{**told, "still": Stillness(**told["still"])})
        self._watch = PressWatch.of(recording, self._ball)
        for index, planned in enumerate(recording.planned("steps")):
            if index >= recording.committed:
                self._watch.require_sense(MISSES)
                yield Step(index, planned["kind"], planned["parameters"])

    def perform(self, step: Step, bench: Bench) -> Sequence[Reading]:
        """One press or one look at the untouched gel; the arm ends at the stand-off."""
        motion = PressMotion.from_parameters(dict(step.parameters))
        bench.mark(step.index, -1)
        travel(bench, motion.start, motion.travel, self._way, _TRAVEL, _TRAVEL_ACCELERATION)
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
        descent: tuple[Reading, ...] = ()
        if touched:
            times = np.concatenate([one.times for one in seen])
            values = np.concatenate([one.values for one in seen])
            encoded = tuple(frame for one in seen for frame in one.encoded)
            descent = (
                Reading(replace(seen[0].channel, name=DESCENT), times, values, encoded),
                Reading(
                    Channel(WAY, "m", (), "float64"), np.array([one.times[-1] for one in seen]), np.array(way)
                ),
            )
        channel = replace(rest.frames.channel, name=UNTOUCHED)
        untouched = Reading(channel, rest.frames.times, rest.frames.values, rest.frames.encoded)
        return (
            pressed.frames,
            untouched,
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
        down, blur = max(first, 0.0), (_BLUR, _BLUR, 0.0)
        self._to(bench, motion, down, _APPROACH)
        while down <= last and len(seen) < wanted.pictures:
            # The frame before the last may have been exposed while the arm still moved.
            frames = bench.gel.read(2, wanted.still.timeout)
            frame = Reading(frames.channel, frames.times[-1:], frames.values[-1:], frames.encoded[-1:])
            # The largest change after blurring decides; after the first contact every frame is kept.
            if seen or np.abs(gaussian_filter(look(frame) - rest, blur)).max() >= wanted.notice:
                seen.append(frame)
                way.append(down)
                last = min(way[0] + wanted.depth, motion.lowest - wanted.step)
            down += wanted.step
            if down <= last and len(seen) < wanted.pictures:
                self._to(bench, motion, down, _PRESS)
        return seen, way

    def _to(self, bench: Bench, motion: PressMotion, down: float, speed: float) -> None:
        pose = motion.base_from_stand_off.copy()
        pose[:3, 3] += down * motion.axis
        bench.arm.move_line(pose, speed, _ACCELERATION)

    def _back(self, bench: Bench, motion: PressMotion) -> None:
        self._to(bench, motion, 0.0, _APPROACH)


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


class PressWatch:
    """What the presses so far say of the next ones.

    Args:
        ball: radius in pixels, by the stated pitch.
    """

    def __init__(self, ball: float) -> None:
        self._ball = ball
        self.first: FloatArray | None = None
        """``(rows, columns, 3)`` grey levels, the first picture of the untouched gel; None before it."""
        self._offsets: list[float] = []
        self._verdicts: list[Refused | None] = []

    @classmethod
    def of(cls, recording: Recording, ball: float) -> "PressWatch":
        """As it was after the steps that are on the disk."""
        watch = cls(ball)
        for record in recording.steps():
            watch.seen(record.step, record.readings)
        return watch

    @property
    def offset(self) -> float | None:
        """M by which the ball is met later than the scene says; None before it was met."""
        return float(np.median(self._offsets)) if self._offsets else None

    def require_light(self, rest: FloatArray) -> None:
        """Refuse to go on where the light is no longer what it was.

        Raises:
            CalibrationRefused: the untouched gel as a whole has changed too much since the first background.
        """
        if self.first is None:
            return
        whole, _ = changed(self.first, rest)
        if whole > MOST_DRIFT:
            raise CalibrationRefused(
                f"drift: the untouched gel changed by {whole:.0f} grey levels since the first background (at "
                f"most {MOST_DRIFT:.0f}): fix exposure and white balance; if the light comes back go on with "
                "--resume, else begin again"
            )

    def require_sense(self, misses: int) -> None:
        """Refuse to go on pressing in vain.

        Raises:
            NotTouched: the last ``misses`` presses met nothing.
            CalibrationRefused: more than half of the presses, eight or more, are refused.
        """
        last = self._verdicts[-misses:]
        if len(last) == misses and all(one is not None and one.kind == "no contact" for one in last):
            raise NotTouched(
                f"the last {misses} presses met nothing: check that the ball stands where the scene's "
                "[object.pose] says, to a millimetre and a half of its height, then begin again"
            )
        refused = [one for one in self._verdicts if one is not None]
        if len(self._verdicts) >= EARLY and 2 * len(refused) > len(self._verdicts):
            kind, count = Counter(one.kind for one in refused).most_common(1)[0]
            example = next(one for one in refused if one.kind == kind)
            raise CalibrationRefused(
                f"{len(refused)} of {len(self._verdicts)} presses are refused, {count} as '{kind}', so the "
                f"others are not made; {example.name}: {example.reason}"
            )

    def seen(self, step: Step, readings: Mapping[str, Reading]) -> str:
        """Take in a step, performed now or read back; what it showed, in words."""
        if step.kind == "background":
            return self._background(look(readings[IMAGE]))
        motion = PressMotion.from_parameters(dict(step.parameters))
        if WAY in readings:
            self._offsets.append(float(readings[WAY].values[0]) - motion.touch)
        verdict, said = self._verdict(step, readings)
        self._verdicts.append(verdict)
        return said if verdict is None else f"refused, {verdict.kind}: {verdict.reason}"

    def _background(self, rest: FloatArray) -> str:
        if self.first is None:
            self.first = rest
            return "the untouched gel"
        whole, place = changed(self.first, rest)
        return f"the untouched gel: {whole:.1f} grey levels from the first, {place:.1f} at one place"

    def _verdict(self, step: Step, readings: Mapping[str, Reading]) -> tuple[Refused | None, str]:
        name = press_name(step.index)
        touched, settled, seconds = (float(value) for value in readings[STATE].values[-1])
        unrest = float(readings[UNREST].values[-1]) if UNREST in readings else 0.0
        refused = why_not(name, bool(touched), bool(settled), unrest, seconds)
        if refused is not None:
            return refused, ""
        background, image = (
            np.asarray(np.round(one), dtype=np.uint8)
            for one in (look(readings[UNTOUCHED]), look(readings[IMAGE]))
        )
        pictures = Pictures(background, "", image[None], (name,), None, name, "")
        sighting = sightings(pictures, self._ball)
        x, y = sighting[0].found.centre
        verdict = refusals(pictures, sighting, self._ball)[0]
        return verdict, f"ball at ({x:.0f}, {y:.0f}) px, still after {seconds:.1f} s"


GAP = "target"
"""Default reality gap of a mocked bench: a ball on a rigid stand, and an uncalibrated sensor."""

BALL = "ball"


def ball_scene(ball_radius: float, scene: SceneFile | None = None) -> SceneFile:
    """A scene with the ball of this size on the table; at the default place where no scene says another.

    Args:
        ball_radius: m.
        scene: says where it stands; None for the default place.

    Raises:
        WrongUse: a scene of something else.
    """
    if scene is None:
        scene = scene_from_json(
            {"schema": 1, "object": {"mesh": f"builtin:{BALL}"}, "support": {"kind": "clamped"}},
            "the ball's scene",
        )
    if scene.object.builtin != BALL:
        raise WrongUse(
            f"--scene: its object is {scene.object.name}; a gel is calibrated on 'builtin:{BALL}', a ball on "
            "a stem (scenes/ball_target.toml is one)"
        )
    ball = scene.object.model_copy(update={"scale": ball_radius / BALL_RADIUS})
    return scene.model_copy(update={"object": ball})


def procedure(settings: PressSettings | None = None) -> Procedure:
    """Create the procedure of the arm: presses of the ball, with images of the untouched gel between them.

    Args:
        settings: of presses that are still to be planned; None for a run that is planned.
    """
    return Procedure(
        name=NAME,
        step="step",
        plan=partial(_planned, settings or PressSettings()),
        performer=_performer,
        gap=GAP,
    )


def _planned(settings: PressSettings, scene: SceneFile, station: Station, mesh: Mesh, seed: int) -> Planned:
    radius = BALL_RADIUS * scene.object.drawn_scale
    top = mesh.vertices[int(np.argmax(mesh.vertices[:, 2]))]
    twin, sensor = twin_of(scene, station, mesh), station.gel.sensor
    plan = plan_presses(twin, top, radius, settings, seed)
    described = {
        **plan.to_json(),
        "ball_radius_m": radius,
        "pitch_m": sensor.pitch,
        "sensor": sensor.name,
    }
    return Planned(described.pop("steps"), plan.rehearsal, twin, described)


def _performer(run: RunFiles, helpers: Helpers) -> BallPresses:
    plan = run.recording.header.plan
    ball = float(plan["ball_radius_m"]) / float(plan["pitch_m"])
    return BallPresses(partial(way_between, helpers.twin), ball, say=helpers.say)
