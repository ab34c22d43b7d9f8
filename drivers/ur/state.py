"""From packets of the arm's stream to states and readings; UR's rotation vectors end here."""

from typing import Final

import numpy as np

from drivers.ur import pipe
from harness.basics.arrays import FloatArray
from harness.basics.errors import BenchFault
from harness.basics.geometry import (
    quaternion_from_rotation,
    rotation_from_vector,
    transform,
)
from harness.bench import kinematics
from harness.bench.device import ArmState, Channel, Reading

SAME_POSE: Final = 5e-3  # m between the model's flange and the controller's


def arm_state(packet: FloatArray) -> ArmState:
    """The state that a ``(pipe.WIDTH,)`` packet holds."""
    fields = pipe.FIELDS
    pose = packet[fields["pose"]]
    return ArmState(
        time=float(packet[0]),
        joints=packet[fields["joints"]],
        joint_speeds=packet[fields["joint_speeds"]],
        base_from_flange=transform(rotation_from_vector(pose[3:]), pose[:3]),
        wrench=packet[fields["wrench"]],
        safety=safety_words(int(packet[fields["safety_bits"]][0])),
        moving=bool(packet[fields["moving"]][0]),
    )


def readings(packets: FloatArray, rate: float) -> tuple[Reading, ...]:
    """Joints, flange poses, wrenches and the controller's clock of ``(n, pipe.WIDTH)`` packets."""
    turns = [
        quaternion_from_rotation(rotation_from_vector(pose[3:])) for pose in packets[:, pipe.FIELDS["pose"]]
    ]
    poses = np.hstack([packets[:, pipe.FIELDS["pose"]][:, :3], np.reshape(turns, (-1, 4))])
    columns = (
        ("arm.joints", "rad", "", packets[:, pipe.FIELDS["joints"]]),
        ("arm.base_from_flange", "m, 1", "base", poses),
        ("arm.wrench", "N, N m", "base", packets[:, pipe.FIELDS["wrench"]]),
        ("arm.controller_time", "s", "", packets[:, pipe.FIELDS["controller_time"]][:, 0]),
    )
    return tuple(
        Reading(Channel(name, unit, values.shape[1:], "float64", frame, rate), packets[:, 0], values)
        for name, unit, frame, values in columns
    )


def force(packet: FloatArray) -> float:
    """N, the length of a packet's force."""
    return float(np.linalg.norm(packet[pipe.FIELDS["wrench"]][:3]))


def not_zeroed(packet: FloatArray, limit: float, seconds: float) -> BenchFault:
    """Why no packet of the last ``seconds`` shows a force below ``limit`` N, after the sensor was zeroed."""
    pull = force(packet)
    if pull < limit:
        return BenchFault(
            "the force sensor was zeroed, but this computer was too busy to see it: no state of the arm "
            f"came within {seconds:g} s; close what else runs on it, then zero the sensor again"
        )
    return BenchFault(
        f"something pulls at the tool: the force sensor reads {pull:.1f} N after it was zeroed (limit "
        f"{limit:g} N); free the tool and its cables, and check the payload set at the pendant"
    )


def detail(packet: FloatArray) -> str:
    """Safety state and anything unusual since opening, in words."""
    words = safety_words(int(packet[pipe.FIELDS["safety_bits"]][0]))
    restarts = int(packet[pipe.FIELDS["restarts"]][0])
    late = f"; the control script was restarted {restarts} times after a delay at rest" if restarts else ""
    return f"safety {words}{late}"


def stopped_by_controller(packet: FloatArray, during: str) -> str:
    """What an operator must know of a stop that only they may release."""
    x, y, z = 1e3 * packet[pipe.FIELDS["pose"]][:3]
    fx, fy, fz = packet[pipe.FIELDS["wrench"]][:3]
    words = safety_words(int(packet[pipe.FIELDS["safety_bits"]][0]))
    return (
        f"the controller stopped the arm {during}: {words}; flange at ({x:.1f}, {y:.1f}, {z:.1f}) mm in "
        f"base, force ({fx:.1f}, {fy:.1f}, {fz:.1f}) N. Look for the cause, free the arm and release the "
        "stop at the pendant, then start again; nothing resumes by itself"
    )


def require_model(model: str, address: str, state: ArmState) -> None:
    """The station's model, the controller's pose and its zero tool offset agree, or ``BenchFault``."""
    expected = kinematics.forward(model, state.joints)
    off = float(np.linalg.norm(expected[:3, 3] - state.base_from_flange[:3, 3]))
    if off > SAME_POSE:
        raise BenchFault(
            f"the flange of a {model} with these joints is {1e3 * off:.1f} mm from where the controller at "
            f"{address} says it is (limit {1e3 * SAME_POSE:g} mm): the station file names another model, or "
            "the controller keeps a tool offset"
        )


ROBOT_MODES: Final = {
    -1: "no controller",
    0: "disconnected",
    1: "confirm safety",
    2: "booting",
    3: "power off",
    4: "power on",
    5: "idle",
    6: "backdrive",
    7: "running",
    8: "updating firmware",
}
RUNTIME_STATES: Final = {
    0: "stopping",
    1: "stopped",
    2: "playing",
    3: "pausing",
    4: "paused",
    5: "resuming",
}
PLAYING: Final = 2
PAUSED: Final = frozenset({3, 4})
ENDED: Final = frozenset({0, 1, 3, 4})
TOOL_OUTPUT_BIT: Final = 16

_SAFETY: Final = (
    (1 << 5 | 1 << 6 | 1 << 7, "emergency stop"),
    (1 << 9, "fault"),
    (1 << 8, "violation"),
    (1 << 2, "protective stop"),
    (1 << 11, "three-position switch released"),
    (1 << 4, "safeguard stop"),
    (1 << 10, "stopped due to safety"),
    (1 << 3, "recovery"),
    (1 << 1, "reduced"),
    (1 << 0, "normal"),
)
MAY_MOVE: Final = frozenset({"normal", "reduced"})


def safety_words(bits: int) -> str:
    """The gravest state among the controller's safety status bits, in words."""
    return next((words for mask, words in _SAFETY if bits & mask), f"unknown (bits {bits:#x})")
