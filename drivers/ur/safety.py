"""The limits an arm moves within, checked before a byte leaves. Pure functions.

Every refusal is a ``LimitExceeded`` that says what was asked, the value, the limit with its
unit, and what to do. Nothing is clamped.
"""

import ipaddress
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from drivers.ur.paths import Path
from harness.basics.arrays import FloatArray
from harness.basics.errors import LimitExceeded, SafetyStop, WrongUse

Triple = tuple[float, float, float]
Six = tuple[float, float, float, float, float, float]

TURN: Final = 2 * math.pi
MOCK_YEAR: Final = "0000"  # a serial number begins with the year of making; no arm was made in this one
ROUND_OFF: Final = 1e-9  # a limit itself is allowed, whatever the last bit of a product says

_NOT_COMPLETE: Final = (
    "because the safety chapter of this driver (twin-checked motion, operator's yes, protective-stop "
    "recovery) is not complete; it will not move a real arm"
)


@dataclass(frozen=True)
class SafetyLimits:
    """What the arm may be asked to do; part of the station."""

    workspace_low: Triple  #: m, in base: the corner of the box that every tool point stays in.
    workspace_high: Triple  #: m, in base: the opposite corner.
    joint_low: Six = (-TURN,) * 6  #: rad.
    joint_high: Six = (TURN,) * 6  #: rad.
    joint_step: float = math.pi  #: rad, the most any joint may turn in one motion.
    joint_speed: float = 1.5  #: rad/s.
    joint_acceleration: float = 2.0  #: rad/s^2.
    speed: float = 0.25  #: m/s of any tool point, away from contact.
    speed_near: float = 0.05  #: m/s of any tool point, while seeking contact and within ``near`` of it.
    near: float = 0.01  #: m of flange travel around the last contact.
    acceleration: float = 1.5  #: m/s^2.
    travel: float = 0.2  #: m, the longest search for contact.
    force_press: float = 10.0  #: N; a motion during which the force grows beyond this is stopped.
    force_any: float = 25.0  #: N; beyond this the arm is stopped twice over and stays stopped.
    patience: float = 0.1
    """s that the controller's watchdog waits for this computer before it stops the arm."""

    def __post_init__(self) -> None:
        for name, low, high in (
            ("workspace", self.workspace_low, self.workspace_high),
            ("joint range", self.joint_low, self.joint_high),
        ):
            if not all(
                math.isfinite(a) and math.isfinite(b) and a < b for a, b in zip(low, high, strict=True)
            ):
                raise WrongUse(f"safety limits: the {name} from {low} to {high} is empty or not finite")
        for name, value in vars(self).items():
            if not name.endswith(("_low", "_high")) and not (math.isfinite(value) and value > 0):
                raise WrongUse(f"safety limits: {name} = {value} must be a positive number")
        if self.speed_near > self.speed:
            raise WrongUse(f"safety limits: speed_near {self.speed_near} m/s is above speed {self.speed} m/s")
        if self.force_press > self.force_any:
            raise WrongUse(
                f"safety limits: force_press {self.force_press} N is above force_any {self.force_any} N"
            )


def require_loopback(address: str) -> None:
    """Refuse an address that could be a real arm's.

    Raises:
        WrongUse: ``address`` is not a loopback address; nothing was reached that could have moved.
    """
    try:
        loopback = ipaddress.ip_address(address).is_loopback
    except ValueError:
        loopback = False
    if not loopback:
        raise WrongUse(
            f"the arm at '{address}' was not connected: only a mock controller on a loopback address "
            f"(127.0.0.0/8 or ::1) is accepted, {_NOT_COMPLETE}"
        )


def require_mock(address: str, serial: str) -> None:
    """Refuse a controller that does not identify itself as a mock: a loopback address proves nothing.

    A relay or a tunnel on this computer answers for an arm elsewhere.

    Raises:
        SafetyStop: ``serial`` is not of the kind that only mocks have.
    """
    if not (serial.isdigit() and serial.startswith(MOCK_YEAR)):
        raise SafetyStop(
            f"the arm at {address} was not connected: its serial number is '{serial[:40]}', and a mock's "
            f"begins with {MOCK_YEAR}, so this may be a real arm behind a relay; only a mock is accepted, "
            f"{_NOT_COMPLETE}"
        )


def vector(name: str, values: Sequence[float] | FloatArray, length: int) -> FloatArray:
    """``(length,)`` finite numbers, or ``LimitExceeded``."""
    array = np.asarray(values, dtype=np.float64)
    if array.shape != (length,):
        raise LimitExceeded(f"{name}: shape {array.shape}; it must be ({length},)")
    if not np.all(np.isfinite(array)):
        raise LimitExceeded(f"{name}: {array.tolist()} holds a number that is not finite")
    return array


def unit_vector(name: str, values: Sequence[float] | FloatArray) -> FloatArray:
    """``(3,)`` of length 1 to 1e-6, or ``LimitExceeded``."""
    array = vector(name, values, 3)
    length = float(np.linalg.norm(array))
    if abs(length - 1.0) > 1e-6:
        raise LimitExceeded(f"{name}: length {length:.6g}; a direction has length 1 (to 1e-6): normalise it")
    return array


def pose(name: str, base_from_flange: FloatArray) -> FloatArray:
    """A rigid ``(4, 4)`` transform, or ``LimitExceeded``."""
    matrix = np.asarray(base_from_flange, dtype=np.float64)
    if matrix.shape != (4, 4):
        raise LimitExceeded(f"{name}: shape {matrix.shape}; a pose is (4, 4)")
    if not np.all(np.isfinite(matrix)):
        raise LimitExceeded(f"{name}: the pose holds a number that is not finite")
    rotation = matrix[:3, :3]
    error = float(np.abs(rotation @ rotation.T - np.eye(3)).max())
    if error > 1e-6 or np.linalg.det(rotation) < 0 or np.any(matrix[3] != (0, 0, 0, 1)):
        raise LimitExceeded(
            f"{name}: not a rigid transform (rotation off by {error:.2g}, limit 1e-6); "
            "check the order of the product that made it"
        )
    return matrix


def within(name: str, value: float, limit: float, unit: str, advice: str) -> float:
    """``value``, which must lie in (0, limit], or ``LimitExceeded``."""
    if not (math.isfinite(value) and 0 < value <= limit * (1 + ROUND_OFF)):
        raise LimitExceeded(
            f"{name}: {value:.6g} {unit} was asked; the limit is {limit:.6g} {unit} (and above 0): {advice}"
        )
    return value


def check_joint_range(limits: SafetyLimits, joints: FloatArray, what: str) -> None:
    """Each of ``(n, 6)`` or ``(6,)`` joints within its range."""
    low, high = np.array(limits.joint_low), np.array(limits.joint_high)
    outside = (joints < low - ROUND_OFF) | (joints > high + ROUND_OFF)
    if not np.any(outside):
        return
    joint = int(np.argwhere(outside)[0][-1])
    worst = joints[..., joint][outside[..., joint]][0]
    raise LimitExceeded(
        f"{what}: joint {joint + 1} at {worst:.4f} rad; its range is {low[joint]:.4f} to {high[joint]:.4f} "
        "rad: choose another branch or target"
    )


def check_workspace(limits: SafetyLimits, path: Path, what: str) -> None:
    """Every tool point of the path inside the box.

    An arm that starts outside may come in, but no point may go further out than it started.
    """
    low, high = np.array(limits.workspace_low), np.array(limits.workspace_high)
    outside = np.maximum(np.maximum(low - path.tool_points, path.tool_points - high), 0.0)
    allowed = outside[0] + ROUND_OFF
    allowed_at_end = np.full_like(allowed, ROUND_OFF)
    bad = np.concatenate([outside[:-1] > allowed, (outside[-1] > allowed_at_end)[None]])
    if not np.any(bad):
        return
    sample, point, axis = (int(i) for i in np.unravel_index(np.argmax(outside * bad), bad.shape))
    value = path.tool_points[sample, point, axis]
    raise LimitExceeded(
        f"{what}: tool point {point + 1} would come to {'xyz'[axis]} = {value:.4f} m in base; the workspace "
        f"is {low[axis]:.4f} to {high[axis]:.4f} m: move the target, or the box in the station file"
    )


def check_speeds(limits: SafetyLimits, path: Path, cap: float, what: str) -> None:
    """The fastest tool point and the fastest joint of a path within their limits."""
    tool = path.greatest_tool_speed
    if tool > cap * (1 + 1e-6):
        raise LimitExceeded(
            f"{what}: a tool point would move at {tool:.4f} m/s; the limit here is {cap:.4f} m/s: ask for "
            f"{100 * cap / tool:.0f} % of this speed or less"
        )
    joint = path.greatest_joint_speed
    if joint > limits.joint_speed * (1 + 1e-6):
        raise LimitExceeded(
            f"{what}: a joint would turn at {joint:.3f} rad/s; the limit is {limits.joint_speed:.3f} rad/s: "
            "the path passes close to a singular posture; go slower, or around it by a joint motion"
        )


def check_path(limits: SafetyLimits, path: Path, contact: FloatArray | None, what: str) -> None:
    """Joint range, joint step, workspace and speeds of a whole path."""
    check_joint_range(limits, path.joints, what)
    steps = np.abs(path.joints[-1] - path.joints[0])
    joint = int(np.argmax(steps))
    if steps[joint] > limits.joint_step + ROUND_OFF:
        raise LimitExceeded(
            f"{what}: joint {joint + 1} would turn by {steps[joint]:.3f} rad; the limit for one motion is "
            f"{limits.joint_step:.3f} rad: go by way of a posture in between"
        )
    check_workspace(limits, path, what)
    # A path that begins or ends near the last contact, where the flange was then, is slower.
    cap = limits.speed
    if contact is not None:
        distances = np.linalg.norm(path.flange_positions[[0, -1]] - contact, axis=-1)
        if bool(np.any(distances < limits.near)):
            cap = limits.speed_near
    check_speeds(limits, path, cap, what)


def trapezoid_seconds(distance: float, speed: float, acceleration: float) -> float:
    """Seconds to cover ``distance`` from rest to rest, at most at ``speed``."""
    if distance * acceleration <= speed**2:
        return 2 * math.sqrt(distance / acceleration)
    return distance / speed + speed / acceleration
