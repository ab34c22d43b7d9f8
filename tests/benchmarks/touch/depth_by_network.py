"""A small network from colour and place to slope, beside the inverse that ``touchstone depth`` reads with.

``PYTHONPATH=. python tests/benchmarks/touch/depth_by_network.py [fots] [r15] [--every N]`` needs the real
data. As ``real_depth.py``: two folds by press, taught without marks by the other fold, only centre and
offset of the sphere fitted. The network (five inputs, two hidden layers of 64, Adam) is told the ball's
normals within the contact, and around it those of the gel that the same fold's calibration hangs from the
ball.
"""

import time
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from calibration.taxim.mark_free import Identity
from calibration.taxim.pictures import Pictures, PressPack, read_pictures
from calibration.taxim.smooth_fit import changes
from harness.basics.arrays import BoolArray, FloatArray, IntArray
from harness.sim.gel.gel import deform
from harness.sim.optics.contact_depth import drift_of, read_depth
from harness.sim.optics.inverse import DRIFTING
from harness.sim.optics.poisson import anchored_heights, free_heights
from harness.sim.optics.shading import scaled_position
from tests.benchmarks.results import benchmark_parser, finish_figure
from tests.docs.results import Cell
from tests.samples.ball_depth import FOTS, R15, WITHIN, Taught, fit_ball, taught, usable
from tests.support.real_data import WHY_NOT, find_shared_data

_WIDTHS = (5, 64, 64, 2)
_LEVELS = 64.0
"""Grey levels that are one to the network."""

_STEPS, _BATCH, _RATE = 6000, 1024, 2e-3
_FADE = (0.9, 0.999)
_EACH = 4000
"""Pixels of a press: half of them of the contact."""


@dataclass
class Perceptron:
    """Weights and biases by layer; hyperbolic tangents between."""

    weights: list[FloatArray]
    biases: list[FloatArray]

    @classmethod
    def random(cls, rng: np.random.Generator) -> "Perceptron":
        """As Glorot and Bengio (2010)."""
        pairs = list(pairwise(_WIDTHS))
        return cls(
            [rng.normal(0.0, np.sqrt(2.0 / (i + o)), (i, o)) for i, o in pairs],
            [np.zeros(o) for _, o in pairs],
        )

    def layers(self, given: FloatArray) -> list[FloatArray]:
        """What every layer says to ``(n, 5)``, the input first."""
        seen = [given]
        for k, (weight, bias) in enumerate(zip(self.weights, self.biases, strict=True)):
            last = k == len(self.weights) - 1
            said = seen[-1] @ weight + bias
            seen.append(said if last else np.tanh(said))
        return seen

    def learn(self, given: FloatArray, wanted: FloatArray, rng: np.random.Generator) -> None:
        """Least squares by Adam (Kingma and Ba, 2015); the rate falls to nothing."""
        parts = [*self.weights, *self.biases]
        means, squares = [np.zeros_like(p) for p in parts], [np.zeros_like(p) for p in parts]
        for step in range(1, _STEPS + 1):
            pick = rng.integers(0, len(given), _BATCH)
            rate = _RATE * 0.5 * (1.0 + np.cos(np.pi * step / _STEPS))
            for part, slope, mean, square in zip(
                parts, self._slopes(given[pick], wanted[pick]), means, squares, strict=True
            ):
                mean += (1.0 - _FADE[0]) * (slope - mean)
                square += (1.0 - _FADE[1]) * (slope**2 - square)
                steady = np.sqrt(square / (1.0 - _FADE[1] ** step)) + 1e-8
                part -= rate * mean / (1.0 - _FADE[0] ** step) / steady

    def _slopes(self, given: FloatArray, wanted: FloatArray) -> list[FloatArray]:
        seen = self.layers(given)
        back = (seen[-1] - wanted) / len(given)
        by_weight: list[FloatArray] = []
        by_bias: list[FloatArray] = []
        for k in range(len(self.weights) - 1, -1, -1):
            by_weight.insert(0, seen[k].T @ back)
            by_bias.insert(0, back.sum(axis=0))
            back = (back @ self.weights[k].T) * (1.0 - seen[k] ** 2)
        return by_weight + by_bias


def main() -> None:
    """Both, or the sets that are named."""
    parser = benchmark_parser(__doc__)
    parser.add_argument("what", nargs="*", default="all", choices=["all", "fots", "r15"])
    parser.add_argument("--every", type=int, default=1, help="of the held-out presses, one in so many")
    options = parser.parse_args()
    data = find_shared_data()
    if data is None:
        raise SystemExit(WHY_NOT)
    wanted = ["fots", "r15"] if "all" in options.what else options.what
    folder = data / "tactile/fots_ball_presses"
    rows: list[list[Cell]] = []
    if "fots" in wanted:
        rows += compare(
            "FOTS", read_pictures(folder / "gelsight", folder / "gelsight_bg.png"), FOTS, options.every
        )
    if "r15" in wanted:
        rows += compare("R1.5", read_pictures(data / "tactile/objectfolder_calibs"), R15, options.every)
    heads = "method, rms error against the sphere; median [mm] .4f; 90th percentile [mm] .3f; worst [mm] .3f"
    more = "presses within 0.06 mm; better than the inverse [%] .0f; training of a fold [CPU s] .0f"
    finish_figure("touch_depth", "network", f"{heads}; {more}", rows)


def compare(title: str, pictures: Pictures, who: Identity, every: int) -> Iterator[list[Cell]]:
    """Summarize both errors against the sphere over the presses held out."""
    pack = usable(pictures, who.ball)
    change = changes(pack)
    errors, seconds = [], []
    for fold in range(2):
        out = np.arange(len(change)) % 2 == fold
        which = np.nonzero(~out)[0]
        made = taught(pack, change, which, who)
        began = time.process_time()
        network = _trained(pack, change, which, made, who)
        seconds.append(time.process_time() - began)
        errors += [_press(pack, int(k), made, network, who) for k in np.nonzero(out)[0][::every]]
    found = 1e3 * np.array(errors)
    for words, column in zip(("calibration's inverse", "network"), found.T, strict=True):
        middle, high = np.percentile(column, (50, 90))
        good = int((column <= 0.06).sum())
        better = None if words != "network" else 100.0 * float((found[:, 1] < found[:, 0]).mean())
        trained = None if words != "network" else max(seconds)
        numbers = float(middle), float(high), float(column.max())
        yield [f"{title}, {len(found)} presses: {words}", *numbers, good, better, trained]


def _trained(pack: PressPack, change: FloatArray, which: IntArray, made: Taught, who: Identity) -> Perceptron:
    rng = np.random.default_rng(0)
    given, wanted = [], []
    for k in which:
        normal, inside = _normals(pack.centres[k] + made.bias, change.shape[1:3], made, who)
        near, far = np.nonzero(inside.ravel())[0], np.nonzero(~inside.ravel())[0]
        pick = np.concatenate([rng.choice(near, _EACH // 2), rng.choice(far, _EACH // 2)])
        given.append(_inputs(change[k])[pick])
        wanted.append(normal.reshape(-1, 2)[pick])
    network = Perceptron.random(rng)
    network.learn(np.concatenate(given), np.concatenate(wanted), rng)
    return network


def _normals(
    centre: FloatArray, shape: tuple[int, ...], made: Taught, who: Identity
) -> tuple[FloatArray, BoolArray]:
    """``(rows, columns, 2)`` of the gel about a ball, and ``(rows, columns)`` where the ball touches."""
    y, x = np.mgrid[: shape[0], : shape[1]].astype(np.float64)
    right, down = x - centre[0], y - centre[1]
    away2, ball = right**2 + down**2, who.ball
    cap = np.sqrt(np.maximum(ball**2 - away2, 0.0)) - np.sqrt(ball**2 - made.contact**2)
    surface = deform(np.maximum(cap, 0.0)[None], made.calibration.header.skirt)[0]
    sunk_down, sunk_right = np.gradient(surface)
    size = np.sqrt(1.0 + sunk_down**2 + sunk_right**2)
    normal = np.stack([-sunk_right / size, -sunk_down / size], axis=-1)
    inside = away2 < made.contact**2
    normal[inside] = np.stack([right, down], axis=-1)[inside] / ball
    return normal, inside


def _inputs(change: FloatArray) -> FloatArray:
    rows, columns = change.shape[:2]
    y, x = np.mgrid[:rows, :columns].astype(np.float64)
    return np.hstack([change.reshape(-1, 3) / _LEVELS, scaled_position(x.ravel(), y.ravel(), rows, columns)])


def _press(pack: PressPack, k: int, made: Taught, network: Perceptron, who: Identity) -> tuple[float, float]:
    """RMSE against the sphere, m: of the present inverse, and of the network's slopes integrated alike."""
    image = pack.images[k]
    depth = read_depth(image[None], made.calibration, DRIFTING)
    change = image.astype(np.float64) - pack.background - drift_of(image, pack.background)
    normal = network.layers(_inputs(change))[-1].reshape(*change.shape[:2], 2)
    steep = np.hypot(normal[..., 0], normal[..., 1])
    normal *= (np.minimum(steep, made.calibration.header.slope_limit) / np.maximum(steep, 1e-9))[..., None]
    flatness = np.sqrt(1.0 - (normal**2).sum(axis=-1))
    right, down = -normal[..., 0] / flatness, -normal[..., 1] / flatness
    heights, rest = free_heights(down, right), ~depth.read.imprint[0]
    if rest.any():
        heights -= heights[rest].mean()
        anchored_heights(heights, down, right, np.ones_like(heights), rest)
    near, contact = pack.centres[k] + made.bias, WITHIN * made.contact
    both = depth.read.height[0], np.maximum(heights, 0.0) * who.pitch
    present, network_s = (fit_ball(each, near, contact, who.pitch, who.ball_radius).rmse for each in both)
    return present, network_s


if __name__ == "__main__":
    main()
