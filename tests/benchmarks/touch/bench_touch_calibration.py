"""Mark-free calibration on published presses, scored and timed, and what damage it refuses.

``python tests/benchmarks/touch/bench_touch_calibration.py [r15] [fots] [damage] [--repeats N]`` needs the
real data. Scores are medians over the presses with the tenth and ninetieth percentile; seconds are of one
process, on the clock and of the processor.
"""

import argparse
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
from rich.console import Console

from calibration.taxim.gates import check_set, refusals, sightings
from calibration.taxim.held_out import WITHIN, decibels
from calibration.taxim.mark_free import Identity, MarkFree, calibrate
from calibration.taxim.pictures import Pictures, read_pictures
from calibration.taxim.smooth_fit import contact_pixels
from calibration.taxim.table import table_shades
from harness.basics.arrays import AnyArray, ByteArray, FloatArray, IntArray
from harness.basics.errors import CalibrationRefused
from harness.sim.optics.published_pack import read_table
from tests.benchmarks.results import benchmark_parser, finish_figure, spread
from tests.docs.results import Cell
from tests.support.real_data import WHY_NOT, find_shared_data

CONSOLE = Console(width=118, highlight=False)
R15 = Identity("GelSight R1.5", "ObjectFolder 2.0", "CC BY 4.0", "2026-01-01", 0.1245e-3, 2.0e-3)
FOTS = Identity("GelSight", "FOTS", "MIT", "2026-01-01", 1e-3 / 19.58, 2.35e-3)

SCORES = {
    "table": "table",
    "smooth": "smooth",
    "unrefitted": "table, centre as detected",
    "nothing": "untouched gel",
}
"""Scores of presses held out in eight folds; the centre is refitted unless stated."""

SEARCHED = np.arange(-3.0, 3.01, 0.5)
"""Pixels about the fitted centre in which the published table may choose its own."""


def main() -> None:
    """Measure what was asked for; all of it without a word."""
    options = _options()
    data = find_shared_data()
    if data is None:
        raise SystemExit(WHY_NOT)
    wanted = ["r15", "fots", "damage"] if "all" in options.what else options.what
    r15 = read_pictures(data / "tactile/objectfolder_calibs")
    rows: list[list[Cell]] = []
    if "r15" in wanted:
        made, row = _measured("R1.5, 160 x 120", r15, R15, options.repeats)
        rows.append(row)
        _published(made, r15, data / "tactile/objectfolder_calibs/polycalib.npz")
    if "fots" in wanted:
        folder = data / "tactile/fots_ball_presses"
        fots = read_pictures(folder / "gelsight", folder / "gelsight_bg.png")
        rows.append(_measured("FOTS GelSight, 240 x 320", fots, FOTS, options.repeats)[1])
    if rows:
        scores = "; ".join(f"{words}: median (10th to 90th percentile) [dB] .2f" for words in SCORES.values())
        finish_figure("touch_calibration", "colours", f"set; used; refused; {scores}; time [CPU s] .1f", rows)
    if "damage" in wanted:
        _damage(r15)


def _measured(title: str, pictures: Pictures, who: Identity, repeats: int) -> tuple[MarkFree, list[Cell]]:
    processors = []
    for _ in range(repeats):
        worked = time.process_time()
        made = calibrate(pictures, who)
        processors.append(time.process_time() - worked)
    scores = [spread([vars(press.score)[which] for press in made.used], 0.1, 0.9) for which in SCORES]
    row: list[Cell] = [title, len(made.used), len(made.refused), *scores, spread(processors)]
    CONSOLE.print(
        f"contact line {made.contact_radius:.1f} px of a ball of {who.ball:.1f} px, round to "
        f"{made.roundness:.2f} px; scored within {WITHIN * made.contact_radius:.1f} px; the smooth model "
        f"leans by {np.degrees(made.lean):.1f} deg"
    )
    return made, row


def _published(made: MarkFree, pictures: Pictures, path: Path) -> None:
    """The published table on the same pixels of the same presses, which it was fitted to."""
    table = read_table(path).astype(np.float32)
    change = pictures.images.astype(np.float64) - pictures.background
    radius, ball = WITHIN * made.contact_radius, R15.ball
    assert pictures.marks is not None
    marked, best = [], []
    for press in made.used:
        k = pictures.names.index(press.name)

        def scored(centre: FloatArray, k: int = k) -> float:
            place = contact_pixels(change.shape[1:3], centre, radius, 1)
            return decibels(table_shades(table, centre, place, ball) - change[k][place[:, 0], place[:, 1]])

        marked.append(scored(pictures.marks[k, :2]))
        moved = [np.array(press.centre) + np.array([x, y]) for x in SEARCHED for y in SEARCHED]
        best.append(max(scored(centre) for centre in moved))
    CONSOLE.print(
        f"published table, on the presses it was fitted to: {np.median(marked):.2f} dB at the marks, "
        f"{np.median(best):.2f} dB at the best centre within {SEARCHED[-1]:g} px\n"
    )


def _damage(pictures: Pictures) -> None:
    """What is said of the published set when it is spoiled in one way."""
    images = pictures.images.astype(np.float64)
    assert pictures.marks is not None
    inwards = np.argsort(np.hypot(*(pictures.marks[:, :2] - (70.0, 55.0)).T))
    ways: dict[str, Callable[[], Pictures]] = {
        "red and blue exchanged in the presses": lambda: _with(pictures, pictures.images[..., ::-1]),
        "exposure changed after the background": lambda: _with(pictures, _byte(images * 0.6)),
        "everything overexposed": lambda: replace(
            _with(pictures, _byte(images * 2.0)), background=_byte(pictures.background * 2.0)
        ),
        "ten presses": lambda: _some(pictures, np.arange(10)),
        "the sixteen presses nearest the middle": lambda: _some(pictures, inwards[:16]),
        "nothing pressed": lambda: _with(pictures, np.repeat(pictures.background[None], len(images), axis=0)),
        "every press twice": lambda: _with(pictures, np.concatenate([pictures.images] * 2)),
    }
    rows = [(words, _said(spoil(), R15)) for words, spoil in ways.items()]
    smaller = _said(pictures, replace(R15, ball_radius=1e-3), fit=True)
    rows.append(("a ball of 1 mm given for one of 2 mm", smaller))
    finish_figure("touch_calibration", "damaged set", "damage of the R1.5 set; answer", rows)


def _said(pictures: Pictures, who: Identity, fit: bool = False) -> str:
    try:
        if fit:
            calibrate(pictures, who)
            return "calibrated"
        seen = sightings(pictures, who.ball)
        verdicts = refusals(pictures, seen, who.ball)
        check_set(pictures, verdicts, seen, who.ball)
    except CalibrationRefused as refused:
        return f"refused: {refused}"
    kinds = [one.kind for one in verdicts if one is not None]
    return f"kept {len(verdicts) - len(kinds)}; refused {len(kinds)}: {', '.join(sorted(set(kinds)))}"


def _with(pictures: Pictures, images: ByteArray) -> Pictures:
    names = tuple(f"press {number}" for number in range(len(images)))
    return replace(pictures, images=images, names=names)


def _some(pictures: Pictures, which: IntArray) -> Pictures:
    return _with(pictures, pictures.images[which])


def _byte(values: AnyArray) -> ByteArray:
    return np.clip(np.round(values), 0.0, 255.0).astype(np.uint8)


def _options() -> argparse.Namespace:
    parser = benchmark_parser(__doc__)
    parser.add_argument("what", nargs="*", default="all", choices=["all", "r15", "fots", "damage"])
    parser.add_argument("--repeats", type=int, default=1)
    return parser.parse_args()


if __name__ == "__main__":
    main()
