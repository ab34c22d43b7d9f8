"""What the levels of ``touch.shapes`` cost and lose: error in um and in the picture, against seconds.

``python tests/benchmarks/touch/bench_touch_shapes.py mug bowl [--objectfile FOLDER] [--presses 200]
[--repeat 9]`` presses at random places that were never coded, with every level in one run. Without a folder,
codes are made and written first. Seconds are CPU time of one thread for each map, from presses to the gel's
surface, median and quartiles; the last rows are maps a second on two threads, by the clock and for each
second of a core, of which a busy machine gives less than two.
Rows that cost nothing stand beside: one map for each coded place, and the untouched gel.
"""

import argparse
import tempfile
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
from rich.console import Console
from threadpoolctl import threadpool_limits

from harness.authoring.touch.data import DEPTHS, MOST_TILT, draw_presses, reference_maps
from harness.authoring.touch.profiles import touch_profile
from harness.authoring.touch.touch import OFF, spaced_codes
from harness.basics.arrays import AnyArray, ByteArray, FloatArray
from harness.basics.materials import material
from harness.bench.sensor import GELSIGHT_R15
from harness.effects.touch import prepare_optics
from harness.objectfile.entries import Provenance
from harness.objectfile.file import ObjectFile, create_object
from harness.objectfile.surface_search import SurfaceSearch
from harness.objectfile.touch.graph import codes_graph
from harness.objectfile.touch.nodes import nodes_from
from harness.objectfile.touch.part import CodesPart, TouchPart, with_touch
from harness.objectfile.touch.touch import (
    CHUNK,
    CodeMaps,
    Maps,
    ObjectTouch,
    open_touch,
)
from harness.objects.household import MATERIALS, build
from harness.picture.image_metrics import mean_square, psnr, ssim
from harness.sim.gel.height_map import RasterMesh
from harness.sim.gel.press_pose import Presses
from harness.sim.optics.tactile_calibration import shipped_calibration
from tests.benchmarks.results import benchmark_parser, finish_figure
from tests.docs.results import Cell

CALIBRATION = shipped_calibration("gelsight_r15_bench")
SKIRT = CALIBRATION.header.skirt
SEED = 11


def main() -> None:
    """Print or write one table of all objects."""
    parser = benchmark_parser(__doc__)
    parser.add_argument("objects", nargs="*", metavar="OBJECT", help=f"built in: {', '.join(MATERIALS)}")
    parser.add_argument("--objectfile", type=Path)
    parser.add_argument("--profile", default="standard")
    parser.add_argument("--presses", type=int, default=200)
    parser.add_argument("--repeat", type=int, default=9)
    asked = parser.parse_args()
    rows: list[list[Cell]] = []
    with tempfile.TemporaryDirectory() as folder, threadpool_limits(limits=1):
        for name in asked.objects or ["mug"]:
            if asked.objectfile is None:
                rows += measure(_made(name, asked.profile, Path(folder) / name), asked)
        if asked.objectfile is not None:
            rows += measure(ObjectFile.open(asked.objectfile), asked)
    maps = "map error, rms, median [um]; 90th percentile [um]; map, median [dB]; 10th percentile [dB]"
    pictures = "picture error [grey levels]; picture, median [dB]; 10th percentile [dB]; SSIM"
    times = f"one map [CPU ms]; one of {CHUNK} [CPU ms]"
    finish_figure("touchnet", "objects", f"object, maps from; {maps}; {pictures}; {times}", rows)


def _made(name: str, profile: str, folder: Path) -> ObjectFile:
    mesh, made_of = build(name), material(MATERIALS[name])
    coded, spacing = spaced_codes(RasterMesh(mesh), GELSIGHT_R15, touch_profile(profile).codes, 0)
    codes = CodesPart(codes_graph(coded.patches, GELSIGHT_R15, SKIRT), coded.nodes, OFF * spacing)
    origin = Provenance(licence="CC0-1.0")
    part = TouchPart(GELSIGHT_R15, SKIRT, DEPTHS, MOST_TILT, 2e-3, origin, codes)
    return with_touch(create_object(folder, name, mesh, made_of, origin), part)


def measure(of: ObjectFile, asked: argparse.Namespace) -> list[list[Cell]]:
    """Measure one object."""
    coded, reference = open_touch(of, "codes"), open_touch(of, "reference")
    codes = coded.maps
    assert isinstance(codes, CodeMaps)
    presses = _possible(of, codes, asked.presses)
    truth = reference.at(presses)
    name, rows = f"{of.description.name}, {len(presses)} presses", list[list[Cell]]()
    for said, touch in (("rasteriser (reference)", reference), ("codes", coded)):
        errors = _errors(touch.at(presses), truth)
        rows.append([f"{name}: {said}", *errors, *_costs(touch.at, presses, asked.repeat)])
    nearest = _errors(_nearest(of, codes, reference, presses), truth)
    rows.append([f"{name}: nearest coded place", *nearest, None, None])
    rows.append([f"{name}: untouched gel", *_errors(np.zeros_like(truth), truth), None, None])
    console = Console(width=150)
    pairs = (
        ("codes, two graphs", _twice(of)),
        ("rasteriser", _halves(reference.maps, reference.maps)),
    )
    for said, maps in pairs:
        console.print(
            f"  {said}, batches of {CHUNK} on two threads: {_throughput(maps, presses, asked.repeat)}"
        )
    return rows


def _possible(of: ObjectFile, codes: CodeMaps, count: int) -> Presses:
    """Presses that nothing of the object is in the way of, near a code."""
    presses = draw_presses(of.mesh, SurfaceSearch(of.mesh).spread(count, SEED)[0], SEED)
    possible = reference_maps(RasterMesh(of.mesh), presses, GELSIGHT_R15, SKIRT).possible
    return presses[np.flatnonzero(possible & (codes.nodes.nearest(presses)[1] <= codes.nodes.most))]


def _nearest(of: ObjectFile, codes: CodeMaps, reference: ObjectTouch, presses: Presses) -> FloatArray:
    """One map for each coded place: upright, half as deep as may be, at the yaw that is asked."""
    entry = reference.entry.codes
    assert entry is not None
    nodes = nodes_from(of.read(entry.nodes), entry.nodes.file)[codes.nodes.nearest(presses)[0]]
    nothing = np.zeros(len(presses))
    depths = nothing + np.mean(DEPTHS)
    return reference.at(Presses(nodes.points, nodes.normals, depths, nothing, nothing, presses.yaws))


def _pictures(maps: FloatArray) -> ByteArray:
    drawn: ByteArray = prepare_optics(CALIBRATION, "fast", GELSIGHT_R15).render(maps).images
    return drawn


def _errors(found: FloatArray, truth: FloatArray) -> tuple[str, ...]:
    rms = np.sqrt(((found - truth) ** 2).mean(axis=(1, 2)))
    decibels = 20.0 * np.log10(2e-3 / np.maximum(rms, 1e-13))
    pairs = list(zip(_pictures(found), _pictures(truth), strict=True))
    grey = np.sqrt([mean_square(a, b) for a, b in pairs])
    alike = np.minimum([psnr(a, b) for a, b in pairs], 99.0)
    return (
        f"{1e6 * np.median(rms):.3g}",
        f"{1e6 * np.quantile(rms, 0.9):.3g}",
        f"{np.median(decibels):.1f}" if rms.any() else "same",
        f"{np.quantile(decibels, 0.1):.1f}" if rms.any() else "same",
        f"{np.median(grey):.2f}",
        f"{np.median(alike):.1f}" if grey.any() else "same",
        f"{np.quantile(alike, 0.1):.1f}" if grey.any() else "same",
        f"{np.median([ssim(a, b) for a, b in pairs]):.3f}",
    )


def _costs(ask: Callable[[Presses], object], presses: Presses, repeat: int) -> tuple[str, str]:
    return _cost(ask, [presses[k : k + 1] for k in range(CHUNK)], repeat), _cost(
        ask, [presses[:CHUNK]], repeat
    )


def _cost(ask: Callable[[Presses], object], batches: list[Presses], repeat: int) -> str:
    took = []
    for batch in batches[:1]:
        ask(batch)
    for _ in range(repeat):
        begun = time.thread_time()
        for batch in batches:
            ask(batch)
        took.append(1e3 * (time.thread_time() - begun) / sum(len(batch) for batch in batches))
    low, middle, high = np.quantile(took, [0.25, 0.5, 0.75])
    return f"{middle:.3g} ({low:.3g} to {high:.3g})"


def _twice(of: ObjectFile) -> Maps:
    """Two graphs, each on its own thread."""
    return _halves(*(open_touch(of, "codes").maps for _ in range(2)))


def _halves(first: Maps, second: Maps) -> Maps:
    pool = ThreadPoolExecutor(2)

    def both(presses: Presses) -> AnyArray:
        middle = len(presses) // 2
        jobs = [pool.submit(first, presses[:middle]), pool.submit(second, presses[middle:])]
        return np.concatenate([job.result() for job in jobs])

    return both


def _throughput(maps: Maps, presses: Presses, repeat: int) -> str:
    presses = presses[: len(presses) - len(presses) % CHUNK]
    batches = [presses[k : k + CHUNK] for k in range(0, len(presses), CHUNK)]
    maps(batches[0])
    rates = []
    for _ in range(repeat):
        begun, worked = time.perf_counter(), time.process_time()
        for batch in batches:
            maps(batch)
        took, used = time.perf_counter() - begun, time.process_time() - worked
        rates.append((len(presses) / took, used / took, len(presses) / used))
    best = max(rates)
    middle, _, each = np.median(rates, axis=0)
    got = f"best {best[0]:.0f} on the {best[1]:.2f} cores it got"
    return f"{middle:.0f} a second, {got}; {each:.0f} for a core's second"


if __name__ == "__main__":
    main()
