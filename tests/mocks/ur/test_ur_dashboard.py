"""The dashboard's words."""

import pytest

from mocks.ur.controller import Controller
from mocks.ur.hooks import ControllerConfig
from mocks.ur.ports import LOCAL, Dashboard

CONFIG = ControllerConfig(host="127.0.0.2")


@pytest.mark.parametrize(
    ("asked", "answer"),
    [
        ("robotmode", "Robotmode: RUNNING"),
        ("SAFETYSTATUS", "Safetystatus: NORMAL"),
        ("PolyscopeVersion", "URSoftware 5.12.4.1101661 (Mar 22 2022)"),
        ("get serial number", "00005500001"),
        ("get robot model", "UR5"),
        ("programState", "STOPPED unnamed"),
        ("stop", "Stopped"),
        ("play", "Failed to execute: play"),
        ("no such thing", "could not understand: no such thing"),
        ("", "could not understand: "),
    ],
)
def test_the_dashboard_answers_in_the_controllers_words(asked: str, answer: str) -> None:
    assert Dashboard(Controller(CONFIG)).reply(asked) == answer


def test_local_control_answers_questions_and_refuses_commands() -> None:
    controller = Controller(CONFIG)
    controller.robot.remote = False
    dashboard = Dashboard(controller)
    assert dashboard.reply("is in remote control") == "false"
    assert dashboard.reply("robotmode") == "Robotmode: RUNNING"
    assert dashboard.reply("stop") == LOCAL
