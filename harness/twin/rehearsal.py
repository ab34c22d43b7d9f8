"""A whole run, gone through in the twin before the arm moves: what must not be performed is named."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final, Literal

import numpy as np

from harness.basics.arrays import FloatArray, read_only
from harness.basics.errors import MotionRefused
from harness.basics.geometry import apply, inverse
from harness.bench import kinematics
from harness.twin.bench import TwinBench
from harness.twin.ways import Blocked, line_poses, line_postures, sweep, sweep_postures

SINGULAR: Final = 0.04  # smallest singular value of the Jacobian that a line may pass
NEARLY_SINGULAR: Final = 0.1  # below this the report warns
SAME: Final = 1e-5  # rad between the end of one segment and the start of the next
TOOL_LENGTH: Final = 0.12  # m behind the gel from where the line of a contact is followed


@dataclass(frozen=True, eq=False)
class Segment:
    """One motion of a plan."""

    step: int  #: of the experiment, counted from 0.
    label: str  #: what it is for: ``"travel"``, ``"press"``, ``"retreat"``.
    kind: Literal["joint", "line"]  #: a straight line of the joints, or of the flange.
    start: FloatArray  #: ``(6,)`` rad.
    end: FloatArray  #: ``(6,)`` rad for joints, ``(4, 4)`` base_from_flange for a line.
    touches: bool = False  #: whether the gel may touch the object on the way.
    press: bool = False  #: whether the line is meant to end with the gel pressed into the object.


@dataclass(frozen=True, eq=False)
class PredictedContact:
    """Where a press would meet the object, were it where the scene says."""

    step: int  #: of the experiment.
    base_from_gel: FloatArray  #: ``(4, 4)``, fully pressed.
    point_in_object: FloatArray  #: ``(3,)`` m.
    centre_depth: float  #: m of indentation at the gel's centre; negative where it does not touch.
    pad_depth: float  #: m of the deepest indentation anywhere on the pad.


@dataclass(frozen=True)
class Refusal:
    """Why one segment must not be performed."""

    step: int  #: of the experiment.
    label: str  #: of the segment.
    reason: str  #: in words, with values and limits.
    bodies: tuple[tuple[str, str], ...] = ()  #: pairs that would meet.

    def __str__(self) -> str:
        """Step, counted from 1 as an operator does, then the reason."""
        return f"step {self.step + 1} ({self.label}): {self.reason}"


@dataclass(frozen=True)
class RehearsalReport:
    """What a rehearsal found."""

    segments: int  #: number of motions gone through.
    refusals: tuple[Refusal, ...]  #: motions that must not be performed, at most one a segment.
    warnings: tuple[str, ...]  #: sentences.
    contacts: tuple[PredictedContact, ...]  #: of the presses that were not refused.

    def require(self) -> "RehearsalReport":
        """This report.

        Raises:
            MotionRefused: there is a refusal; its text is the first, with the number of others.
        """
        if self.refusals:
            more = len(self.refusals) - 1
            others = f" ({more} more motions are refused too)" if more else ""
            raise MotionRefused(f"rehearsal: {self.refusals[0]}{others}")
        return self


def rehearse(bench: TwinBench, segments: Sequence[Segment]) -> RehearsalReport:
    """Go through a plan: joint limits, reach, singular lines, collisions, depth of presses."""
    rehearsal = _Rehearsal(bench)
    for segment in segments:
        rehearsal.perform(segment)
    return RehearsalReport(
        len(segments), tuple(rehearsal.refusals), tuple(rehearsal.warnings), tuple(rehearsal.contacts)
    )


def contact_point(bench: TwinBench, base_from_gel: FloatArray) -> FloatArray:
    """``(3,)`` m in the object's frame: what the line through the gel's centre along its z meets first.

    The nearest point of the surface where the line misses.
    """
    object_from_gel = bench.object_from_base @ base_from_gel
    axis, centre = object_from_gel[:3, 2], object_from_gel[:3, 3]
    start = centre - TOOL_LENGTH * axis
    along = bench.solid.first_hit(start, axis)
    return start + along * axis if np.isfinite(along) else bench.solid.nearest(centre)


def predict_contact(bench: TwinBench, step: int, base_from_gel: FloatArray) -> PredictedContact:
    """The contact of a pose in which the gel is fully pressed."""
    point = contact_point(bench, base_from_gel)
    point_in_gel = apply(inverse(base_from_gel) @ bench.base_from_object, point[None])[0]
    depth = bench.pad_depth(base_from_gel)
    return PredictedContact(step, base_from_gel, read_only(point), -float(point_in_gel[2]), depth)


class _Rehearsal:
    """The state of one rehearsal: where the arm is, and what was found so far."""

    def __init__(self, bench: TwinBench) -> None:
        self.bench = bench
        self.refusals: list[Refusal] = []
        self.warnings: list[str] = []
        self.contacts: list[PredictedContact] = []
        self._joints: FloatArray | None = None

    def perform(self, segment: Segment) -> None:
        refused = self._jump(segment) or self._range(segment, segment.start)
        if refused is None:
            refused = self._joint(segment) if segment.kind == "joint" else self._line(segment)
        if refused is not None:
            self.refusals.append(refused)
            self._joints = None

    def _jump(self, segment: Segment) -> Refusal | None:
        if self._joints is None:
            return None
        turned = np.abs(segment.start - self._joints)
        if turned.max() <= SAME:
            return None
        joint = int(np.argmax(turned))
        return Refusal(
            segment.step,
            segment.label,
            f"the motion starts {turned[joint]:.4f} rad at joint {joint + 1} from where the one before ends "
            f"(limit {SAME:g} rad): plan it from there",
        )

    def _range(self, segment: Segment, joints: FloatArray) -> Refusal | None:
        low, high = self.bench.joint_range
        outside = np.flatnonzero((joints < low) | (joints > high) | ~np.isfinite(joints))
        if len(outside) == 0:
            return None
        joint = int(outside[0])
        return Refusal(
            segment.step,
            segment.label,
            f"joint {joint + 1} at {joints[joint]:.3f} rad; its range is {low[joint]:.3f} to "
            f"{high[joint]:.3f} rad: choose another branch or target",
        )

    def _joint(self, segment: Segment) -> Refusal | None:
        refused = self._range(segment, segment.end)
        if refused is not None:
            return refused
        self._joints = segment.end
        return self._blocked(segment, sweep(self.bench, segment.start, segment.end))

    def _line(self, segment: Segment) -> Refusal | None:
        poses = line_poses(kinematics.forward(self.bench.model, segment.start), segment.end)
        postures = line_postures(self.bench, segment.start, poses)
        if len(postures) < len(poses):
            return self._lost(segment, poses, postures)
        self._joints = postures[-1]
        return (
            self._singular(segment, postures)
            or (self._press(segment) if segment.press else None)
            or self._blocked(segment, sweep_postures(self.bench, postures, segment.touches))
        )

    def _lost(self, segment: Segment, poses: FloatArray, postures: FloatArray) -> Refusal:
        there = poses[len(postures)]
        x, y, z = 1e3 * there[:3, 3]
        reached = len(kinematics.inverse(self.bench.model, there)) > 0
        why = "would leave its branch or a joint's range" if reached else "cannot reach"
        reason = (
            f"straight line: the {self.bench.model} {why} {100 * len(postures) / len(poses):.0f} % of the "
            f"way, flange at ({x:.1f}, {y:.1f}, {z:.1f}) mm in base: choose another branch, or bring the "
            "target closer"
        )
        return Refusal(segment.step, segment.label, reason)

    def _singular(self, segment: Segment, postures: FloatArray) -> Refusal | None:
        least = float(kinematics.singularity(self.bench.model, postures).min())
        what = f"straight line passes a nearly singular posture (smallest singular value {least:.3f}"
        if least < SINGULAR:
            return Refusal(
                segment.step, segment.label, f"{what}, limit {SINGULAR}): choose another branch or sensor yaw"
            )
        if least < NEARLY_SINGULAR:
            self.warnings.append(
                f"step {segment.step + 1} ({segment.label}): {what}): joints move fast there"
            )
        return None

    def _press(self, segment: Segment) -> Refusal | None:
        contact = predict_contact(self.bench, segment.step, segment.end @ self.bench.flange_from_gel)
        limit = self.bench.sensor.gel_thickness
        depth, centre = 1e3 * contact.pad_depth, 1e3 * contact.centre_depth
        if contact.pad_depth <= 0.0:
            away = f"{-depth:.1f} mm short of" if np.isfinite(depth) else "not facing"
            reason = f"the press ends with the gel {away} the object: check the contact's pose"
            return Refusal(segment.step, segment.label, reason)
        if contact.pad_depth > limit:
            where = (
                "the gel" if contact.pad_depth - contact.centre_depth < 1e-4 else "another part of the pad"
            )
            reason = (
                f"{where} would be pressed {depth:.1f} mm into (the gel's centre {centre:.1f} mm); the gel "
                f"is {1e3 * limit:.1f} mm thick: press less, or choose a place where the pad lies flatter"
            )
            return Refusal(segment.step, segment.label, reason, (("gel", "object"),))
        if contact.centre_depth <= 0.0:
            self.warnings.append(
                f"step {segment.step + 1} ({segment.label}): the gel's centre would not touch"
            )
        self.contacts.append(contact)
        return None

    def _blocked(self, segment: Segment, blocked: Blocked | None) -> Refusal | None:
        if blocked is None:
            return None
        others = "; ".join(str(hit) for hit in blocked.hits)
        reason = f"{others}, {100 * blocked.share:.0f} % of the way: plan another way or another branch"
        return Refusal(
            segment.step, segment.label, reason, tuple((hit.first, hit.second) for hit in blocked.hits)
        )
