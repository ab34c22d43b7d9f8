"""The controller's mock and the twin read the maker's tables independently: they must agree."""

import numpy as np
import pytest

from harness.basics.geometry import translation
from harness.bench import kinematics
from harness.bench.kinematics import ARM_TABLES
from harness.bench.sensor import GELSIGHT_R15
from harness.objects.household import build
from harness.twin.bench import TwinBench
from mocks.ur.arm import kinematics as controller

POSTURES = np.random.default_rng(5).uniform(-np.pi, np.pi, (200, 6))


@pytest.mark.parametrize("model", sorted(ARM_TABLES))
def test_the_flange_is_in_the_same_place(model: str) -> None:
    table = controller.arm_model(model)
    for joints in POSTURES:
        theirs = np.array(controller.forward(table, joints.tolist()))
        assert np.abs(theirs - kinematics.forward(model, joints)).max() < 1e-12


def test_the_bodies_of_the_twin_are_where_the_controller_says_the_flange_is() -> None:
    flange_from_gel = translation(np.array([0.0, 0.0, 0.12]))
    base_from_object = translation(np.array([-0.42, 0.0, 0.25]))
    bench = TwinBench("ur5e", flange_from_gel, GELSIGHT_R15, build("mug", 6e-3), base_from_object)
    for joints in POSTURES:
        theirs = np.array(controller.forward(controller.arm_model("ur5e"), joints.tolist()))
        assert np.abs(theirs @ flange_from_gel - bench.base_from_gel(joints)).max() < 1e-9


@pytest.mark.parametrize("model", sorted(ARM_TABLES))
def test_both_know_the_same_branches(model: str) -> None:
    table = controller.arm_model(model)
    for joints in POSTURES:
        pose = kinematics.forward(model, joints)
        ours = kinematics.inverse(model, pose)
        matrix = tuple(tuple(row) for row in pose.tolist())
        theirs = np.array(controller.postures(table, matrix, joints.tolist()))
        apart = np.abs((ours[:, None] - theirs[None, :] + np.pi) % (2 * np.pi) - np.pi).max(axis=-1)
        assert len(ours) == len(theirs)
        assert apart.min(axis=1).max() < 1e-6
