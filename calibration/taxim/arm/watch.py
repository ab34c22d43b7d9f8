"""What is kept an eye on while the arm presses: the light, the gel, and whether it makes sense to go on."""

from collections import Counter
from collections.abc import Mapping

import numpy as np
from scipy.ndimage import gaussian_filter

from calibration.taxim.arm.channels import IMAGE, STATE, UNREST, UNTOUCHED, WAY
from calibration.taxim.arm.plan import PressMotion
from calibration.taxim.arm.record import changed, press_name, why_not
from calibration.taxim.arm.settled import look
from calibration.taxim.gates import MOST_DRIFT, refusals, sightings
from calibration.taxim.pictures import Pictures, Refused
from harness.basics.arrays import FloatArray
from harness.basics.errors import CalibrationRefused, NotTouched
from harness.bench.reading import Reading
from harness.recording.recording import Recording
from harness.recording.step_file import Step

EARLY = 8
"""Presses after which it is asked whether most are refused."""

_BLUR = 1.0


def touch_seen(change: FloatArray) -> float:
    """Grey levels of the strongest change of one picture against the untouched gel, noise blurred away."""
    blurred = gaussian_filter(change, (_BLUR, _BLUR, 0.0))
    return float(np.abs(blurred).max())


class PressWatch:
    """What the presses so far say of the next ones.

    Args:
        ball: radius in pixels, by the stated pitch.

    Attributes:
        first: ``(rows, columns, 3)`` grey levels, the first picture of the untouched gel; None before it.
    """

    def __init__(self, ball: float) -> None:
        self._ball = ball
        self.first: FloatArray | None = None
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
        pictures = _one(name, look(readings[UNTOUCHED]), readings[IMAGE])
        sighting = sightings(pictures, self._ball)
        x, y = sighting[0].found.centre
        verdict = refusals(pictures, sighting, self._ball)[0]
        return verdict, f"ball at ({x:.0f}, {y:.0f}) px, still after {seconds:.1f} s"


def _one(name: str, rest: FloatArray, frames: Reading) -> Pictures:
    background, image = (np.asarray(np.round(one), dtype=np.uint8) for one in (rest, look(frames)))
    return Pictures(background, "", image[None], (name,), None, name, "")
