"""How well printed dots are placed: drawn ones against their truth, real ones against what was published.

``PYTHONPATH=. python tests/benchmarks/touch/bench_markers.py`` needs the real data for its last lines.
Seconds are of the processor, one process.
"""

import gzip
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path
from time import process_time

import numpy as np
from rich.console import Console
from rich.table import Table
from scipy.spatial import cKDTree

from calibration.markers.at_rest import lay_lattice
from calibration.markers.dots import find_dots
from harness.basics.arrays import FloatArray
from harness.bench.sensor import GELSIGHT_R15, MarkerGrid
from harness.picture.image_file import read_image
from harness.sim.gel.markers import marker_displacements
from tests.oracles.marker_tensors import tensor_map
from tests.samples.drawn_dots import DrawnDots
from tests.support.real_data import WHY_NOT, find_shared_data

CONSOLE = Console(width=118, highlight=False)
_TIMES = 15

DRAWN = {
    "radius 6 px, black ink, noise of 1.5 grey levels": DrawnDots(),
    "without noise": DrawnDots(noise=0.0),
    "noise of 4 grey levels": DrawnDots(noise=4.0),
    "lens blurred by 1.5 px": DrawnDots(blur=1.5),
    "grey ink, noise of 3": DrawnDots(ink=0.75, noise=3.0),
    "radius 2.5 px": DrawnDots(radius=2.5, spacing=12.0, wide=15, high=11),
    "radius 1.7 px": DrawnDots(radius=1.7, spacing=10.0, wide=20, high=15),
    "lens that bends by 6 px": DrawnDots(barrel=6.0),
    "pixels 3 % too high": DrawnDots(aspect=1.03),
}


def main() -> None:
    """Print both tables, and what moving dots takes."""
    CONSOLE.print(_motion())
    table = Table(title="drawn dots: pixels off their true places", title_justify="left")
    for heading in ("case", "dots", "rms", "worst", "stated", "rms over stated", "seconds"):
        table.add_column(heading, justify="left" if heading == "case" else "right")
    for words, drawn in DRAWN.items():
        picture = drawn.picture(seed=3)
        began = process_time()
        dots = find_dots(picture)
        seconds = process_time() - began
        _, at = cKDTree(drawn.places()).query(dots.places)
        off = dots.places - drawn.places()[at]
        rms, over = np.sqrt(np.mean(off**2)), np.sqrt(np.mean((off / dots.sigma[:, None]) ** 2))
        numbers = (rms, np.abs(off).max(), np.median(dots.sigma))
        texts = [f"{number:.4f}" for number in numbers]
        table.add_row(
            words, f"{len(off)} of {drawn.wide * drawn.high}", *texts, f"{over:.2f}", f"{seconds:.2f}"
        )
    CONSOLE.print(table)
    data = find_shared_data()
    if data is None:
        CONSOLE.print(WHY_NOT)
        return
    for number in (0, 1):
        folder = data / "tactile/fots_markers"
        dots = find_dots(read_image(folder / f"{number}.png"))
        rows = np.genfromtxt(folder / f"{number}.csv", delimiter=",", names=True)
        published = np.column_stack([rows["Mx"] + rows["dx"], rows["My"] + rows["dy"]])
        away, at = cKDTree(published).query(dots.places)
        off = dots.places - published[at]
        middle = np.median(off, axis=0)
        scatter = 1.4826 * np.median(np.abs(off - middle), axis=0)
        lattice = lay_lattice(dots.places)
        bent = np.hypot(*lattice.local.T)
        far, out = np.count_nonzero(away > 2.0), np.count_nonzero(bent > 0.06 * lattice.spacing)
        CONSOLE.print(
            f"FOTS {number}.png, touched: {len(off)} dots in {lattice.rows} x {lattice.columns}, "
            f"{dots.cut} cut by the border; off the published whole pixels by {middle.round(2)} px, scatter "
            f"{scatter.round(2)}, {far} by more than 2; stated {np.median(dots.sigma):.3f} px; off the grid "
            f"by {bent.max():.1f} px at most, {out} dots by more than 6 %"
        )


def _motion() -> str:
    """Seconds of the processor for a press of a ball on a gel with 100 dots, and for a tensor map."""
    sensor = replace(GELSIGHT_R15, markers=MarkerGrid(10, 10, 1.5e-3, 0.3e-3))
    y, x = np.mgrid[:120, :160].astype(np.float64)
    away = sensor.pitch * np.hypot(x - 70.0, y - 55.0)
    pressed = np.maximum(0.0, np.sqrt(np.maximum(6e-3**2 - away**2, 0.0)) - 5e-3)[None]
    marker_displacements(pressed, sensor)
    took = [_seconds(partial(marker_displacements, pressed, sensor, nodes)) for nodes in (2.0, 4.0, 8.0)]
    words = ", ".join(f"{1e3 * one:.1f}" for one in took)
    said = f"100 dots under a ball, 2, 4 and 8 nodes to a thickness: {words} ms"
    data = find_shared_data()
    if data is None:
        return said
    offsets, press, slide = _dome(data)
    began = process_time()
    known = tensor_map(offsets, press, slide, 0.3e-3)
    made = process_time() - began
    return f"{said}; tensor map of {len(known.offsets)} published nodes: {made:.2f} s"


def _seconds(call: Callable[[], object]) -> float:
    took = []
    for _ in range(_TIMES):
        began = process_time()
        call()
        took.append(process_time() - began)
    return float(np.median(took))


def _dome(data: Path) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Offsets from the apex, and displacements pressed and slid, metres."""
    cases = []
    for case in ("dz", "dxdz"):
        parts = []
        for axis in "xyz":
            with gzip.open(data / f"tactile/taxim/fem_markers/dome_{case}_0.3_{axis}.txt.gz") as lines:
                parts.append(np.loadtxt(lines, skiprows=1))
        cases.append(parts)
    places = cases[0][0][:, 1:4]
    middle = 0.5 * (places.min(axis=0) + places.max(axis=0))
    press, slide = (np.stack([part[:, 4] for part in parts], axis=1) for parts in cases)
    return places[:, :2] - middle[:2], press, slide


if __name__ == "__main__":
    main()
