"""Taxim's published shadows, predicted from the other object's pictures, over the shadow's own pixels.

``PYTHONPATH=. python tests/benchmarks/touch/real_shadows.py`` needs the real data. The last rows say what the
published pictures' own compression costs on exactly these pixels: of our picture, by two encoders, and of
the published pictures themselves, compressed once more on another grid of blocks.
With ``speed``: what shadows take. With ``law``: how well the nine published depths follow from the deepest
one, by the law that calibrations take.
"""

import io
from collections.abc import Callable
from functools import partial
from pathlib import Path
from time import process_time

import cv2
import numpy as np
from PIL import Image
from rich.console import Console

from harness.basics.arrays import ByteArray, FloatArray
from harness.bench.sensor import TactileSensor
from harness.picture.image_metrics import psnr
from harness.sim.optics.optics import Optics
from harness.sim.optics.published_pack import read_published
from harness.sim.optics.shadow import ShadowTable, cast_shadows, darkened, darkening
from tests.benchmarks.results import benchmark_parser, finish_figure
from tests.oracles.published_shadow import (
    OTHER,
    PITCH,
    TOPS,
    PublishedPress,
    from_both,
    over,
    published_press,
    shadow_table,
    soft,
    untouched,
)
from tests.support.real_data import WHY_NOT, find_shared_data

CONSOLE = Console(width=118, highlight=False)
_TIMES = 15
_LEAST = 7
"""Samples of a direction's deepest list, for it to say anything."""


def main() -> None:
    """Measure both objects, or the law of depths."""
    data = find_shared_data()
    if data is None:
        raise SystemExit(WHY_NOT)
    parser = benchmark_parser(__doc__)
    parser.add_argument("what", nargs="?", choices=["speed", "law"])
    what = parser.parse_args().what
    if what == "speed":
        speed(data / "tactile/taxim")
        return
    if what == "law":
        law_of_depths(shadow_table(data / "tactile/taxim/gelsight_lab"))
        return
    taxim = data / "tactile/taxim"
    presses = {name: published_press(taxim, name) for name in TOPS}
    lists = shadow_table(taxim / "gelsight_lab")
    rows: dict[str, list[str]] = {}
    for name, press in presses.items():
        other = presses[OTHER[name]]
        own = press.own(other.background)
        rows.setdefault("the shadow's own pixels", []).append(f"{int(own.sum())}")
        for words, drawn, of in _ways(press, other, lists):
            pair = f"{psnr(drawn, of, own):.2f} / {psnr(drawn, of):.2f}"
            rows.setdefault(words, []).append(pair)
    heads = "; ".join(("predicted from the other object's pictures: own pixels / frame", *presses))
    finish_figure("touch_pictures", "shadows", heads, [(words, *cells) for words, cells in rows.items()])


def speed(taxim: Path) -> None:
    """Milliseconds of the processor, 640 x 480: colours of the fast level, and what shadows take besides."""
    cv2.setNumThreads(1)
    table = []
    for name in TOPS:
        press = published_press(taxim, name)
        background: ByteArray = np.clip(press.background, 0.0, 255.0).astype(np.uint8)
        pack = read_published(taxim / "gelsight_lab", PITCH, background)
        assert pack.shadow is not None
        rows, columns = press.surface.shape
        sensor = TactileSensor("GelSight of Taxim", rows, columns, PITCH, 5e-3, casts_shadow=True)
        optics, deep = Optics(pack.calibration, "fast", pack.rest), np.maximum(press.penetration, 0.0)[None]
        plain: ByteArray = press.plain.astype(np.uint8)[None]
        shadows = partial(darkening, plain, deep, deep, sensor, pack.calibration, pack.shadow, pack.rest)
        taken = shadows()[0]
        ways = (partial(optics.render, deep), shadows, partial(darkened, plain, taken))
        colour, thrown, laid = (_milliseconds(way) for way in ways)
        table.append((name, colour, thrown, laid, colour + thrown + laid))
    heads = "press; colours [CPU ms] .1f; shadows thrown .1f; shadows laid over .1f; together .1f"
    finish_figure("touch_pictures", "time of shadows", heads, table)


def _milliseconds(way: Callable[[], object]) -> float:
    way()
    took = []
    for _ in range(_TIMES):
        began = process_time()
        way()
        took.append(process_time() - began)
    return 1e3 * float(np.median(took))


def law_of_depths(published: ShadowTable) -> None:
    """Grey levels rms by which rows that follow from the deepest one are off the published ones."""
    depths = 0.4 + 0.1 * np.arange(published.lengths.shape[2])
    lists = _by_cell(published)
    kinds: dict[str, tuple[float, float]] = {
        "no shadow": (np.nan, np.nan),
        "the same at every depth": (0.0, 0.0),
        "longer in proportion": (1.0, 0.0),
        "longer in proportion, darker with the square root": (1.0, 0.5),
        "longer and darker in proportion": (1.0, 1.0),
    }
    rows = []
    for words, (longer, darker) in kinds.items():
        left = [
            _follows(cell[-1], depths[k] / depths[-1], longer, darker, len(cell[k]))
            - _padded(cell[k], cell[-1])
            for cell in lists
            if len(cell[-1]) > _LEAST
            for k in range(len(depths) - 1)
        ]
        rows.append((words, float(np.sqrt(np.mean(np.concatenate(left) ** 2)))))
    heads = "law, eight depths predicted from the deepest; rms [grey levels] .1f"
    finish_figure("touch_pictures", "law of depths", heads, rows)


def _by_cell(table: ShadowTable) -> list[list[np.ndarray]]:
    lists = np.split(table.values, np.cumsum(table.lengths.ravel())[:-1])
    depths = table.lengths.shape[2]
    return [lists[first : first + depths] for first in range(0, len(lists), depths)]


def _padded(one: np.ndarray, deepest: np.ndarray) -> np.ndarray:
    return np.pad(one, (0, max(0, len(deepest) - len(one))))


def _follows(deepest: np.ndarray, share: float, longer: float, darker: float, samples: int) -> np.ndarray:
    at = np.arange(max(samples, len(deepest)), dtype=np.float64)
    if np.isnan(longer):
        return np.zeros(len(at))
    moved = np.interp(at / share**longer, np.arange(len(deepest)), deepest, right=0.0)
    return np.asarray(share**darker * moved)


def _ways(
    press: PublishedPress, other: PublishedPress, lists: ShadowTable
) -> list[tuple[str, FloatArray, FloatArray]]:
    background, both = other.background, from_both(other)
    gel, width = untouched(other, press.own(background))
    CONSOLE.print(f"width of the blur that takes compression's noise out of the gel: {width:.2f} px")
    ours, _ = cast_shadows(
        press.change[None], press.penetration[None], press.surface[None], press.core[None], lists
    )
    noisy, best = soft(press.shaded, background), over(gel, press.shaded)
    sharp = np.clip(np.rint(background + press.change), 0.0, 255.0)
    moved = np.roll(press.live, (4, 4), (0, 1))
    again = np.roll(press.through_jpeg(moved), (-4, -4), (0, 1))
    return [
        ("no shadow", soft(press.change, background), press.live),
        ("published arithmetic", noisy, press.live),
        ("the same, gel from both of the other's pictures", over(both, press.shaded), press.live),
        ("the same, compression's noise taken out of it", best, press.live),
        ("every rim pixel throws, depths outside the table held", over(gel, ours[0]), press.live),
        ("without any shadow: the plain picture, predicted", sharp, press.plain),
        ("JPEG alone: the best of ours, compressed as the live one", press.through_jpeg(best), best),
        ("the same by OpenCV's encoder, quality 95", _through_opencv(best, press), best),
        ("the same of the noisy one", press.through_jpeg(noisy), noisy),
        ("the live one, compressed again half a block aside", again, press.live),
    ]


def _through_opencv(picture: FloatArray, press: PublishedPress) -> FloatArray:
    """As ``through_jpeg``, by the encoder that wrote the published files."""
    blue_first: ByteArray = picture.astype(np.uint8)[..., ::-1]
    _, code = cv2.imencode(".jpg", blue_first)
    tables = Image.open(io.BytesIO(code.tobytes())).quantization  # type: ignore[attr-defined]
    assert {k: list(v) for k, v in tables.items()} == press.quantised
    return np.asarray(cv2.imdecode(code, cv2.IMREAD_COLOR), dtype=np.float64)[..., ::-1]


if __name__ == "__main__":
    main()
