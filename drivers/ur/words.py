"""What the controller's numbers mean (Universal Robots, RTDE guide and Script manual)."""

from typing import Final

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
RUNNING: Final = 7
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
