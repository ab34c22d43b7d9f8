"""A run that never was: the built-in mug, six contacts, images drawn from its height maps."""

from dataclasses import replace

import numpy as np
import pytest

from harness.basics.arrays import ByteArray, FloatArray
from harness.basics.geometry import frame_facing, inverse, transform, translation
from harness.basics.mesh import Mesh
from harness.bench.kinematics import inverse as joints_for
from harness.bench.sensor import GELSIGHT_R15
from harness.objects.household import build
from harness.report.data import (
    AnswerRow,
    Artefact,
    BenchPart,
    BenchScene,
    ContactRow,
    EffectRun,
    ErrorCurve,
    InstrumentRow,
    PeakLine,
    ReportData,
    SenseAnswer,
    Sound,
    SpectrogramPair,
    StrikeLine,
    TwinDeviation,
)
from harness.report.figures.pictures import CLAY, arm_parts, sensor_parts, table_and_pedestal
from harness.report.values import Missing, Posterior
from harness.sim.gel.height_map import RasterMesh, height_maps, penetration

BASE_FROM_OBJECT = translation(np.array([-0.5, 0.0, 0.25]))
GEL_FROM_FLANGE = translation(np.array([0.0, 0.0, -0.12]))
DEPTH = 1.2e-3
FLAGS = {3: ("slipped: down-weighted",), 5: ("repeated contact 4",)}


def contact_points(mesh: Mesh) -> list[int]:
    """Faces of the outer wall and of the handle within reach from the arm's side."""
    centres = mesh.corners.mean(axis=1)
    wanted = np.array([[0.04 * np.cos(a), 0.04 * np.sin(a), z] for a, z in zip(ANGLES, HEIGHTS, strict=True)])
    wanted[-1] = [0.073, 0.0, 0.055]
    return [int(np.argmin(np.linalg.norm(centres - place, axis=1))) for place in wanted]


ANGLES = np.radians([-50.0, -35.0, -28.0, 30.0, 30.0, 0.0])
HEIGHTS = np.array([0.03, 0.05, 0.07, 0.08, 0.06, 0.055])


def looks(height: FloatArray, tint: float) -> ByteArray:
    """A gel lit from three sides in three colours."""
    down, across = np.gradient(height / GELSIGHT_R15.pitch)
    lights = [(0.9, 0.2), (-0.6, 0.8), (-0.4, -0.9)]
    channels = [118.0 + tint + 210.0 * (a * across + b * down) for a, b in lights]
    image: ByteArray = np.clip(np.stack(channels, axis=-1), 0, 255).astype(np.uint8)
    return image


def posterior(mesh: Mesh, truth: FloatArray, number: int) -> Posterior:
    rng = np.random.default_rng(number)
    points = mesh.vertices[rng.integers(len(mesh.vertices), size=6000)]
    points = points + rng.normal(0.0, 2e-4, points.shape)
    width = 0.03 / number**1.4 + 1.2e-3
    weights = np.exp(-0.5 * (np.linalg.norm(points - truth, axis=1) / width) ** 2)
    mirrored = truth * np.array([-1.0, 1.0, 1.0])
    weights += 0.3 / number * np.exp(-0.5 * (np.linalg.norm(points - mirrored, axis=1) / width) ** 2)
    best = points[int(np.argmax(weights))]
    share = 1.0 / (1.0 + 0.3 / number)
    return Posterior(
        points, weights, best, np.array([best, mirrored]), np.array([share, 1.0 - share]), 2.1 * width
    )


def contact(mesh: Mesh, raster: RasterMesh, face: int, number: int) -> ContactRow:
    truth = mesh.corners[face].mean(axis=0)
    object_from_gel = transform(frame_facing(-mesh.face_normals[face], 0.4 * number), truth)
    pressed = object_from_gel @ translation(np.array([0.0, 0.0, DEPTH]))
    height = penetration(height_maps(raster, inverse(pressed)[None], GELSIGHT_R15), GELSIGHT_R15)[0]
    noise = np.random.default_rng(number).normal(0.0, 2e-5, height.shape)
    found = posterior(mesh, truth, number)
    return ContactRow(
        number=number,
        step=f"touch-{number:02d}",
        live=looks(height + noise, 3.0),
        simulated=looks(height, 0.0),
        live_height=height + np.abs(noise),
        simulated_height=height,
        object_from_gel=object_from_gel,
        posterior=found,
        truth=truth,
        error=float(np.linalg.norm(found.estimate - truth)),
        flags=FLAGS.get(number, ()),
        notes=(("press depth", "1.20 mm"), ("force", "6.4 N")),
    )


def gel_pose(shown: ContactRow) -> FloatArray:
    assert not isinstance(shown.object_from_gel, Missing)
    return shown.object_from_gel


RESONANCES = (1210.0, 2440.0, 3890.0, 7015.0)


def decays(scale: float) -> FloatArray:
    """Levels of the resonances as they die away, over a floor."""
    times, frequencies = np.linspace(0.01, 0.39, 60), np.linspace(0.0, 12_000.0, 200)
    lines = [-0.5 * ((frequencies[:, None] - scale * f) / 60.0) ** 2 - 0.04 * f * times for f in RESONANCES]
    levels: FloatArray = np.maximum(np.max(lines, axis=0), -90.0)
    return levels


def sound(mesh: Mesh, truth: FloatArray) -> Sound:
    """By touch no answer; by sound a wide one; by both a narrow one."""
    wide, narrow = posterior(mesh, truth, 2), posterior(mesh, truth, 6)
    times, frequencies = np.linspace(0.01, 0.39, 60), np.linspace(0.0, 12_000.0, 200)
    return Sound(
        senses=(
            SenseAnswer("touch", Missing("no place on this object explains the <images>")),
            SenseAnswer("audio", wide, 7.31e-3, 2.4e-3, 0.0312),
            SenseAnswer("both", narrow, 1.27e-3, 6.1e-5, 0.231),
        ),
        strikes=(
            StrikeLine(1, "", 41.23, 3.1e-4, 2.44),
            StrikeLine(2, "the hammer hit twice", 18.0, 2.0e-3, 1.2),
            StrikeLine(3, "no strike came"),
            *(StrikeLine(number, "", 38.0, 3.3e-4, 2.1) for number in (4, 5, 6)),
        ),
        pair=SpectrogramPair(6, times, frequencies, decays(1.013), decays(1.0)),
        peaks=(
            PeakLine(1225.7, 31.0, 0.013, -4.0, (1,), 1225.1, 24.0, 0.97, 5.21, 0.2),
            PeakLine(2465.0, 44.0, 0.031, 0.0, (2, 3), 2471.7, 49.0, 0.71, -1.4, 0.2),
            PeakLine(5111.0, 60.0, 0.092, -21.0, (), None, None, 0.88, 0.0, 0.2),
        ),
        set_aside=4,
        band=(180.0, 9400.0),
        scale=1.013,
    )


def true_point(shown: ContactRow) -> FloatArray:
    assert shown.truth is not None
    return shown.truth


@pytest.fixture(scope="session")
def report_data() -> ReportData:
    return sample()


def sample() -> ReportData:
    mesh = build("mug")
    raster = RasterMesh(mesh)
    contacts = tuple(contact(mesh, raster, f, n) for n, f in enumerate(contact_points(mesh), 1))
    gels = np.array([BASE_FROM_OBJECT @ gel_pose(c) for c in contacts])
    joints = joints_for("ur5e", gels[-1] @ GEL_FROM_FLANGE)[4]
    bench = BenchScene(
        (
            BenchPart(mesh, BASE_FROM_OBJECT, CLAY),
            *table_and_pedestal(BASE_FROM_OBJECT, 0.25),
            *sensor_parts(GELSIGHT_R15, gels[-1], GEL_FROM_FLANGE),
            *arm_parts("ur5e", joints),
        ),
        gels,
        np.array([-0.3, 0.0, 0.28]),
    )
    last = contacts[-1].posterior
    assert isinstance(last, Posterior)
    numbers = tuple(float(c.number) for c in contacts)
    return ReportData(
        title="Contact localization on the mug",
        object_name="mug",
        material="ceramic",
        mesh=mesh,
        mock=True,
        made="2026-03-02 14:05",
        command="touchstone run contact-localization --station mock --scene scenes/mug_touch.toml",
        recording="runs/20260302-140512-mug",
        answer=AnswerRow(
            last.estimate,
            0.231,
            last.credible90,
            contacts[-1].error,
            contacts[-1].error,
            2.4e-3,
            0.082,
            0.0252,
            2,
        ),
        contacts=contacts,
        bench=bench,
        error_by_contact=(
            ErrorCurve("touch", numbers, tuple(c.error or 0.0 for c in contacts)),
            ErrorCurve("geometry + tool axis", numbers, (0.071, 0.052, 0.041, 0.033, 0.028, 0.021)),
            ErrorCurve("geometry only", numbers, (0.082, 0.061, 0.05, 0.041, 0.033, 0.025)),
            ErrorCurve("random point", numbers, (0.082,) * 6),
        ),
        error_by_seconds=(
            ErrorCurve(
                "ours",
                (0.004, 0.012, 0.041, 0.19),
                (0.011, 0.0042, 0.0019, 0.0015),
                ("4", "3", "2", "1.5 mm"),
            ),
            ErrorCurve("particle filter", (0.03, 0.09, 0.29, 0.84), (0.019, 0.0045, 0.0025, 0.0017)),
        ),
        instruments=(
            InstrumentRow("arm", "127.0.0.1:30004", 124.98, 125.0, 4812, 0, 0.0021),
            InstrumentRow(
                "gelsight", "http://127.0.0.1:8090/stream", 29.7, 30.0, 1120, 3, 0.019, "reopened once"
            ),
            InstrumentRow("camera", "http://127.0.0.1:8091/stream", None, 10.0, 0, None, None, "not used"),
        ),
        calibrations=(
            Artefact("taxim-r15", "mock-0001", "2026-02-20", 10.0, "1.9 grey levels rms", "3f" * 32),
        ),
        effects=(
            EffectRun("gel.height_map", True, "the estimator needs it", 18220, 3.9),
            EffectRun("gel.deformation", True, "a gel is touched", 18220, 1.2),
            EffectRun("gel.shadow", False, "the sensor casts none (GelSight R1.5 has no grazing light)"),
            EffectRun("room.reverberation", False, "nothing listens: the scene has no microphone"),
        ),
        world={"object yaw": "1.3 deg", "gel centre offset": "(0.4, -0.2) mm", "height gain": "1.04"},
        twin=tuple(TwinDeviation(c.step, 2.1e-4, 4.4e-4, 8e-4, 6.1e-4) for c in contacts),
        versions={"touchstone": "0.1.0", "numpy": "2.3.1", "ur_rtde": "1.6.1"},
        git="054b11f+",
        sound=sound(mesh, true_point(contacts[-1])),
        symmetry="no rotation",
        accuracy={"samples": "2 mm", "kernel": "0.064 mm"},
        warnings=("The calibration was fitted at 22 degrees; the gel was at 27.",),
    )


def without_everything(data: ReportData) -> ReportData:
    gone = Missing("this recording is older than that")
    bare = tuple(
        replace(
            c,
            live=gone,
            simulated=gone,
            live_height=gone,
            simulated_height=gone,
            object_from_gel=gone,
            posterior=gone,
            truth=None,
            error=None,
        )
        for c in data.contacts
    )
    return replace(
        data,
        answer=gone,
        contacts=bare,
        bench=gone,
        error_by_contact=gone,
        error_by_seconds=gone,
        instruments=gone,
        calibrations=gone,
        effects=gone,
        world=gone,
        twin=gone,
        sound=gone,
    )
