"""Taxim's published shadows, predicted from the other object's pictures, over the shadow's own pixels.

``PYTHONPATH=tests python tests/benchmarks/real_shadows.py`` needs the real data. The last rows are what
nobody can beat: the published pictures are JPEGs, and their compression is noise on exactly these pixels.
"""

import numpy as np
from published_shadow import (
    OTHER,
    TOPS,
    PublishedPress,
    from_both,
    over,
    published_press,
    shadow_table,
    soft,
)
from real_data import WHY_NOT, find_shared_data
from rich.console import Console
from rich.table import Table

from harness.image_metrics import psnr
from harness.sim.shadow import ShadowTable, cast_shadows

CONSOLE = Console(width=118, highlight=False)


def main() -> None:
    """Measure both objects."""
    data = find_shared_data()
    if data is None:
        raise SystemExit(WHY_NOT)
    taxim = data / "tactile/taxim"
    presses = {name: published_press(taxim, name) for name in TOPS}
    lists = shadow_table(taxim / "gelsight_lab")
    table = Table(title="with shadows, from the other object's pictures: own pixels / frame, dB")
    table.add_column("", justify="left")
    rows: dict[str, list[str]] = {}
    for name, press in presses.items():
        table.add_column(name, justify="right")
        other = presses[OTHER[name]]
        own = press.own(other.background)
        rows.setdefault("the shadow's own pixels", []).append(f"{int(own.sum())}")
        for words, drawn, of in _ways(press, other, lists):
            pair = f"{psnr(drawn, of, own):.2f} / {psnr(drawn, of):.2f}"
            rows.setdefault(words, []).append(pair)
    for words, cells in rows.items():
        table.add_row(words, *cells)
    CONSOLE.print(table)


def _ways(
    press: PublishedPress, other: PublishedPress, lists: ShadowTable
) -> list[tuple[str, np.ndarray, np.ndarray]]:
    background, both = other.background, from_both(other)
    ours, _ = cast_shadows(
        press.change[None], press.penetration[None], press.surface[None], press.core[None], lists
    )
    best = soft(press.shaded, background)
    sharp = np.clip(np.rint(background + press.change), 0.0, 255.0)
    return [
        ("no shadow", soft(press.change, background), press.live),
        ("published arithmetic", best, press.live),
        ("the same, gel from both of the other's pictures", over(both, press.shaded), press.live),
        ("the same, gel from its own picture", soft(press.shaded, press.background), press.live),
        ("every rim pixel throws, depths outside the table held", soft(ours[0], background), press.live),
        ("without any shadow: the plain picture, predicted", sharp, press.plain),
        ("JPEG alone: ours against ours compressed as the live one", press.through_jpeg(best), best),
    ]


if __name__ == "__main__":
    main()
