"""The twin's bodies: in the right place, of the maker's shape, and never jumped over."""

from pathlib import Path

import mujoco
import numpy as np
import pytest

from harness.basics.arrays import FloatArray
from harness.basics.errors import WrongUse
from harness.basics.geometry import apply, rotation_about, transform, translation
from harness.basics.mesh import Mesh
from harness.bench import kinematics
from harness.bench.kinematics import ARM_TABLES, LINKS, arm_table
from harness.bench.sensor import GELSIGHT_R15
from harness.objects.household import build
from harness.twin.bench import TwinBench, add_arm, arm_parts, link_from_previous, reaches
from harness.twin.link_hulls import link_hulls, placed
from harness.twin.ways import sweep

TOOL = translation(np.array([0.0, 0.0, 0.12]))
OVER_TABLE = np.radians([0.0, -90.0, 90.0, -90.0, -90.0, 0.0])  # the gel points down
MUG = build("mug", 6e-3)


def bench_with(mesh: Mesh = MUG, at: tuple[float, float, float] = (-0.42, 0.0, 0.25)) -> TwinBench:
    return TwinBench("ur5e", TOOL, GELSIGHT_R15, mesh, translation(np.array(at)))


@pytest.fixture(scope="module")
def bench() -> TwinBench:
    return bench_with()


def box_mesh(low: list[float], high: list[float]) -> Mesh:
    corners = np.array(np.meshgrid(*zip(low, high, strict=True), indexing="ij")).reshape(3, -1).T
    quads = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
    faces = [[q[0], q[i], q[i + 1]] for q in quads for i in (1, 2)]
    return Mesh(corners, np.array(faces))


@pytest.mark.parametrize("model", sorted(ARM_TABLES))
def test_mujoco_puts_the_flange_where_the_tables_do(model: str) -> None:
    spec = mujoco.MjSpec()
    add_arm(spec, model)
    compiled = spec.compile()
    data, flange = mujoco.MjData(compiled), compiled.body("wrist_3").id
    for joints in np.random.default_rng(0).uniform(-np.pi, np.pi, (200, 6)):
        data.qpos[:] = joints
        mujoco.mj_kinematics(compiled, data)
        expected = kinematics.forward(model, joints)
        assert np.abs(data.xpos[flange] - expected[:3, 3]).max() < 1e-12
        assert np.abs(data.xmat[flange].reshape(3, 3) - expected[:3, :3]).max() < 1e-12


@pytest.mark.parametrize("model", sorted(ARM_TABLES))
def test_mujoco_weighs_what_the_tables_say_where_they_say(model: str) -> None:
    spec = mujoco.MjSpec()
    add_arm(spec, model)
    compiled = spec.compile()
    data, table = mujoco.MjData(compiled), arm_table(model)
    joints = np.array([0.4, -1.1, 1.3, -0.6, 0.9, 0.2])
    data.qpos[:] = joints
    mujoco.mj_kinematics(compiled, data)
    frames = kinematics.link_frames(model, joints)
    for link in range(1, 7):
        assert compiled.body_mass[link + 1] == pytest.approx(table.masses[link - 1])
        centre = apply(frames[link], table.centres[link - 1][None])[0]
        assert np.abs(data.xipos[link + 1] - centre).max() < 1e-12
        turn = data.ximat[link + 1].reshape(3, 3)
        tensor = turn @ np.diag(compiled.body_inertia[link + 1]) @ turn.T
        expected = frames[link, :3, :3] @ table.inertias[link - 1] @ frames[link, :3, :3].T
        assert np.abs(tensor - expected).max() < 1e-9


@pytest.mark.parametrize("model", sorted(ARM_TABLES))
def test_no_point_of_a_link_moves_further_than_its_reach_allows(model: str) -> None:
    parts = arm_parts(model)
    reach = reaches(model, parts)
    table, rng = arm_table(model), np.random.default_rng(1)
    attained = np.zeros_like(reach)
    for joints in rng.uniform(-np.pi, np.pi, (300, 6)):
        pose, axes = np.eye(4), []
        for joint in range(1, 7):
            pose = pose @ link_from_previous(table, joint)
            pose = pose @ transform(rotation_about(np.array([0.0, 0, 1]), joints[joint - 1]), np.zeros(3))
            axes.append(pose)
            points = apply(pose, parts[joint].vertices)
            for earlier in range(joint):
                offset = points - axes[earlier][:3, 3]
                aside = np.linalg.norm(np.cross(offset, axes[earlier][:3, 2]), axis=1).max()
                attained[earlier, joint] = max(attained[earlier, joint], aside)
    assert np.all(attained <= reach + 1e-12)
    assert attained[0, 6] > 0.8 * reach[0, 6]  # and the bound is not idle


@pytest.mark.parametrize("model", sorted(ARM_TABLES))
def test_the_shipped_hulls_are_the_makers(shared_data: Path, model: str) -> None:
    theirs = placed(model, shared_data / "robot" / "ur_collision_meshes" / model)
    shipped = link_hulls(model)
    for link in LINKS:
        assert np.abs(theirs[link] - shipped[link]).max() < 1e-7


def test_a_working_posture_is_free_and_gaps_are_true(bench: TwinBench) -> None:
    assert bench.hits(OVER_TABLE) == ()
    near = bench.near(OVER_TABLE, 0.3)
    names = [part.name for part in bench.parts]
    pairs = {(names[a], names[b]) for a, b in near.pairs.tolist()}
    assert ("table", "gel") not in pairs  # it is 0.37 m up
    lower = kinematics.nearest_branch(
        "ur5e",
        translation(np.array([0.0, 0.25, -0.25])) @ kinematics.forward("ur5e", OVER_TABLE),
        OVER_TABLE,
        bench.joint_range,
    )
    assert lower is not None
    height = float(bench.base_from_gel(lower)[2, 3])
    near = bench.near(lower, 0.3)
    table_to_gel = (near.pairs == (names.index("table"), names.index("gel"))).all(axis=1)
    assert near.gaps[table_to_gel].min() == pytest.approx(height, abs=1e-6)


def test_gaps_near_the_object_are_seen_from_as_far_as_asked(bench: TwinBench) -> None:
    names = [part.name for part in bench.parts]
    pair = (names.index("object"), names.index("gel"))
    top = bench.object_top
    for gap in (0.002, 0.03, 0.09):
        base_from_gel = transform(np.diag([1.0, -1.0, -1.0]), np.array([-0.42, 0.0, top + gap]))
        joints = kinematics.nearest_branch(
            "ur5e", base_from_gel @ bench.gel_from_flange, OVER_TABLE, bench.joint_range
        )
        assert joints is not None
        near = bench.near(joints, 0.1)
        seen = near.gaps[(near.pairs == pair).all(axis=1)]
        assert seen.min() == pytest.approx(gap, abs=2e-4)  # the rim is not quite flat


def test_an_object_below_the_table_is_refused() -> None:
    with pytest.raises(WrongUse, match=r"50\.0 mm"):
        bench_with(at=(-0.42, 0.0, -0.05))


def test_an_object_on_the_table_has_no_pedestal_and_one_above_has() -> None:
    standing, raised = bench_with(at=(-0.42, 0.0, 0.0)), bench_with()
    assert standing.mujoco_model.ngeom == raised.mujoco_model.ngeom - 1


def test_a_thin_wire_between_two_free_ends_is_not_jumped_over() -> None:
    wire = box_mesh([-5e-4, -5e-4, 0.0], [5e-4, 5e-4, 0.5])
    gel = kinematics.forward("ur5e", OVER_TABLE) @ TOOL
    bench = bench_with(wire, at=(float(gel[0, 3]), float(gel[1, 3]), 0.0))
    for turn in (0.15, 0.4, 0.9, 1.7):
        start, end = OVER_TABLE.copy(), OVER_TABLE.copy()
        start[0], end[0] = start[0] - turn, end[0] + 0.8 * turn
        assert bench.hits(start) == ()
        assert bench.hits(end) == ()
        blocked = sweep(bench, start, end)
        assert blocked is not None
        assert {"object"} == {hit.second for hit in blocked.hits}


def test_a_sweep_says_what_a_thousand_samples_say(bench: TwinBench) -> None:
    rng = np.random.default_rng(4)
    counts = {True: 0, False: 0}
    for _ in range(25):
        end = OVER_TABLE + rng.uniform(-1, 1, 6) * [1.0, 0.6, 0.6, 1.0, 1.0, 1.0]
        blocked = sweep(bench, OVER_TABLE, end)
        first = next(
            (s for s in np.linspace(0, 1, 600) if bench.hits(OVER_TABLE + s * (end - OVER_TABLE))), None
        )
        counts[blocked is None] += 1
        assert (blocked is None) == (first is None)
        if blocked is not None and first is not None:
            assert blocked.share == pytest.approx(first, abs=0.02)
    assert min(counts.values()) > 2


def test_the_inside_of_a_mug_is_free_where_its_hull_is_not(bench: TwinBench) -> None:
    small = transform(np.diag([1.0, -1.0, -1.0]), np.array([-0.42, 0.0, bench.object_top - 0.03]))
    joints = kinematics.nearest_branch("ur5e", small @ bench.gel_from_flange, OVER_TABLE, bench.joint_range)
    assert joints is not None
    near = bench.near(joints, bench.clearance)
    names = [part.name for part in bench.parts]
    assert (near.pairs == (names.index("object"), names.index("gel"))).all(axis=1).any()
    assert bench.hits(joints) == ()


def test_a_bench_keeps_its_inputs_from_being_changed() -> None:
    pose: FloatArray = translation(np.array([-0.42, 0.0, 0.25]))
    bench = TwinBench("ur5e", TOOL, GELSIGHT_R15, MUG, pose)
    pose[0, 3] = 5.0
    assert bench.base_from_object[0, 3] == -0.42


def test_a_station_narrows_the_makers_joint_range_and_never_widens_it() -> None:
    wide = np.array([[-7.0] * 6, [1.0, 7.0, 7.0, 7.0, 7.0, 7.0]])
    bench = TwinBench(
        "ur5e", TOOL, GELSIGHT_R15, MUG, translation(np.array([-0.42, 0, 0.25])), joint_range=wide
    )
    makers = arm_table("ur5e").joint_range
    assert np.array_equal(bench.joint_range[0], makers[0])
    assert np.array_equal(bench.joint_range[1], [1.0, *makers[1, 1:]])
