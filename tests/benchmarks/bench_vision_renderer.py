"""What a picture costs from the tiny networks, by level, size and cores, beside the paper's arithmetic.

The networks are solved for by least squares (``fitted_look``), not trained: they have an opaque surface
where the mug has one, which the number of samples depends on, and are no measure of what training reaches.
Seconds are of a whole picture, from camera to linear light. On a busy machine look at the CPU seconds.

python tests/benchmarks/bench_vision_renderer.py --repeat 15 [--sizes 128 256] [--sheet out.png] [--plain]
python tests/benchmarks/bench_vision_renderer.py --errors
"""

import argparse
import time
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
from fitted_look import fitted_look
from published_view import LIGHT, camera_of
from rich.console import Console

from harness.arrays import AnyArray, FloatArray
from harness.image_file import write_png
from harness.mesh import Mesh
from harness.objectfile.vision_graph import vision_graph
from harness.objectfile.vision_network import SIZES, VisionModel
from harness.objectfile.vision_outline import mesh_outline
from harness.objectfile.vision_plain import Asked, evaluate
from harness.objectfile.vision_render import VisionRenderer
from harness.objectfile.vision_settings import COVERS, RenderSettings, VisionLevel
from harness.objectfile.vision_tiles import LANES, OUTPUTS, SAMPLES, relu_tile
from harness.objectfile.vision_work import Crew, Room
from harness.objects.household import build
from harness.pinhole import DirectionalLight, Pinhole
from harness.sim.compiled import compiled_fast

CONSOLE = Console(width=220, highlight=False)
PLAIN_SAMPLES = 384
"""Of a ray in the paper, between 0.01 and 4 of its units: 1.2 units are the box."""


@compiled_fast
def _tiles(given: AnyArray, weight: AnyArray, bias: AnyArray, out: AnyArray, count: int) -> None:
    for _ in range(count):
        relu_tile(given.ctypes.data, weight.ctypes.data, bias.ctypes.data, out.ctypes.data, len(given))


def peak() -> float:
    """FLOP/s of one core multiplying and adding in registers and the first cache, by CPU seconds."""
    given, weight = np.zeros((64, SAMPLES), np.float32), np.zeros((64, OUTPUTS), np.float32)
    bias, out = np.zeros(OUTPUTS, np.float32), np.zeros((OUTPUTS, SAMPLES), np.float32)
    _tiles(given, weight, bias, out, 10)
    rates = []
    for _ in range(5):
        begun = time.process_time()
        _tiles(given, weight, bias, out, 20_000)
        rates.append(20_000 * 2.0 * 64 * OUTPUTS * SAMPLES / (time.process_time() - begun))
    return max(rates)


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


def plain_seconds(model: VisionModel, mesh: Mesh, size: int, crop: int) -> float:
    """Of the paper's arithmetic: every sample of every ray that is in a cell with a network, in numpy.

    A crop in the middle is measured and the whole extrapolated by the samples there are.
    """
    camera, grid = camera_of(mesh, size), model.grid
    longest = float(np.ptp(mesh.bounds, axis=0).max())
    places = np.linspace(0.01, 4.0, PLAIN_SAMPLES) * longest / 1.2
    ways = camera.directions().reshape(-1, 3)
    inside = np.zeros(size, int)

    def samples(rows: FloatArray) -> tuple[FloatArray, AnyArray]:
        points = camera.eye + places[None, :, None] * rows[:, None]
        return points.reshape(-1, 3), grid.networks(points.reshape(-1, 3))

    for row in range(size):
        inside[row] = np.count_nonzero(samples(ways[row * size : (row + 1) * size])[1] >= 0)
    middle = slice((size - crop) // 2, (size + crop) // 2)
    rows = ways.reshape(size, size, 3)[middle, middle].reshape(-1, 3)
    begun = time.process_time()
    points, networks = samples(rows)
    met = np.flatnonzero(networks >= 0)
    views = np.repeat(rows, PLAIN_SAMPLES, axis=0)[met]
    density, colour = evaluate(
        model, Asked(networks[met], points[met], views, LIGHT.direction, np.zeros((len(met), 0)))
    )
    thick = np.zeros(len(networks))
    thick[met] = density * (places[1] - places[0])
    behind = np.cumsum(thick.reshape(-1, PLAIN_SAMPLES), axis=1)
    weights = np.exp(-(behind - thick.reshape(behind.shape))) * -np.expm1(-thick.reshape(behind.shape))
    np.add.at(np.zeros((len(rows), 3)), met // PLAIN_SAMPLES, weights.ravel()[met, None] * colour)
    return (time.process_time() - begun) * float(inside.sum()) / max(len(met), 1)


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
    found, cover = mesh_outline(mesh, True, camera, side, Crew(1), Room()), np.zeros(camera.pixels)
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
            seconds = plain_seconds(model, mesh, 256, 16)
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
