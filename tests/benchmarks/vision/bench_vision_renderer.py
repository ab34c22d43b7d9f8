"""What a picture costs from the tiny networks, by level, size and cores, beside the paper's arithmetic.

The networks are solved for by least squares (``fitted_look``), not trained: they have an opaque surface
where the mug has one, which the number of samples depends on, and are no measure of what training reaches.
Seconds are of a whole picture, from camera to linear light. On a busy machine look at the CPU seconds.

python tests/benchmarks/vision/bench_vision_renderer.py --repeat \
    15 [--sizes 128 256] [--sheet out.png] [--plain]
python tests/benchmarks/vision/bench_vision_renderer.py --errors
"""

import argparse
import time
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
from rich.console import Console

from harness.basics.arrays import AnyArray, FloatArray
from harness.basics.mesh import Mesh
from harness.objectfile.vision.coverage.outline import mesh_outline
from harness.objectfile.vision.network.graph import vision_graph
from harness.objectfile.vision.network.network import SIZES
from harness.objectfile.vision.network.tiles import LANES
from harness.objectfile.vision.render import VisionRenderer
from harness.objectfile.vision.settings import COVERS, RenderSettings, VisionLevel
from harness.objectfile.vision.threads import Crew, Workspace
from harness.objects.household import build
from harness.picture.image_file import write_png
from harness.picture.pinhole import DirectionalLight, Pinhole
from tests.oracles.fma_peak import peak
from tests.oracles.paper_march import PLAIN_SAMPLES, paper_seconds
from tests.samples.fitted_look import fitted_look
from tests.samples.published_view import LIGHT, camera_of

CONSOLE = Console(width=220, highlight=False)


def quartiles(took: list[float]) -> str:
    """Milliseconds: median, quartiles and least."""
    low, middle, high = np.quantile(took, [0.25, 0.5, 0.75]) * 1e3
    return f"{middle:7.1f} ({low:.1f} to {high:.1f}, least {min(took) * 1e3:.1f})"


def measured(draw: Callable[[], object], repeat: int) -> tuple[list[float], list[float]]:
    """Seconds on the clock and of CPU time of each call after the first."""
    draw()
    wall, cpu = [], []
    for _ in range(repeat):
        begun, used = time.perf_counter(), time.process_time()
        draw()
        wall.append(time.perf_counter() - begun)
        cpu.append(time.process_time() - used)
    return wall, cpu


def errors(data: bytes, mesh: Mesh) -> None:
    """What ending rays early, beginning them late and few sub-pixels change, at 256."""
    renderer, camera = VisionRenderer(data, mesh), camera_of(mesh, 256)
    every = RenderSettings(termination=0.0, coverage=5)
    whole = renderer.render(camera, LIGHT, every)
    CONSOLE.print(f"  whole shell, no ray ended: {whole.samples} samples")
    for said, settings in (
        ("rays end at 0.03, the default", replace(every, termination=0.03)),
        ("and begin 1 voxel before the mesh", replace(every, termination=0.03, lead=1.0)),
        ("one sample", replace(every, level="one_sample")),
    ):
        found = renderer.render(camera, LIGHT, settings)
        apart = 255.0 * np.abs(found.image.colour - whole.image.colour)
        CONSOLE.print(
            f"  {said}: {found.samples} samples, {np.sqrt(np.mean(apart**2)):.2f}/255 root mean square, "
            f"{apart.max():.1f}/255 at most"
        )
    exact = covered(mesh, camera, 25)
    for side in COVERS:
        error = np.mean((covered(mesh, camera, side) - exact) ** 2)
        CONSOLE.print(f"  coverage {side}: {-10.0 * np.log10(error):.1f} dB against 25 sub-pixels")


def covered(mesh: Mesh, camera: Pinhole, side: int) -> FloatArray:
    """``(pixels,)`` share of each that the mesh covers."""
    found, cover = mesh_outline(mesh, True, camera, side, Crew(1), Workspace()), np.zeros(camera.pixels)
    cover[found.pixels] = found.cover
    return cover


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--sizes", nargs="*", type=int, default=[64, 128, 256, 400])
    parser.add_argument("--repeat", type=int, default=15)
    parser.add_argument("--cores", nargs="*", type=int, default=[1, 2])
    parser.add_argument("--sheet", type=Path)
    parser.add_argument("--plain", action="store_true", help="the paper's arithmetic too (half a minute)")
    parser.add_argument("--errors", action="store_true", help="what knobs change, in place of times")
    given = parser.parse_args()
    mesh, most = build("mug"), peak()
    CONSOLE.print(f"peak of one core: {most / 1e9:.0f} GFLOP/s float32, {LANES} lanes (CPU seconds)")
    CONSOLE.print("networks: least squares, not trained; ms a picture: median (quartiles, least)")
    rows = []
    for name, size in SIZES.items():
        model, _ = fitted_look(mesh, size)
        data = vision_graph(model).SerializeToString(deterministic=True)
        CONSOLE.print(f"{name}: {len(model.grid)} networks, {len(data) / 1e6:.2f} MB")
        if given.errors:
            errors(data, mesh)
            continue
        seen = [measure(name, data, mesh, cores, given, most) for cores in given.cores]
        rows.append(np.hstack(seen[0]))
        if given.plain:
            seconds = paper_seconds(model, mesh, 256, 16)
            CONSOLE.print(
                f"  the paper's arithmetic plainly, {PLAIN_SAMPLES} samples a ray, numpy float64, one core: "
                f"{seconds:.1f} s CPU at 256 (extrapolated from 16 x 16 pixels)"
            )
    if given.sheet is not None and rows:
        write_png(given.sheet, np.vstack(rows))


def measure(
    name: str, data: bytes, mesh: Mesh, cores: int, given: argparse.Namespace, most: float
) -> list[AnyArray]:
    """Every level at every size on some cores; the pictures of the largest."""
    renderer, pictures = VisionRenderer(data, mesh, cores), []
    size = renderer.model.weights.size
    begun = time.perf_counter()
    renderer.render(camera_of(mesh, 64), LIGHT)
    CONSOLE.print(f"  {cores} threads; first picture after opening: {time.perf_counter() - begun:.2f} s")
    levels: tuple[VisionLevel, ...] = ("fused", "one_sample", "onnx")
    for level in levels:
        for pixels in given.sizes:
            camera, settings = camera_of(mesh, pixels), RenderSettings(level=level)
            wall, cpu = measured(partial(renderer.render, camera, LIGHT, settings), given.repeat)
            found = renderer.render(camera, LIGHT, settings)
            rate = found.samples / max(found.seconds["networks"], 1e-9)
            share = rate * 2.0 * size.products / (most * cores)
            CONSOLE.print(
                f"    {name:8}{level:11}{pixels:4} px, {cores} cores: clock {quartiles(wall)}, "
                f"CPU {quartiles(cpu)}; {found.samples} samples, {rate / 1e6:.1f} M/s in networks, "
                f"{100.0 * share:.0f} % of the peak"
            )
        pictures.append(found.image.display())
    lights = [DirectionalLight(np.array([np.cos(a), np.sin(a), 1.0])) for a in np.arange(given.repeat + 1.0)]
    camera = camera_of(mesh, 256)
    coming = iter(lights)
    wall, cpu = measured(lambda: renderer.render(camera, next(coming), RenderSettings()), given.repeat)
    CONSOLE.print(
        f"    {name:8}fused, another light each time, 256 px: clock {quartiles(wall)}, CPU {quartiles(cpu)}"
    )
    return pictures


if __name__ == "__main__":
    main()
