"""Touch, timed: ``python -m pytest tests/benchmarks/touch/bench_touch.py -m benchmark -s``.

CPU time of one thread, median and the span from the tenth to the ninetieth percentile, beside
the original method's arithmetic in plain numpy and OpenCV. No other package is needed.
"""

import dataclasses
import time
from collections.abc import Callable

import cv2
import numpy as np
import pytest

from harness.basics import geometry
from harness.basics.arrays import FloatArray
from harness.bench.sensor import GELSIGHT_R15, TactileSensor
from harness.objects.household import build
from harness.sim.gel.gel import R15_SKIRT, TAXIM_SKIRT, GelSkirt, deform, over_range
from harness.sim.gel.height_map import RasterMesh, height_maps, penetration
from harness.sim.optics.inverse import invert
from harness.sim.optics.optics import Optics, OpticsLevel
from harness.sim.optics.tactile_calibration import TactileCalibration, shipped_calibration
from tests.benchmarks.results import finish_figure, spread
from tests.docs.results import Cell, Spread
from tests.oracles.mujoco_depth import CannotDraw, gaps_drawn

pytestmark = pytest.mark.benchmark

CONTACTS = 48
DEPTH = 1e-3
LEVELS: tuple[OpticsLevel, ...] = ("exact", "fast", "smooth")


def _timed(work: Callable[[int], object], repeats: int) -> FloatArray:
    work(0)
    seconds = np.empty(repeats)
    for k in range(repeats):
        began = time.thread_time()
        work(k)
        seconds[k] = time.thread_time() - began
    return seconds


def _time(work: Callable[[int], object], repeats: int) -> Spread:
    return spread(_timed(work, repeats) * 1e3, 0.1, 0.9)


def _poses(name: str, rng: np.random.Generator) -> tuple[RasterMesh, FloatArray]:
    """Random contacts, tilted to 15 degrees, with nothing far behind the gel in the sensor's window."""
    raster = RasterMesh(build(name, 2e-3))
    mesh = raster.mesh
    poses: list[FloatArray] = []
    while len(poses) < CONTACTS // 6:
        face = rng.choice(len(mesh.faces), p=mesh.face_areas / mesh.face_areas.sum())
        away = -mesh.face_normals[face]
        about = np.cross(away, rng.normal(size=3))
        axis = geometry.rotation_about(about / np.linalg.norm(about), rng.uniform(0, np.radians(15))) @ away
        rotation = geometry.frame_facing(axis, rng.uniform(0, 2 * np.pi))
        pose = geometry.inverse(geometry.transform(rotation, mesh.corners[face].mean(axis=0)))
        first = height_maps(raster, pose[None], GELSIGHT_R15).min()
        if first < -5e-3:
            continue
        pose[2, 3] -= first + DEPTH
        poses.append(pose)
    return raster, np.array(poses)


def _sensor(rows: int) -> TactileSensor:
    scale = rows // 120
    return dataclasses.replace(GELSIGHT_R15, rows=rows, columns=160 * scale, pitch=GELSIGHT_R15.pitch / scale)


def _enlarged(calibration: TactileCalibration, sensor: TactileSensor) -> TactileCalibration:
    background = cv2.resize(calibration.background, (sensor.columns, sensor.rows))
    header = dataclasses.replace(calibration.header, pitch=sensor.pitch)
    return dataclasses.replace(calibration, header=header, background=np.asarray(background, dtype=np.uint8))


def _original_gel(pressed: FloatArray, skirt: GelSkirt) -> FloatArray:
    surface, core = pressed.copy(), pressed > skirt.core * pressed.max()
    for width in skirt.kernels:
        surface = np.asarray(cv2.GaussianBlur(surface, (width, width), 0))
        surface[core] = pressed[core]
    return np.asarray(cv2.GaussianBlur(surface, (skirt.final, skirt.final), 0), dtype=np.float64)


def _original_optics(surface: FloatArray, table: FloatArray, background: FloatArray) -> FloatArray:
    """Taxim's arithmetic as its authors describe it: whole-array operations in double precision."""
    down, right = np.zeros_like(surface), np.zeros_like(surface)
    down[1:-1, 1:-1] = (surface[2:, 1:-1] - surface[:-2, 1:-1]) / 2
    right[1:-1, 1:-1] = (surface[1:-1, 2:] - surface[1:-1, :-2]) / 2
    magnitude = np.arctan(np.hypot(down, right))
    direction = np.where(magnitude > 0, np.arctan2(down, right), 0.0)
    bins = len(table)
    row = np.floor(magnitude / (0.5 * np.pi / (bins - 1))).astype(int)
    column = np.floor((direction + np.pi) / (2 * np.pi / (bins - 1))).astype(int)
    y, x = np.mgrid[: surface.shape[0], : surface.shape[1]].astype(float)
    terms = np.stack([x * x, y * y, x * y, x, y, np.ones_like(x)], axis=-1)
    channels = [np.sum(terms * table[row, column, :, c], axis=-1) for c in range(3)]
    return np.asarray(np.clip(np.rint(np.stack(channels, axis=-1) + background), 0, 255))


def test_touch(capsys: pytest.CaptureFixture[str]) -> None:
    """Height map, gel, colour and inverse, at three sizes."""
    world, bench = shipped_calibration("gelsight_r15_world"), shipped_calibration("gelsight_r15_bench")
    rng = np.random.default_rng(0)
    scenes = [_poses(name, rng) for name in ("mug", "bowl", "plate", "pitcher", "tray", "wrench")]
    contacts = [(raster, pose[None]) for raster, poses in scenes for pose in poses]
    with capsys.disabled():
        sensors = [_sensor(rows) for rows in (120, 240, 480)]
        sizes = [_size(sensor, contacts, world) for sensor in sensors]
        heads = (f"{sensor.columns} x {sensor.rows} [CPU ms] .3g" for sensor in sensors)
        table = [(stage, *(size.get(stage) for size in sizes)) for stage in sizes[0]]
        stage = f"stage, {len(contacts)} presses of {DEPTH * 1e3:g} mm: median (10th to 90th percentile)"
        finish_figure("touch", "speed", "; ".join((stage, *heads)), table)
        _inverse(contacts, world, bench)


def _size(
    sensor: TactileSensor, contacts: list[tuple[RasterMesh, FloatArray]], world: TactileCalibration
) -> dict[str, Cell]:
    skirt = R15_SKIRT if sensor.rows == 120 else TAXIM_SKIRT
    gaps = np.concatenate([height_maps(raster, pose, sensor) for raster, pose in contacts])
    pressed = over_range(penetration(gaps, sensor), sensor)[0]
    few = 12
    rows: dict[str, Cell] = {
        "contact area, median [% of the window]": 100.0 * float(np.median((pressed > 0).mean(axis=(1, 2)))),
        "height map": _time(lambda k: height_maps(*contacts[k], sensor), len(contacts)),
        **_beside_mujoco(sensor, contacts, gaps),
        "gel, exact": _time(lambda k: deform(pressed[k : k + 1], skirt), few),
        "gel, fast": _time(lambda k: deform(pressed[k : k + 1], skirt, "fast"), few),
        "gel, original arithmetic (OpenCV)": _time(lambda k: _original_gel(pressed[k], skirt), few),
    }
    gel = deform(pressed[:few], skirt, "fast")
    calibration = _enlarged(world, sensor)
    for level in LEVELS:
        optics = Optics(calibration, level)
        rows[f"colours, {level}"] = _time(lambda k, optics=optics: optics.render(gel[k : k + 1]), few)  # type: ignore[misc]
    table, background = calibration.table.astype(np.float64), calibration.background.astype(np.float64)
    rows["colours, original arithmetic (numpy)"] = _time(
        lambda k: _original_optics(gel[k] / sensor.pitch, table, background), few
    )
    return rows


def _beside_mujoco(
    sensor: TactileSensor, contacts: list[tuple[RasterMesh, FloatArray]], ours: FloatArray
) -> dict[str, Cell]:
    scenes = [(raster.mesh, pose) for raster, pose in contacts]
    try:
        drawn, seconds = gaps_drawn(scenes, sensor)
    except CannotDraw:
        return {}
    theirs = np.concatenate(drawn)
    both = np.isfinite(ours) & np.isfinite(theirs)
    apart = np.abs(ours[both] - theirs[both]) * 1e6
    one_alone = (np.isfinite(ours) != np.isfinite(theirs)).mean()
    middle, most = np.percentile(apart, [50.0, 99.0])
    return {
        "height map by MuJoCo's renderer": seconds * 1e3,
        "difference of the height maps, median [um]": float(middle),
        "the same, 99th percentile [um]": float(most),
        "pixels more than 10 um apart [%]": 100.0 * float((apart > 10.0).mean()),
        "pixels hit by one method alone [%]": 100.0 * float(one_alone),
    }


def _inverse(
    contacts: list[tuple[RasterMesh, FloatArray]], world: TactileCalibration, bench: TactileCalibration
) -> None:
    gaps = np.concatenate([height_maps(raster, pose, GELSIGHT_R15) for raster, pose in contacts])
    gel = deform(over_range(penetration(gaps, GELSIGHT_R15), GELSIGHT_R15)[0], R15_SKIRT)
    images = Optics(world, "exact").render(gel).images
    seconds = _time(lambda k: invert(images[k : k + 1], bench), len(images))
    table: list[tuple[Cell, ...]] = [("time of an inversion [CPU ms]", seconds, None)]
    for name, calibration in (("the world's own", world), ("the bench's", bench)):
        read = invert(images, calibration)
        error = (read.height - gel)[read.anchored]
        rms = np.sqrt(np.mean(error**2, axis=(1, 2))) * 1e6
        level = error - error.mean(axis=(1, 2), keepdims=True)
        shape = np.sqrt(np.mean(level**2, axis=(1, 2))) * 1e6
        for words, off in (("rms error [um]", rms), ("rms error without the mean [um]", shape)):
            table.append(
                (f"{name} calibration, {words}", float(np.median(off)), float(np.percentile(off, 90)))
            )
    finish_figure("touch", "image to height map", "quantity; median; 90th percentile", table)
