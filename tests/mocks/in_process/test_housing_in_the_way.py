"""A rim that passes the gel by stops the arm at the housing, and no press drives it on."""

from typing import Any

import numpy as np

from harness.basics.geometry import inverse, transform
from harness.bench.gap import load_gap
from harness.bench.instruments.arm import SafetySection
from harness.bench.kinematics import nearest_branch
from harness.skills.press import ContactMotion, PressPerformer, Speeds
from mocks.in_process.arm import InProcessArm, Stage
from mocks.ur.hooks import HOME
from mocks.world.world import NominalBench, World

RANGE = np.array([[-2 * np.pi] * 6, [2 * np.pi] * 6])
NONE = load_gap("none")
RIGID = NONE.model_copy(update={"sensor": NONE.sensor.model_copy(update={"housing": "rigid"})})
BESIDE, ABOVE, PRESS = 13.0e-3, 0.02, 1.5e-3


def test_a_rim_beside_the_gel_stops_the_arm_and_leaves_no_mark(mug_bench: NominalBench) -> None:
    world, stage = World(mug_bench, RIGID, 0), Stage()
    stage.step = 0
    vertices = mug_bench.mesh.vertices
    top = float(vertices[:, 2].max())
    outer = float(vertices[vertices[:, 2] > top - 2e-3][:, 1].max())
    down = np.column_stack([[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, -1.0]])  # the gel's x across the rim
    object_from_gel = transform(down, np.array([0.0, outer + BESIDE, top + ABOVE]))
    start = mug_bench.base_from_object @ object_from_gel @ inverse(mug_bench.flange_from_gel)
    joints = nearest_branch("ur5e", start, np.array(HOME), RANGE)
    assert joints is not None
    arm, axis = InProcessArm("ur5e", joints, world, stage), np.array([0.0, 0.0, -1.0])
    arm.zero_force()
    speeds, began = Speeds(), arm.state().time
    assert arm.move_until_contact(axis, speeds.approach, speeds.touch_force, 0.05)
    met = arm.state().base_from_flange
    assert world.penetration(met, 0) == 0.0
    reached = ABOVE + mug_bench.sensor.gel_thickness
    assert 0.0 <= float((met - start)[:3, 3] @ axis) - reached < 0.2e-3
    no_way: Any = None
    motion = ContactMotion(joints, joints[None], start, axis, ABOVE, PRESS)
    PressPerformer(no_way, speeds, explores=True)._press(motion, arm, began)
    pressed = arm.state()
    assert (
        speeds.press_force
        < abs(float(pressed.wrench[:3] @ axis))
        < SafetySection.model_fields["force_press"].default
    )
    assert float((pressed.base_from_flange - met)[:3, 3] @ axis) < 0.5 * PRESS
    assert world.penetration(pressed.base_from_flange, 0) == 0.0
