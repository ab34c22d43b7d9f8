"""Real ball presses beside what is drawn of them by calibrations that never saw them.

``python tests/benchmarks/touch/real_pictures.py [r15] [fots] [--every N] [--picture FILE.png]`` with
``PYTHONPATH=.`` needs the real data. Eight folds by press: untouched gel, skirt, colours and light are
taught by the other folds. Of a held-out press the pose is fitted, three numbers, in every row alike.
"""

import argparse
import time
from pathlib import Path

import numpy as np
from rich.console import Console

from calibration.taxim.light_fit import pressed_ball
from calibration.taxim.mark_free import Identity
from calibration.taxim.pictures import Pictures
from calibration.taxim.smooth_fit import distance
from harness.basics.arrays import ByteArray, FloatArray
from harness.bench.sensor import TactileSensor
from harness.sim.gel.gel import R15_SKIRT, deform
from harness.sim.optics.optics import Optics, OpticsLevel
from harness.sim.optics.published_pack import PublishedPack, read_published
from harness.sim.optics.shadow import darkening
from tests.benchmarks.results import benchmark_parser, finish_figure
from tests.docs.results import Cell
from tests.samples.real_press import (
    FOTS,
    R15,
    Drawn,
    HeldOut,
    drawing,
    fitted,
    held_out_presses,
    judged,
    over_background,
    set_of,
)
from tests.support.real_data import WHY_NOT, find_shared_data

CONSOLE = Console(width=118, highlight=False)
LEVELS: tuple[OpticsLevel, ...] = ("smooth", "fast", "exact")

NOTHING, OWN_NOTHING = "background alone: the one picture of it", "background alone: as taught"
PUBLISHED = "published table, dome and skirt (fitted to these presses)"
BEFORE = "fast, the one background, skirt of 11 px"
TAUGHT = "{}, background and skirt as taught"
SHADED = "smooth, with the shadows that the other folds show"
LIT = "smooth, and the light of the moment given"
FLOOR = 4.5
"""Contact radii beyond which a press shows the untouched gel alone."""


def main() -> None:
    """Measure what was asked for; both sets without a word."""
    options = _options()
    data = find_shared_data()
    if data is None:
        raise SystemExit(WHY_NOT)
    wanted = ["r15", "fots"] if "all" in options.what else options.what
    if "r15" in wanted:
        pack = read_published(data / "tactile/objectfolder_calibs", R15.pitch)
        _measure("r15", "GelSight R1.5, 160 x 120", set_of(data, "r15"), R15, options, pack)
    if "fots" in wanted:
        _measure("fots", "FOTS GelSight, 240 x 320", set_of(data, "fots"), FOTS, options, None)


def _measure(
    figure: str,
    title: str,
    pictures: Pictures,
    who: Identity,
    options: argparse.Namespace,
    pack: PublishedPack | None,
) -> None:
    began = time.process_time()
    rows: dict[str, list[Drawn]] = {}
    presses: list[HeldOut] = []
    floor = []
    for k, press in enumerate(held_out_presses(pictures, who)):
        if k % options.every:
            continue
        presses.append(press)
        for name, drawn in _drawn(press, pictures.background, pack).items():
            rows.setdefault(name, []).append(drawn)
        floor.append(_untouched_rms(press))
    _report(figure, f"{title}, {len(presses)} presses, {time.process_time() - began:.0f} CPU s", rows)
    skirts = sorted({press.calibration.header.skirt.kernels[0] for press in presses})
    cores = sorted({press.calibration.header.skirt.core for press in presses})
    noise = float(np.median([one for one in floor if np.isfinite(one)]))
    CONSOLE.print(
        f"widest blur {skirts[0]} to {skirts[-1]} px, core {cores[0]} to {cores[-1]} by fold; untouched gel "
        f"beyond {FLOOR:g} contact radii strays by {noise:.2f} grey levels rms: a perfect press would "
        f"score {20.0 * np.log10(255.0 / noise):.1f} dB\n"
    )
    if options.picture is not None:
        _draw(presses, rows[TAUGHT.format("smooth")], options.picture)


def _drawn(press: HeldOut, background: ByteArray, pack: PublishedPack | None) -> dict[str, Drawn]:
    nowhere = np.full(3, np.nan)
    skirt = press.calibration.header.skirt
    answers = {
        NOTHING: judged(press, background.astype(np.float64), nowhere),
        OWN_NOTHING: judged(press, press.calibration.background.astype(np.float64), nowhere),
    }
    if pack is not None:
        optics = Optics(pack.calibration, "exact", pack.rest)
        answers[PUBLISHED] = fitted(press, drawing(optics, pack.calibration.header.skirt), R15_SKIRT)
        before = Optics(over_background(press.calibration, background), "fast")
        answers[BEFORE] = fitted(press, drawing(before, R15_SKIRT), R15_SKIRT)
    for level in LEVELS:
        optics = Optics(press.calibration, level)
        answers[TAUGHT.format(level)] = fitted(press, drawing(optics, skirt), skirt)
    best = answers[TAUGHT.format("smooth")]
    answers[SHADED] = judged(press, best.image - _shadow(press, best), best.pose)
    answers[LIT] = judged(press, best.image + press.drift, best.pose)
    return answers


def _shadow(press: HeldOut, drawn: Drawn) -> FloatArray:
    """Grey levels that shadows take from a drawing, as ``sim touch`` takes them."""
    if press.shadow is None:
        return np.zeros(drawn.image.shape)
    header, (rows, columns) = press.calibration.header, drawn.image.shape[:2]
    sensor = TactileSensor(header.sensor, rows, columns, header.pitch, gel_thickness=np.inf)
    away = distance((rows, columns), drawn.pose[:2])
    reached = header.pitch * pressed_ball(away, float(drawn.pose[2]), press.ball)[None]
    gel = deform(reached, header.skirt)
    taken, _ = darkening(drawn.image[None], reached, gel, sensor, press.calibration, press.shadow)
    return np.asarray(taken[0], dtype=np.float64)


def _untouched_rms(press: HeldOut) -> float:
    far = ~press.region(FLOOR)
    apart = press.live.astype(np.float64) - press.calibration.background - press.drift
    return float(np.sqrt(np.mean(apart[far] ** 2))) if far.sum() > 500 else np.nan


def _report(figure: str, title: str, rows: dict[str, list[Drawn]]) -> None:
    """Print or write the median over the presses, with the 10th percentile in brackets."""
    table: list[list[Cell]] = []
    for name, drawn in rows.items():
        columns = [[getattr(one, of) for one in drawn] for of in ("contact", "around", "frame")]
        texts = [f"{np.median(values):.2f} ({np.percentile(values, 10):.2f})" for values in columns]
        table.append([name, *texts, float(np.median([one.alike for one in drawn]))])
    heads = f"{title}; contact [dB]; 1.6 contact radii [dB]; full frame [dB]; SSIM .3f"
    finish_figure("touch_pictures", figure, heads, table)
    smooth = rows[TAUGHT.format("smooth")]
    for level in LEVELS[1:]:
        other = rows[TAUGHT.format(level)]
        pairs = list(zip(smooth, other, strict=True))
        better = [sum(getattr(a, of) > getattr(b, of) for a, b in pairs) for of in ("contact", "frame")]
        CONSOLE.print(
            f"smooth better than {level}: in the contact {better[0]} of {len(pairs)} presses, over the frame "
            f"{better[1]}"
        )


def _draw(presses: list[HeldOut], drawn: list[Drawn], path: Path) -> None:
    """Live, simulated and difference of six presses from the best to the worst."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    order = np.argsort([-one.frame for one in drawn])
    chosen = order[np.linspace(0, len(order) - 1, 6).round().astype(int)]
    rows, columns = presses[0].live.shape[:2]
    figure = Figure(figsize=(12.0, 6 * 3.2 * rows / columns * 4 / 3), layout="constrained")
    FigureCanvasAgg(figure)
    for row, k in zip(figure.subplots(6, 3), chosen, strict=True):
        press, one = presses[k], drawn[k]
        apart: FloatArray = one.image.astype(np.float64) - press.live
        panels = (press.live, one.image, np.clip(128.0 + 4.0 * apart, 0, 255).astype(np.uint8))
        titles = (
            f"{press.name}, live",
            f"drawn: contact {one.contact:.1f} dB, frame {one.frame:.1f} dB",
            "drawn less live, four times, about grey",
        )
        for axis, panel, words in zip(row, panels, titles, strict=True):
            axis.imshow(panel)
            axis.set_title(words, fontsize=9)
            axis.set_axis_off()
    figure.savefig(path, dpi=80)


def _options() -> argparse.Namespace:
    parser = benchmark_parser(__doc__)
    parser.add_argument("what", nargs="*", default="all", choices=["all", "r15", "fots"])
    parser.add_argument("--every", type=int, default=1, help="one press in so many")
    parser.add_argument("--picture", type=Path)
    return parser.parse_args()


if __name__ == "__main__":
    main()
