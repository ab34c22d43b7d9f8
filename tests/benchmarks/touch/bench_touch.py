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


def _line(what: str, seconds: FloatArray) -> None:
    low, middle, high = np.percentile(seconds * 1e3, [10, 50, 90])
    print(f"  {what:<44} {middle:9.3f} ms  ({low:.3f} to {high:.3f})  {1e3 / middle:8.0f} /s")  # noqa: T201


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
        for rows in (120, 240, 480):
            _size(_sensor(rows), contacts, world)
        _inverse(contacts, world, bench)


def _size(
    sensor: TactileSensor, contacts: list[tuple[RasterMesh, FloatArray]], world: TactileCalibration
) -> None:
    skirt = R15_SKIRT if sensor.rows == 120 else TAXIM_SKIRT
    gaps = np.concatenate([height_maps(raster, pose, sensor) for raster, pose in contacts])
    pressed = over_range(penetration(gaps, sensor), sensor)[0]
    area = np.median((pressed > 0).mean(axis=(1, 2)))
    print(  # noqa: T201
        f"\n{sensor.columns} x {sensor.rows}, {len(contacts)} contacts of {DEPTH * 1e3:g} mm on six objects, "
        f"median contact area {area:.0%} of the window"
    )
    _line("height map", _timed(lambda k: height_maps(*contacts[k], sensor), len(contacts)))
    _beside_mujoco(sensor, contacts, gaps)
    few = 12
    _line("gel, exact", _timed(lambda k: deform(pressed[k : k + 1], skirt), few))
    _line("gel, fast", _timed(lambda k: deform(pressed[k : k + 1], skirt, "fast"), few))
    _line("gel, original (OpenCV)", _timed(lambda k: _original_gel(pressed[k], skirt), few))
    gel = deform(pressed[:few], skirt, "fast")
    calibration = _enlarged(world, sensor)
    for level in LEVELS:
        optics = Optics(calibration, level)
        _line(f"colour, {level}", _timed(lambda k, optics=optics: optics.render(gel[k : k + 1]), few))  # type: ignore[misc]
    table, background = calibration.table.astype(np.float64), calibration.background.astype(np.float64)
    _line(
        "colour, original arithmetic (numpy)",
        _timed(lambda k: _original_optics(gel[k] / sensor.pitch, table, background), few),
    )


def _beside_mujoco(
    sensor: TactileSensor, contacts: list[tuple[RasterMesh, FloatArray]], ours: FloatArray
) -> None:
    scenes = [(raster.mesh, pose) for raster, pose in contacts]
    try:
        drawn, seconds = gaps_drawn(scenes, sensor)
    except CannotDraw as why:
        print(f"  MuJoCo draws nothing here: {why}")  # noqa: T201
        return
    theirs = np.concatenate(drawn)
    both = np.isfinite(ours) & np.isfinite(theirs)
    apart = np.abs(ours[both] - theirs[both]) * 1e6
    one_alone = (np.isfinite(ours) != np.isfinite(theirs)).mean()
    middle, most = np.percentile(apart, [50.0, 99.0])
    print(  # noqa: T201
        f"  {'MuJoCo renderer':<44} {seconds * 1e3:9.3f} ms; ours is {middle:.4f} um from it in the median,\n"
        f"    {most:.4f} at p99, {apart.max():.2f} at most; {(apart > 10.0).mean():.1e} of the pixels beyond "
        f"10 um, {one_alone:.1e} met by one alone"
    )


def _inverse(
    contacts: list[tuple[RasterMesh, FloatArray]], world: TactileCalibration, bench: TactileCalibration
) -> None:
    gaps = np.concatenate([height_maps(raster, pose, GELSIGHT_R15) for raster, pose in contacts])
    gel = deform(over_range(penetration(gaps, GELSIGHT_R15), GELSIGHT_R15)[0], R15_SKIRT)
    images = Optics(world, "exact").render(gel).images
    print("\n160 x 120, image to height map, drawn under the world's calibration")  # noqa: T201
    _line("inverse, the bench's calibration", _timed(lambda k: invert(images[k : k + 1], bench), len(images)))
    for name, calibration in (("the world's own", world), ("the bench's", bench)):
        read = invert(images, calibration)
        error = (read.height - gel)[read.anchored]
        rms = np.sqrt(np.mean(error**2, axis=(1, 2))) * 1e6
        level = error - error.mean(axis=(1, 2), keepdims=True)
        shape = np.sqrt(np.mean(level**2, axis=(1, 2))) * 1e6
        print(  # noqa: T201
            f"  {name} calibration: rms {np.median(rms):.0f} um (90 %: {np.percentile(rms, 90):.0f}), "
            f"level aside {np.median(shape):.0f} um (90 %: {np.percentile(shape, 90):.0f}), "
            f"{read.anchored.mean():.0%} with some gel at rest in view"
        )
