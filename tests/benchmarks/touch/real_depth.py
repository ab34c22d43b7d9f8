"""Depth read from real ball presses that the calibration never saw, against the ball.

``python tests/benchmarks/touch/real_depth.py [fots] [r15] [tmd] [--folds N] [--only-fold K] [--every N]``
needs the real data. Folds are by press; a calibration is fitted without marks to the presses of the other
folds, and its misfit measured on folds of those presses alone; of the sphere only centre and offset are
fitted to what was read, within 0.95 of the contact's radius. ``--presses FOLDER --rest PICTURE`` reads a
folder of presses of the ball and pitch of FOTS instead, of a DIGIT for one; ``--unmeasured`` states errors as
for calibrations whose files have no misfit.
"""

import argparse
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from rich.console import Console

from calibration.taxim.mark_free import Identity
from calibration.taxim.pictures import Pictures, read_pictures
from calibration.taxim.smooth_fit import changes
from harness.basics.arrays import ByteArray, FloatArray
from harness.sim.optics.contact_depth import read_depth
from harness.sim.optics.depth_reading import height_errors
from harness.sim.optics.inverse import DRIFTING, invert
from harness.sim.optics.poisson import free_heights
from tests.benchmarks.results import benchmark_parser, finish_figure
from tests.docs.results import Cell
from tests.oracles.truemap import read_tmd
from tests.samples.ball_depth import FOTS, R15, WITHIN, BallFit, fit_ball, sigma_without, taught, usable
from tests.support.real_data import WHY_NOT, find_shared_data

CONSOLE = Console(width=118, highlight=False)
HEADS = "quantity; median .3f; 10th percentile .3f; 90th percentile .3f; worst .3f"


@dataclass(frozen=True, eq=False)
class Measured:
    """One held-out press."""

    name: str  #: of its picture.
    image: ByteArray  #: ``(rows, columns, 3)``.
    height: FloatArray  #: ``(rows, columns)`` metres, read.
    ball: BallFit  #: the sphere under it.
    once: float  #: metres, RMSE of the single reading by the smooth model.
    covered: float  #: share of the compared pixels whose slope is trusted.
    scores: FloatArray  #: ``(n,)`` errors in units of their stated standard deviation.
    stated: float  #: metres, rms of that standard deviation.
    seconds: tuple[float, float]  #: of the processor: reading, and stating its error.


def main() -> None:
    """Measure what was asked for; all of it without a word."""
    options = _options()
    known = not options.unmeasured
    if options.presses is not None:
        pictures = read_pictures(options.presses, options.rest)
        chosen = list(range(options.folds)) if options.only_fold is None else [options.only_fold]
        measured = _presses(pictures, FOTS, options.folds, chosen, options.every, known)
        finish_figure("touch_depth", "stated-deviations", HEADS, _rows(options.presses.name, measured))
        return
    data = find_shared_data()
    if data is None:
        raise SystemExit(WHY_NOT)
    wanted = ["fots", "r15", "tmd"] if "all" in options.what else options.what
    folds = range(options.folds) if options.only_fold is None else [options.only_fold]
    rows: list[list[Cell]] = []
    if "fots" in wanted:
        folder = data / "tactile/fots_ball_presses"
        pictures = read_pictures(folder / "gelsight", folder / "gelsight_bg.png")
        measured = _presses(pictures, FOTS, options.folds, list(folds), options.every, known)
        rows += _rows("FOTS GelSight, ball of 4.70 mm", measured)
        if options.picture is not None:
            _draw(measured, options.picture)
    if "r15" in wanted:
        pictures = read_pictures(data / "tactile/objectfolder_calibs")
        measured = _presses(pictures, R15, options.folds, list(folds), options.every, known)
        rows += _rows("GelSight R1.5, ball of 4 mm", measured)
    if rows:
        finish_figure(
            "touch_depth", "balls" if options.only_fold is None else "stated-deviations", HEADS, rows
        )
    if "tmd" in wanted:
        _round_trip(data / "tactile/gelsight_groove/heightmap.tmd")


def _presses(
    pictures: Pictures, who: Identity, folds: int, chosen: list[int], every: int, measured_misfit: bool
) -> list[Measured]:
    pack = usable(pictures, who.ball)
    change = changes(pack)
    measured = []
    for fold in chosen:
        out = np.arange(len(change)) % folds == fold
        began = time.process_time()
        made = taught(pack, change, np.nonzero(~out)[0], who, measured_misfit)
        CONSOLE.print(f"misfit of the colours: {made.calibration.header.misfit}")
        CONSOLE.print(
            f"fold {fold}: {int((~out).sum())} presses fitted in {time.process_time() - began:.1f} s"
        )
        for k in np.nonzero(out)[0][::every]:
            began = time.process_time()
            depth = read_depth(pack.images[k][None], made.calibration, DRIFTING)
            read_in = time.process_time() - began
            errors = height_errors(pack.images[k][None], depth)[0]
            stated_in = time.process_time() - began - read_in
            near, contact = pack.centres[k] + made.bias, WITHIN * made.contact
            height = depth.read.height[0]
            ball = fit_ball(height, near, contact, who.pitch, who.ball_radius)
            single = invert(pack.images[k][None], made.calibration, DRIFTING).height[0]
            once = fit_ball(single, near, contact, who.pitch, who.ball_radius).rmse
            sigma = sigma_without(errors, ball.fitted(who.ball), ball.inside)
            measured.append(
                Measured(
                    pictures.names[pack.number[k]],
                    pack.images[k],
                    height,
                    ball,
                    once,
                    float(depth.read.trusted[0][ball.inside].mean()),
                    (height - ball.sphere)[ball.inside] / sigma,
                    float(np.sqrt(np.mean(sigma**2))),
                    (read_in, stated_in),
                )
            )
    return measured


def _rows(title: str, measured: list[Measured]) -> Iterator[list[Cell]]:
    """Summarize the presses of a set: median, 10th and 90th percentile, worst."""
    columns = {
        "RMSE against the sphere, mm": [1e3 * one.ball.rmse for one in measured],
        "the same, a single reading by the smooth model, mm": [1e3 * one.once for one in measured],
        "flat plane against the sphere, mm": [1e3 * one.ball.flat for one in measured],
        "stated standard deviation, rms, mm": [1e3 * one.stated for one in measured],
        "seconds of the processor, reading": [one.seconds[0] for one in measured],
        "seconds of the processor, its error": [one.seconds[1] for one in measured],
    }
    for words, values in columns.items():
        numbers = map(float, np.percentile(values, (50, 10, 90, 100)))
        yield [f"{title}, {len(measured)} presses: {words}", *numbers]
    covered = map(float, np.percentile([one.covered for one in measured], (50, 10, 90, 0)))
    yield [f"{title}: fraction of pixels with a trusted slope", *covered]
    scores = np.abs(np.concatenate([one.scores for one in measured]))
    good = sum(one.ball.rmse <= 0.06e-3 for one in measured)
    halved = sum(one.ball.rmse <= 0.5 * one.ball.flat for one in measured)
    yield [f"{title}: presses within 0.06 mm", good, None, None, None]
    yield [f"{title}: presses within half of the plane's error", halved, None, None, None]
    for many in (1, 2):
        held = 100.0 * float((scores < many).mean())
        yield [f"{title}: pixels within {many} stated deviations [%]", held, None, None, None]


def _round_trip(path: Path) -> None:
    measured = read_tmd(path)
    surface = measured.heights / measured.pitch[0]
    down, right = np.gradient(surface)
    apart = free_heights(down, right) - (surface - surface.mean())
    whole = float(np.ptp(surface))
    CONSOLE.print(
        f"{path.name}, {surface.shape[1]} x {surface.shape[0]}: gradients to heights, rms "
        f"{apart.std() / whole:.4%} and at most {np.abs(apart).max() / whole:.3%} of a range of "
        f"{1e3 * whole * measured.pitch[0]:.3f} mm (rms {apart.std() / surface.std():.3%} of its deviation)"
    )


def _draw(measured: list[Measured], path: Path) -> None:
    """Best, median and worst press: picture, recovered, sphere, error."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    order = sorted(measured, key=lambda one: one.ball.rmse)
    figure = Figure(figsize=(15.0, 13.0), layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.subplots(3, 4)
    for row, one in zip(axes, (order[0], order[len(order) // 2], order[-1]), strict=True):
        inside = one.ball.inside
        row[0].imshow(one.image)
        row[0].set_title(
            f"{one.name}: RMSE {1e3 * one.ball.rmse:.3f} mm,\nplane {1e3 * one.ball.flat:.3f} mm"
        )
        panels = (
            ("recovered, mm", 1e3 * one.height, "viridis", None),
            ("sphere in the contact, mm", np.where(inside, 1e3 * one.ball.sphere, np.nan), "viridis", None),
            ("error, mm", np.where(inside, 1e3 * (one.height - one.ball.sphere), np.nan), "RdBu_r", 0.15),
        )
        for axis, (title, values, colours, limit) in zip(row[1:], panels, strict=True):
            low = None if limit is None else -limit
            shown = axis.imshow(values, cmap=colours, vmin=low, vmax=limit)
            axis.set_title(title)
            figure.colorbar(shown, ax=axis, shrink=0.8)
    figure.savefig(path, dpi=70)


def _options() -> argparse.Namespace:
    parser = benchmark_parser(__doc__)
    parser.add_argument("what", nargs="*", default="all", choices=["all", "fots", "r15", "tmd"])
    parser.add_argument("--folds", type=int, default=2)
    parser.add_argument("--only-fold", type=int)
    parser.add_argument("--every", type=int, default=1, help="of the held-out presses, one in so many")
    parser.add_argument("--picture", type=Path)
    parser.add_argument("--presses", type=Path, help="a folder of ball presses of its own")
    parser.add_argument("--rest", type=Path, help="the untouched gel of them")
    parser.add_argument("--unmeasured", action="store_true")
    return parser.parse_args()


if __name__ == "__main__":
    main()
