"""How well printed dots are placed: drawn ones against their truth, real ones against what was published.

``PYTHONPATH=tests python tests/benchmarks/bench_markers.py`` needs the real data for its last lines. Seconds
are of the processor, one process.
"""

from time import process_time

import numpy as np
from drawn_dots import DrawnDots
from real_data import WHY_NOT, find_shared_data
from rich.console import Console
from rich.table import Table
from scipy.spatial import cKDTree

from calibration.markers.dots import find_dots
from calibration.markers.lattice import lay_lattice
from harness.image_file import read_image

CONSOLE = Console(width=118, highlight=False)

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
    """Print both tables."""
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


if __name__ == "__main__":
    main()
