"""A run's readings as they are compared: pictures as heights of the gel, poses, strikes."""

from collections.abc import Sequence
from dataclasses import dataclass

from harness.basics.arrays import FloatArray
from harness.picture.square_pixels import aspect_stated
from harness.recording.observation import Observation, in_time, observe_step, picture_left_out
from harness.recording.run_folder import RunFiles
from harness.sim.optics.inverse import heights_or_refusal
from harness.sim.optics.tactile_calibration import TactileCalibration

SEEN = 0.12e-3
"""m of indentation at the deepest place, below which a picture shows no contact."""


@dataclass(frozen=True, eq=False)
class PressedContact:
    """One step that pressed the gel.

    Attributes:
        step: of the run.
        seen: as it was recorded.
        heights: ``(rows, columns)`` m of indentation, by its picture; zeros where that is refused.
        refusal: why its picture is not compared; empty where it is.
    """

    step: int
    seen: Observation
    heights: FloatArray
    refusal: str = ""

    @property
    def touched(self) -> bool:
        """Whether the picture shows a contact."""
        return float(self.heights.max()) > SEEN


def contacts_of(run: RunFiles) -> tuple[PressedContact, ...]:
    """Every step of a run that has pictures of the gel, its strikes in time with each other.

    Raises:
        RecordingDamaged: a step has pictures and no pose of the arm with them.
    """
    aspect = aspect_stated(run.calibration.header.made_from)
    records = [record for record in run.recording.steps() if "gel.image" in record.readings]
    seen = in_time(
        [observe_step(record, run.station.flange_from_gel, run.acquisition, aspect) for record in records]
    )
    return tuple(
        _contact(record.step.index, one, run.calibration) for record, one in zip(records, seen, strict=True)
    )


def refusal_notes(contacts: Sequence[PressedContact]) -> list[str]:
    """A sentence for each picture that is not compared."""
    return [picture_left_out(one.step, one.refusal) for one in contacts if one.refusal]


def _contact(step: int, seen: Observation, calibration: TactileCalibration) -> PressedContact:
    """With its surface from the mean of its frames, where that is of the calibration's gel."""
    return PressedContact(step, seen, *heights_or_refusal(seen.images, calibration))
