"""What the codes of touch err and cost on built-in objects, beside the rasteriser, on one core and on two.

python tests/benchmarks/touch/bench_touchnet.py mug bowl wrench --presses 200
"""

import argparse
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor

import numpy as np
from rich.console import Console

from harness.authoring.touch.data import DEPTHS
from harness.authoring.touch.metrics import PressBench
from harness.authoring.touch.profiles import touch_profile
from harness.authoring.touch.touch import OFF, opened_codes, spaced_codes
from harness.basics.arrays import AnyArray
from harness.bench.sensor import GELSIGHT_R15
from harness.objectfile.runtime import Network
from harness.objectfile.touch.graph import codes_graph
from harness.objectfile.touch.nodes import NodeSearch
from harness.objectfile.touch.part import CODES, codes_tensors
from harness.objectfile.touch.touch import CHUNK, CodeMaps, ReferenceMaps
from harness.objectfile.touch_entries import GelEntry
from harness.objects.household import build
from harness.sim.gel.gel import skirt_for
from harness.sim.gel.height_map import RasterMesh
from harness.sim.gel.presses import Presses

CONSOLE = Console(width=120, highlight=False)


def per_map(ask: Callable[[Presses], object], presses: Presses, repeat: int) -> tuple[float, float, float]:
    """Median and quartiles, ms a map."""
    ask(presses)
    took = []
    for _ in range(repeat):
        begun = time.perf_counter()
        ask(presses)
        took.append((time.perf_counter() - begun) / len(presses) * 1e3)
    low, middle, high = np.quantile(took, [0.25, 0.5, 0.75])
    return float(middle), float(low), float(high)


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser()
    parser.add_argument("objects", nargs="*", default=["mug"])
    parser.add_argument("--profile", default="standard")
    parser.add_argument("--presses", type=int, default=60)
    parser.add_argument("--repeat", type=int, default=20)
    given = parser.parse_args()
    for name in given.objects:
        measure(name, given.profile, given.presses, given.repeat)


def measure(name: str, profile: str, presses: int, repeat: int) -> None:
    """One object."""
    sensor, mesh = GELSIGHT_R15, build(name)
    skirt, raster = skirt_for(sensor), RasterMesh(mesh)
    begun = time.perf_counter()
    coded, spacing = spaced_codes(raster, sensor, touch_profile(profile).codes, 0)
    graph = codes_graph(coded.patches, sensor, skirt)
    seconds, data = time.perf_counter() - begun, graph.SerializeToString()
    CONSOLE.print(
        f"{name}: {len(coded.nodes)} places {spacing * 1e3:g} mm apart, {len(data) / 1e6:.1f} MB, "
        f"coded in {seconds:.1f} s"
    )
    off = OFF * spacing
    maps = opened_codes(graph, coded.nodes, off, sensor)
    bench = PressBench(mesh, raster, sensor, skirt, coded.nodes, off)
    for kind, kind_of in (("trained", bench.at_nodes), ("unseen", bench.between_nodes)):
        found = kind_of(maps, presses, 0)
        CONSOLE.print(f"  {kind} places: {len(found.presses)} of {found.asked} presses possible")
        for row, values in found.rows().items():
            median, tenth = values["psnr_db_median"], values["psnr_db_p10"]
            CONSOLE.print(f"    {row:16} PSNR median {median:6.1f} dB, 10th percentile {tenth:6.1f} dB")
    inputs, outputs = codes_tensors(len(coded.nodes), off + DEPTHS[1], sensor)
    search = NodeSearch(coded.nodes, off)
    two = CodeMaps(Network(data, CODES, inputs, outputs, 2), search)
    other = CodeMaps(Network(data, CODES, inputs, outputs), search)
    pool = ThreadPoolExecutor(2)

    def halves(asked: Presses) -> list[AnyArray]:
        middle = len(asked) // 2
        jobs = [pool.submit(maps, asked[:middle]), pool.submit(other, asked[middle:])]
        return [job.result() for job in jobs]

    reference = ReferenceMaps(raster, GelEntry.of(sensor, skirt))
    batch = found.presses[:CHUNK]
    for said, ask, asked in (
        ("codes, one map", maps, batch[:1]),
        (f"codes, {CHUNK} at a time", maps, batch),
        (f"codes, {CHUNK} at a time, two threads", two, batch),
        (f"codes, {CHUNK} at a time, two graphs", halves, batch),
        ("rasteriser and skirt", reference, batch),
    ):
        middle, low, high = per_map(ask, asked, repeat)
        spread = f"{middle:.3f} ms a map ({low:.3f} to {high:.3f})"
        CONSOLE.print(f"  {said:36} {spread}, {1e3 / middle:.0f} a second")


if __name__ == "__main__":
    main()
