"""Ball presses all over a gel, planned and rehearsed in the twin before the arm moves.

The tool keeps one attitude, gel down; only its place changes, so that every move between two presses is a
move of the ball over the gel. Places follow a low-discrepancy sequence: a drift of light or gel in the course
of the presses is no slope over the picture then, and an interrupted run is spread over the whole gel already.
"""

from collections.abc import Iterator
from dataclasses import asdict, dataclass, field
from typing import Any, Literal

import numpy as np
from scipy.stats import qmc

from calibration.taxim.arm.touch_down import PICTURES, Stillness
from calibration.taxim.gates import LEAST_PRESSES
from harness.basics.arrays import FloatArray
from harness.basics.errors import WrongUse
from harness.basics.geometry import apply, rotation_about, transform
from harness.bench.sensor import TactileSensor
from harness.twin.bench import TwinBench
from harness.twin.motion import STAND_OFF, PlannedContact, plan_contact
from harness.twin.rehearsal import RehearsalReport, Segment, rehearse

HOME = np.radians([0.0, -90.0, 60.0, -60.0, -90.0, 0.0])
"""rad: the gel above the bench, pointing down; where the first travel starts."""

MARGIN = 0.6e-3
"""m between a contact line and the picture's border: what hangs from it is to be seen too."""

_DOWN = np.diag([1.0, -1.0, -1.0])
_YAWS = np.radians([0.0, 90.0, -90.0, 180.0, 45.0, -45.0, 135.0, -135.0])
_SPARE = 0.1e-3
"""m that the deepest point stays within the gel's thickness."""


@dataclass(frozen=True)
class PressSettings:
    """How the ball is pressed (SI)."""

    presses: int = 49  #: how many.
    depth: float = 0.8e-3  #: m of the ball in the gel, from where the pictures first show it.
    step: float = 0.1e-3  #: m between looks on the way down.
    pictures: int = PICTURES  #: of the way down that are kept, from the first touch on.
    every: int = 12  #: presses between two pictures of the untouched gel that count as background.
    notice: float = 8.0  #: grey levels of change at one place that are a touch.
    ahead: float = 0.4e-3
    """m above the expected touch at which looking begins, once it is known where the ball is."""
    far: float = 2.5e-3  #: m above the stated place of the ball at which looking begins before that.
    still: Stillness = field(default_factory=Stillness)  #: when a picture counts.


@dataclass(frozen=True, eq=False)
class PressMotion:
    """One place, ready to be pressed."""

    start: FloatArray  #: ``(6,)`` rad, where the travel was planned to start.
    travel: FloatArray  #: ``(n, 6)`` rad from there to the stand-off.
    base_from_stand_off: FloatArray  #: ``(4, 4)`` of the flange.
    axis: FloatArray  #: ``(3,)`` unit in base: the way the gel is pressed.
    touch: float  #: m from the stand-off to where the gel meets the ball as the scene states it.
    lowest: float  #: m from the stand-off that were rehearsed; the arm goes no further.
    on_gel: FloatArray  #: ``(2,)`` m, where on the gel the ball is to be.

    def to_parameters(self) -> dict[str, Any]:
        """As JSON values, with the unit in each key."""
        return {
            "start_rad": self.start.tolist(),
            "travel_rad": self.travel.tolist(),
            "base_from_stand_off": self.base_from_stand_off.tolist(),
            "axis_in_base": self.axis.tolist(),
            "touch_m": self.touch,
            "lowest_m": self.lowest,
            "on_gel_m": self.on_gel.tolist(),
        }

    @classmethod
    def from_parameters(cls, told: dict[str, Any]) -> "PressMotion":
        """The motion that ``to_parameters`` wrote."""
        names = ("start_rad", "travel_rad", "base_from_stand_off", "axis_in_base", "on_gel_m")
        start, travel, pose, axis, on_gel = (np.asarray(told[name], dtype=np.float64) for name in names)
        touch, lowest = float(told["touch_m"]), float(told["lowest_m"])
        return cls(start, travel.reshape(-1, 6), pose, axis, touch, lowest, on_gel)


@dataclass(frozen=True, eq=False)
class PressPlan:
    """Every motion of a calibration."""

    motions: tuple[PressMotion, ...]  #: of the presses.
    rehearsal: RehearsalReport  #: what the twin found.
    settings: PressSettings  #: how the ball is pressed.
    ball_in_base: FloatArray  #: ``(3,)`` m, the ball's top as the scene states it.

    def to_json(self) -> dict[str, Any]:
        """For ``run.json``: settings, and every step with its kind."""
        return {
            "settings": asdict(self.settings),
            "ball_in_base_m": self.ball_in_base.tolist(),
            "steps": [{"kind": kind, "parameters": motion.to_parameters()} for kind, motion in _order(self)],
        }


def _order(plan: PressPlan) -> Iterator[tuple[Literal["background", "press"], PressMotion]]:
    """Presses, and the untouched gel before the first, after the last, and every so often."""
    for k, motion in enumerate(plan.motions):
        if k % plan.settings.every == 0:
            yield "background", motion
        yield "press", motion
    yield "background", plan.motions[-1]


def places(sensor: TactileSensor, ball_radius: float, settings: PressSettings, seed: int) -> FloatArray:
    """``(presses, 2)`` m in the gel's frame, spread so that each contact is in the picture.

    Raises:
        WrongUse: too few presses, a press deeper than ball or gel, or a contact larger than the picture.
    """
    depth = settings.depth
    if settings.presses < LEAST_PRESSES:
        raise WrongUse(f"--presses {settings.presses}: at least {LEAST_PRESSES} are needed, all over the gel")
    deepest = min(0.9 * ball_radius, sensor.gel_thickness - 2.0 * _SPARE)
    if not 0.0 < depth <= deepest:
        raise WrongUse(
            f"--depth {1e3 * depth:g} mm: a ball of {1e3 * ball_radius:g} mm in a gel of "
            f"{1e3 * sensor.gel_thickness:g} mm may be pressed by up to {1e3 * deepest:.2f} mm"
        )
    contact = float(np.sqrt(depth * (2.0 * ball_radius - depth)))
    room = np.array(sensor.window) - 2.0 * (contact + MARGIN)
    if room.min() <= contact:
        raise WrongUse(
            f"a contact {2e3 * contact:.1f} mm across leaves {1e3 * room.min():.1f} mm to move it in "
            f"a window of {1e3 * sensor.window[0]:.1f} x {1e3 * sensor.window[1]:.1f} mm: take a smaller "
            "ball, or press less"
        )
    share = qmc.Halton(2, scramble=True, rng=np.random.default_rng(seed)).random(settings.presses)
    spread: FloatArray = (share - 0.5) * room
    return spread


def plan_presses(
    bench: TwinBench, top_in_object: FloatArray, ball_radius: float, settings: PressSettings, seed: int
) -> PressPlan:
    """Choose places and attitude, plan the ways, rehearse the whole.

    Args:
        bench: the twin.
        top_in_object: ``(3,)`` m, the point of the ball that the gel meets first.
        ball_radius: m.
        settings: how the ball is pressed.
        seed: of the places.

    Raises:
        WrongUse: settings that cannot be, or no attitude of the tool reaches every place.
        MotionRefused: the rehearsal found a motion that must not be made.
    """
    on_gel = places(bench.sensor, ball_radius, settings, seed)
    top = apply(bench.base_from_object, top_in_object[None])[0]
    deepest = bench.sensor.gel_thickness - _SPARE
    for yaw in _YAWS:
        turned = rotation_about(np.array([0.0, 0.0, 1.0]), float(yaw)) @ _DOWN
        contacts = _contacts(bench, turned, top, on_gel, deepest, seed)
        if contacts is not None:
            break
    else:
        raise WrongUse(
            "the arm reaches no attitude in which the gel can be pressed on the ball at ("
            f"{1e3 * top[0]:.0f}, {1e3 * top[1]:.0f}, {1e3 * top[2]:.0f}) mm in base, {len(_YAWS)} were "
            "tried: put it elsewhere and say so in the scene's [object.pose]"
        )
    segments: list[Segment] = [part for k, one in enumerate(contacts) for part in one.segments(k)]
    motions = []
    for one, place in zip(contacts, on_gel, strict=True):
        pose = one.base_from_stand_off
        axis = (pose @ bench.flange_from_gel)[:3, 2]
        motions.append(PressMotion(one.start, one.travel, pose, axis, STAND_OFF - deepest, STAND_OFF, place))
    return PressPlan(tuple(motions), rehearse(bench, segments).require(), settings, top)


def _contacts(
    bench: TwinBench, turned: FloatArray, top: FloatArray, on_gel: FloatArray, deepest: float, seed: int
) -> list[PlannedContact] | None:
    """Every place in one attitude, at the deepest that may come; None where one is out of reach."""
    planned: list[PlannedContact] = []
    joints = HOME
    for x, y in on_gel:
        pressed = transform(turned, top - turned @ np.array([x, y, -deepest]))
        contact = plan_contact(bench, pressed, joints, seed=seed, searched=1)
        if contact is None:
            return None
        planned.append(contact)
        joints = contact.stand_off_joints
    return planned
