"""How well printed dots are placed: drawn ones against their truth, real ones against what was published.

``PYTHONPATH=. python tests/benchmarks/touch/bench_markers.py`` needs the real data for its last lines.
Seconds are of the processor, one process.
"""

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path
from time import process_time

import numpy as np
from scipy.spatial import cKDTree

from calibration.markers.at_rest import lay_lattice
from calibration.markers.dots import find_dots
from harness.basics.arrays import FloatArray
from harness.bench.sensor import GELSIGHT_R15, MarkerGrid
from harness.picture.image_file import read_image
from harness.sim.gel.markers import marker_displacements
from tests.benchmarks.results import benchmark_parser, finish_figure
from tests.docs.results import Cell
from tests.oracles.marker_tensors import tensor_map
from tests.samples.drawn_dots import DrawnDots
from tests.support.real_data import WHY_NOT, find_shared_data

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
    """Print or write both tables."""
    benchmark_parser(__doc__).parse_args()
    rows: list[tuple[Cell, ...]] = []
    for words, drawn in DRAWN.items():
        picture = drawn.picture(seed=3)
        began = process_time()
        dots = find_dots(picture)
        seconds = process_time() - began
        _, at = cKDTree(drawn.places()).query(dots.places)
        off = dots.places - drawn.places()[at]
        rms, over = np.sqrt(np.mean(off**2)), np.sqrt(np.mean((off / dots.sigma[:, None]) ** 2))
        stated, count = float(np.median(dots.sigma)), f"{len(off)} of {drawn.wide * drawn.high}"
        rows.append((words, count, float(rms), float(np.abs(off).max()), stated, float(over), seconds))
    heads = "case; dots; rms error [px] .4f; worst [px] .3f; stated [px] .4f; rms over stated .2f"
    finish_figure("touch_markers", "drawn", f"{heads}; CPU time [s] .1f", rows)
    values = _motion()
    data = find_shared_data()
    for number in (0, 1):
        if data is None:
            break
        folder = data / "tactile/fots_markers"
        dots = find_dots(read_image(folder / f"{number}.png"))
        marks = np.genfromtxt(folder / f"{number}.csv", delimiter=",", names=True)
        published = np.column_stack([marks["Mx"] + marks["dx"], marks["My"] + marks["dy"]])
        away, at = cKDTree(published).query(dots.places)
        off = dots.places - published[at]
        middle = np.median(off, axis=0)
        scatter = 1.4826 * np.median(np.abs(off - middle), axis=0)
        lattice = lay_lattice(dots.places)
        bent = np.hypot(*lattice.local.T)
        far, out = np.count_nonzero(away > 2.0), np.count_nonzero(bent > 0.06 * lattice.spacing)
        grid = (
            f"{len(off)} on a grid of {lattice.rows} x {lattice.columns}; {dots.cut} at the border left out"
        )
        values += [
            (f"whole dots of FOTS {number}.png, touched", grid),
            (
                "their offset from the published whole pixels; its scatter",
                f"{middle.round(2)}; {scatter.round(2)} px",
            ),
            ("dots farther than 2 px; stated error", f"{far}; {np.median(dots.sigma):.3f} px"),
            ("largest distance from the grid; dots above 6 %", f"{bent.max():.1f} px; {out}"),
        ]
    finish_figure("touch_markers", "other", "quantity; value", values)


def _motion() -> list[tuple[str, str]]:
    """Measure CPU time for a press of a ball on a gel with 100 dots, and for a tensor map."""
    sensor = replace(GELSIGHT_R15, markers=MarkerGrid(10, 10, 1.5e-3, 0.3e-3))
    y, x = np.mgrid[:120, :160].astype(np.float64)
    away = sensor.pitch * np.hypot(x - 70.0, y - 55.0)
    pressed = np.maximum(0.0, np.sqrt(np.maximum(6e-3**2 - away**2, 0.0)) - 5e-3)[None]
    marker_displacements(pressed, sensor)
    took = [_seconds(partial(marker_displacements, pressed, sensor, nodes)) for nodes in (2.0, 4.0, 8.0)]
    words = "; ".join(f"{1e3 * one:.1f}" for one in took)
    rows = [("motion of 100 dots under a ball of 6 mm, 2; 4; 8 nodes to a thickness", f"{words} ms")]
    data = find_shared_data()
    if data is None:
        return [*rows, ("real data", WHY_NOT)]
    offsets, press, slide = _dome(data)
    began = process_time()
    known = tensor_map(offsets, press, slide, 0.3e-3)
    made = process_time() - began
    return [*rows, (f"tensor map of {len(known.offsets)} published nodes", f"{made:.2f} s")]


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
            file = next((data / "tactile/taxim/fem_markers").glob(f"dome_{case}_0.3_{axis}.txt*"))
            parts.append(np.loadtxt(file, skiprows=1))
        cases.append(parts)
    places = cases[0][0][:, 1:4]
    middle = 0.5 * (places.min(axis=0) + places.max(axis=0))
    press, slide = (np.stack([part[:, 4] for part in parts], axis=1) for parts in cases)
    return places[:, :2] - middle[:2], press, slide


if __name__ == "__main__":
    main()
