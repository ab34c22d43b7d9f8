"""A whole run over every wire, and the same cell of the table in process: the same readings and answer.

The arm on its wires stops where its packets let it, some hundredths of a millimetre from where
the simulated one stops. So the readings are compared where the wired arm was: there the world in
process has the same truth and shows the same picture, and the answer is the same. How far the two
arms' poses and the two answers lie apart is printed.

One short run is made with every test run; ``python -m pytest tests/runs/test_wires_match_process.py
-m benchmark -s`` makes one of six contacts for each object of the localization table.
"""

import json
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

from experiments.contact_localization.answer import Answer
from experiments.contact_localization.cells import ContactCell
from experiments.contact_localization.posterior.estimate import Estimate
from harness.basics.arrays import ByteArray, FloatArray
from harness.basics.geometry import inverse
from harness.bench.gap import load_gap
from harness.bench.scene import SceneFile
from harness.bench.station import PRESS
from harness.bench.station_file import load_station, station_path
from harness.experiment.subjects import REAL, objects
from harness.objects.household import MATERIALS
from harness.recording.observation import Observation
from harness.recording.recording import Recording
from harness.recording.run_folder import RunFiles
from harness.recording.session import Quiet
from mocks.camera.gelsight_stream import encode
from mocks.in_process.bench import in_process_bench
from mocks.lab_scene import nominal_bench
from mocks.world.gap_draw import GapDraw
from mocks.world.world import World
from tests.support import sessions as session_of
from tests.support.localization import answer, dials, estimate
from tests.support.real_data import WHY_NOT, find_shared_data
from tests.support.whole_run import copied, touch_scene

pytestmark = [
    pytest.mark.skipif(sys.platform != "linux", reason="loopback addresses 127.x.y.z need Linux"),
]

GAP, SEED = "default", 0
SAME_PLACE = 1e-6
"""m: doubles travel the wires, so what is left is the rotation vector's rounding."""

SAME_PRESS = 0.3e-3
"""m between the two arms when pressed: the wired one finds the first touch from noisy packets."""

GREY_LEVELS = 1e-2
"""Share of values that may fall on the other side of a grey level."""


@dataclass(frozen=True, eq=False)
class Side:
    """One of the two runs."""

    run: RunFiles  #: its folder.
    truth: dict[str, Any]  #: what its world wrote.
    found: Answer  #: its answer.

    @property
    def poses(self) -> FloatArray:
        """``(contacts, 4, 4)``, base_from_flange as recorded while pressed."""
        gel_from_flange = inverse(self.run.station.flange_from_gel)
        return np.array([seen.base_from_gel @ gel_from_flange for seen in self.found.readings.observations])

    def points(self) -> FloatArray:
        """``(contacts, 3)`` m, true."""
        return np.array([contact["point_in_object_m"] for contact in self.truth["contacts"]])


def side(recording: Recording) -> Side:
    run = RunFiles(recording)
    truth = json.loads(recording.truth_path.read_text(encoding="utf-8"))
    return Side(run, truth, answer(run, dials()))


def both(scene: SceneFile, folder: Path) -> tuple[Side, Side]:
    """Over the wires and in process, of one plan."""
    started = session_of.start(scene, load_station(station_path("mock")), SEED, GAP, folder / "wires")
    wired, simulated = started.recording, copied(started.recording, folder / "process", truth=False)
    complete = session_of.perform_on_bench(wired, Quiet()).complete
    assert complete
    run = RunFiles(simulated)
    bench = in_process_bench(run.scene, run.station, run.context)
    assert session_of.perform_on(bench, simulated, Quiet()).complete
    return side(wired), side(simulated)


def world_of(run: RunFiles) -> World:
    mesh = None if run.scene.object.builtin is not None else run.mesh
    nominal = nominal_bench(
        run.scene, run.station, mesh, run.scene.base_from_object(run.mesh), GapDraw(load_gap(GAP), SEED)
    )
    return World(nominal, load_gap(GAP), SEED)


def shown(world: World, pose: FloatArray, step: int) -> ByteArray:
    """The picture as the stream carries it, RGB."""
    jpeg = encode(world.tactile_image(pose, step, PRESS))
    image = cv2.imdecode(np.frombuffer(jpeg, np.uint8), cv2.IMREAD_COLOR)
    return np.asarray(image, dtype=np.uint8)[..., ::-1]


def answered_where_the_wired_arm_was(wired: Side, world: World) -> Estimate:
    """The estimate from the pictures that the world in process shows there."""
    read = wired.found.readings
    seen = tuple(
        Observation(observed.base_from_gel, shown(world, pose, step)[None])
        for step, (observed, pose) in enumerate(zip(read.observations, wired.poses, strict=True))
    )
    return estimate(seen, read.model, read.prior, dials(), seed=SEED)


def distance(one: FloatArray, other: FloatArray) -> float:
    return float(np.linalg.norm(one - other, axis=-1).max())


def compare(name: str, scene: SceneFile, folder: Path) -> None:
    wired, simulated = both(scene, folder)
    for key in ("differences", "base_from_object", "seed"):
        assert wired.truth[key] == simulated.truth[key]
    world = world_of(wired.run)
    told = np.array([contact["base_from_flange"] for contact in wired.truth["contacts"]])
    assert distance(wired.poses[:, :3, 3], told[:, :3, 3]) < SAME_PLACE
    points = np.array([world.true_contact(pose, k) for k, pose in enumerate(wired.poses)])
    assert distance(points, wired.points()) < SAME_PLACE
    others = [
        np.mean(shown(world, pose, k) != frame)
        for k, (pose, seen) in enumerate(zip(wired.poses, wired.found.readings.observations, strict=True))
        for frame in seen.images
    ]
    assert max(others) < GREY_LEVELS
    apart = distance(wired.poses[:, :3, 3], simulated.poses[:, :3, 3])
    assert apart < SAME_PRESS
    report(name, wired, simulated, answered_where_the_wired_arm_was(wired, world), apart, others)


def report(
    name: str, wired: Side, simulated: Side, there: Estimate, apart: float, others: list[np.floating[Any]]
) -> None:
    ends = [one.found.last.position_in_object for one in (wired, simulated)]
    errors = [
        1e3 * distance(end, one.points()[-1]) for end, one in zip(ends, (wired, simulated), strict=True)
    ]
    of_same_poses = 1e3 * distance(ends[0], there.position_in_object)
    print(  # noqa: T201
        f"{name:<10} {len(wired.poses)} contacts; arms {1e3 * apart:.3f} mm apart; pictures differ in "
        f"{100 * max(others):.3f} % of values; answers {of_same_poses:.4f} mm apart of the same poses, "
        f"{1e3 * distance(*ends):.3f} mm of each arm's own; "
        f"errors {errors[0]:.2f} mm over the wires, {errors[1]:.2f} mm in process",
        flush=True,
    )


@pytest.mark.slow  # a press and a strike over the wires are compared in tests/wire
def test_a_run_over_every_wire_reads_what_the_bench_in_process_reads(tmp_path: Path) -> None:
    compare("mug", touch_scene(contacts=2, spacing="close"), tmp_path)


@pytest.mark.benchmark
@pytest.mark.parametrize("name", [*MATERIALS, *REAL])
def test_each_object_of_the_table(name: str, tmp_path: Path) -> None:
    scenes = objects(find_shared_data())
    if name not in scenes:
        pytest.skip(WHY_NOT)
    compare(name, ContactCell(name, GAP, SEED, "close").create_scene(scenes[name]), tmp_path)
