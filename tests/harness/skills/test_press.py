"""A contact whose camera fails: the gel is not left on the object, and the failure is what is raised."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from harness.basics.arrays import FloatArray
from harness.basics.errors import BenchFault, MotionEnded
from harness.recording.step_file import Step
from harness.skills.press import ContactMotion, PressPerformer

STAND_OFF: FloatArray = np.eye(4)
MOTION = ContactMotion(np.zeros(6), np.zeros((1, 6)), STAND_OFF, np.array([0.0, 0.0, -1.0]), 0.02, 1e-3)


class Arm:
    """Fails in one of its motions."""

    def __init__(self, fails: str, error: BenchFault) -> None:
        self._fails, self._error = fails, error
        self.lines: list[FloatArray] = []

    def move_until_contact(self, *_: object) -> bool:
        if self._fails == "search":
            raise self._error
        return True

    def move_line(self, base_from_flange: FloatArray, *_: object) -> None:
        self.lines.append(base_from_flange)

    def state(self) -> Any:
        return SimpleNamespace(base_from_flange=np.eye(4), time=1.0)


class Gel:
    """Fails at its reading."""

    def __init__(self, error: BenchFault) -> None:
        self._error = error

    def read(self, *_: object, **__: object) -> None:
        raise self._error


def contact(arm: Arm, gel: Gel, monkeypatch: pytest.MonkeyPatch) -> None:
    safety = SimpleNamespace(travel=0.2)
    station = SimpleNamespace(arm=SimpleNamespace(safety=safety))
    bench: Any = SimpleNamespace(
        arm=arm, gel=gel, station=station, pause=lambda _: None, mark=lambda *_: None
    )
    no_way: Any = None
    performer = PressPerformer(no_way)
    monkeypatch.setattr(performer, "_press", lambda *_: 0.0)
    performer._contact(Step(0, "press", {}), MOTION, bench, 0.0)


@pytest.mark.parametrize("fails", ["search", "reading"])
def test_a_camera_that_fails_sends_the_arm_back_to_the_stand_off(
    fails: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    error = MotionEnded("gel sent no frame") if fails == "search" else BenchFault("gel sent 0 of 3 frames")
    arm = Arm(fails, error)
    with pytest.raises(BenchFault) as raised:
        contact(arm, Gel(error), monkeypatch)
    assert raised.value is error
    assert len(arm.lines) == 1
    assert arm.lines[0] is STAND_OFF


def test_an_arm_that_fails_is_not_sent_back(monkeypatch: pytest.MonkeyPatch) -> None:
    error = BenchFault("the controller or the link failed")
    arm = Arm("search", error)
    with pytest.raises(BenchFault, match="link failed"):
        contact(arm, Gel(error), monkeypatch)
    assert arm.lines == []
