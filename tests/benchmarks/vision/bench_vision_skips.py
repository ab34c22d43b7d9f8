"""What a picture leaves out and what that changes, and what asking for shadows costs, of trained networks.

``PYTHONPATH=. python tests/benchmarks/vision/bench_vision_skips.py OBJECT builtin:mug --views 8``: an
ObjectFile's own networks from around, one thread. *Apart* is from every sample of the shell with no ray
ended, as shown before white.
"""

import argparse
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import TypeVar

import numpy as np

from harness.basics.arrays import AnyArray, FloatArray
from harness.basics.faces.ray_mesh import RayMesh
from harness.commands.output import ANSWERS
from harness.objectfile.file import ObjectFile
from harness.objectfile.vision.coverage.faces import FaceCubes
from harness.objectfile.vision.coverage.outline import is_closed
from harness.objectfile.vision.settings import RenderSettings
from harness.objectfile.vision.surface import SurfaceExtras
from harness.objectfile.vision.view import camera_for, light_for, turned
from harness.objectfile.vision.vision import ObjectVision, open_vision
from harness.picture.image_metrics import psnr
from harness.picture.pinhole import DirectionalLight, Pinhole
from harness.sim.light.appearance import plain
from harness.sim.light.appearance_source import appearance_of
from harness.sim.light.direct_image import LitObject
from harness.sim.light.lambert import irradiance, places_seen, sees_light
from tests.oracles.asked_surface import told_of

WAYS = {
    "whole shell": RenderSettings(termination=0.0),
    "default": RenderSettings(),
    "lead 1": RenderSettings(lead=1.0),
    "one sample": RenderSettings(level="one_sample"),
    "graph alone": RenderSettings(level="onnx"),
}
View = tuple[Pinhole, DirectionalLight]
T = TypeVar("T")


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path)
    parser.add_argument("mesh", help="of its look, for exact pictures")
    parser.add_argument("--views", type=int, default=8)
    parser.add_argument("--size", type=int, default=256)
    parser.add_argument("--units", help="of a mesh file's numbers")
    given = parser.parse_args()
    of = ObjectFile.open(given.folder)
    vision = open_vision(of, 1)
    first = camera_for(vision.surface, given.size, given.size)
    about, each = vision.surface.bounds.mean(axis=0), 2.0 * np.pi / given.views
    views = [turned(first, light_for(first), about, k * each) for k in range(given.views)]
    pictures(vision, LitObject(appearance_of(given.mesh, given.units)), views)
    agreement(vision, views)
    told(vision, views)


def pictures(vision: ObjectVision, lit: LitObject, views: list[View]) -> None:
    """Samples, CPU and differences of each way to draw."""
    exact = [lit.render(camera, [light], 4).image.display(1.0) for camera, light in views]
    whole: list[AnyArray] = []
    for name, settings in WAYS.items():
        vision.picture(*views[0], settings)
        found = [timed(partial(vision.picture, camera, light, settings)) for camera, light in views]
        shown = [image.image.display(1.0) for image, _ in found]
        whole = whole or shown
        apart = np.stack(shown).astype(np.float64) - np.stack(whole)
        near = np.mean([psnr(one, other) for one, other in zip(shown, exact, strict=True)])
        ANSWERS.print(
            f"{name:12s} {np.mean([image.samples for image, _ in found]):8.0f} samples, CPU "
            f"{middle([cpu for _, cpu in found])}, apart {np.sqrt(np.mean(apart**2)):.2f}/255, at most "
            f"{np.abs(apart).max():.0f}; from exact {near:.2f} dB"
        )


def agreement(vision: ObjectVision, views: list[View]) -> None:
    """How far the kernel's pictures are from the graph's, in linear light and coverage."""
    apart = []
    for camera, light in views:
        one, other = (vision.picture(camera, light, WAYS[way]).image for way in ("default", "graph alone"))
        apart.append(max(np.abs(one.colour - other.colour).max(), np.abs(one.alpha - other.alpha).max()))
    ANSWERS.print(f"kernel and graph differ by {max(apart):.1e} of linear light or coverage at most")


def told(vision: ObjectVision, views: list[View]) -> None:
    """Visibility and normals by rays through all faces, as networks are taught, and as the renderer asks."""
    mesh = vision.surface
    cubes, took = timed(partial(FaceCubes.of, mesh))
    exact, look, asked = (
        RayMesh(mesh),
        plain(mesh, (1.0, 1.0, 1.0)),
        SurfaceExtras(mesh, 4, is_closed(mesh)),
    )

    def by_all_faces(eye: FloatArray, ways: FloatArray, light: DirectionalLight) -> AnyArray:
        row, hits = np.zeros((len(ways), 4), np.float32), exact.first_hits(eye, ways)
        met = np.flatnonzero(hits.face >= 0)
        places = places_seen(look, hits.face[met], hits.weights[met], ways[met])
        row[met, 0] = sees_light(exact, places, light, irradiance(places, light, mesh.diagonal) > 0.0)
        row[met, 1:] = places.normals
        return row

    seconds: list[tuple[float, float, float]] = []
    differ = rays = 0
    for camera, light in [views[0], *views]:
        ways = np.ascontiguousarray(camera.directions().reshape(-1, 3))
        depth = exact.first_hits(camera.eye, ways).distance
        ways, depth = ways[np.isfinite(depth)], depth[np.isfinite(depth)].astype(np.float32)
        one, by_faces = timed(partial(by_all_faces, camera.eye, ways, light))
        ask = partial(told_of, asked, camera.eye, ways, light.direction, depth)
        (other, relit), (_, again) = timed(ask), timed(ask)
        seconds.append((by_faces, relit, again))
        differ, rays = differ + int((one != other).any(axis=1).sum()), rays + len(ways)
    slow, relit_s, fast = np.array(seconds[1:]).T.tolist()
    ANSWERS.print(
        f"told of the surface: by all faces CPU {middle(slow)}, as the renderer asks {middle(fast)}, "
        f"under another lamp {middle(relit_s)}; cubes in "
        f"{len(cubes.starts) // 64} bricks that take {1e3 * took:.0f} ms; {differ} of {rays} rays differ"
    )


def timed(work: Callable[[], T]) -> tuple[T, float]:
    """What it gives, and CPU seconds."""
    begun = time.process_time()
    return work(), time.process_time() - begun


def middle(seconds: list[float]) -> str:
    """The median with the quartiles, ms."""
    low, half, high = 1e3 * np.quantile(seconds, (0.25, 0.5, 0.75))
    return f"{half:.1f} ({low:.1f} to {high:.1f}) ms"


if __name__ == "__main__":
    main()
