"""How much light a press needs: the smooth level's model with none, a constant, linear and quadratic terms.

``PYTHONPATH=. python tests/benchmarks/touch/light_terms.py [r15] [fots]`` needs the real data. Skirt, centres
and contact line are those of all presses; coefficients of seven folds are scored by formula on the eighth.
"""

import argparse

import numpy as np
from rich.console import Console

from calibration.taxim import light_fit
from calibration.taxim.held_out import FOLDS, WITHIN, decibels, teach
from calibration.taxim.light_fit import GelLight, light_shades
from calibration.taxim.pictures import PressPack
from calibration.taxim.smooth_fit import changes, distance
from harness.basics.arrays import FloatArray
from harness.sim.optics import lit_calibration
from tests.benchmarks.results import benchmark_parser, finish_figure
from tests.docs.results import Cell
from tests.samples.ball_depth import usable
from tests.samples.real_press import FOTS, R15, set_of
from tests.support.real_data import WHY_NOT, find_shared_data

CONSOLE = Console(width=118, highlight=False)
EVERY = 3
"""Of the pixels, one in so many is scored."""

_RADII = (1.0, 2.0, 3.0, 4.0)
_RING = 0.15


def main() -> None:
    """Measure what was asked for; both sets without a word."""
    options = _options()
    data = find_shared_data()
    if data is None:
        raise SystemExit(WHY_NOT)
    for word, who in (("r15", R15), ("fots", FOTS)):
        if "all" not in options.what and word not in options.what:
            continue
        pictures = set_of(data, word)
        pack = usable(pictures, who.ball)
        change = changes(pack)
        model = teach(pack, change, who.ball)
        CONSOLE.print(_by_radius(pack, change - model.rest, model.fit.centres, model.light.edge))
        rows: list[tuple[Cell, ...]] = []
        for degree, words in enumerate(("none", "constant", "linear", "quadratic"), start=-1):
            powers = tuple((a, b) for a in range(degree + 1) for b in range(degree + 1 - a))
            lit_calibration.LIGHT_POWERS = powers
            scores = _scores(pack, change - model.rest, model.fit.centres, model.light, who.ball)
            rows.append((words, *map(float, np.median(scores, axis=0))))
        heads = f"terms in the normal, {word}, {len(change)} presses; contact [dB] .2f; full frame [dB] .2f"
        finish_figure("touch_pictures", f"terms of the light, {word}", heads, rows)


def _by_radius(pack: PressPack, clean: FloatArray, centres: FloatArray, edge: float) -> str:
    away = np.array([distance(pack.shape, centre) for centre in centres]) / edge
    size = np.mean(clean**2, axis=3)
    rms = [np.sqrt(size[np.abs(away - radii) < _RING].mean()) for radii in _RADII]
    apex = np.median(clean[away < _RING], axis=0)
    words = ", ".join(f"{level:.0f} at {radii:g}" for level, radii in zip(rms, _RADII, strict=True))
    colours = ", ".join(f"{level:.0f}" for level in apex)
    return f"a press changes the picture, grey levels rms by contact radii: {words}; at its apex by {colours}"


def _scores(
    pack: PressPack, clean: FloatArray, centres: FloatArray, light: GelLight, ball: float
) -> list[tuple[float, float]]:
    scores = []
    place = np.argwhere(np.ones(pack.shape, np.bool_))[::EVERY]
    for fold in range(FOLDS):
        out = np.arange(len(clean)) % FOLDS == fold
        kept = np.nonzero(~out)[0]
        taught = light_fit.with_skirt(
            pack.of(kept), clean[kept], centres[kept], light.skirt, light.edge, ball
        )
        for k in np.nonzero(out)[0]:
            left = light_shades(pack, taught, centres[k], place) - clean[k][place[:, 0], place[:, 1]]
            near = distance(pack.shape, centres[k])[place[:, 0], place[:, 1]] <= WITHIN * light.edge
            scores.append((decibels(left[near]), decibels(left)))
    return scores


def _options() -> argparse.Namespace:
    parser = benchmark_parser(__doc__)
    parser.add_argument("what", nargs="*", default="all", choices=["all", "r15", "fots"])
    return parser.parse_args()


if __name__ == "__main__":
    main()
