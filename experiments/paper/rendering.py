"""Quality and seconds of every method of a sense; what was measured is stored and not measured again.

A bench holds the queries of one sense and their reference; a method renders them. Networks and cells are kept
in a store by all that they depend on.
"""

import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import astuple, dataclass
from functools import cache
from importlib.util import find_spec
from typing import Literal, Protocol

import numpy as np
from threadpoolctl import threadpool_limits

from harness.authoring.training import Report
from harness.basics.arrays import AnyArray, FloatArray
from harness.basics.store import Store, digest
from harness.bench.experiments import loaded
from harness.picture.image_metrics import mean_square, ssim

Sense = Literal["vision", "audio", "touch"]
SENSES: tuple[Sense, ...] = ("vision", "audio", "touch")

Column = Literal["1.0 here", "2.0 here", "ours, smallest", "ours", "ours, largest", "other"]
COLUMNS: tuple[Column, ...] = ("1.0 here", "2.0 here", "ours, smallest", "ours", "ours, largest")
"""Rows of tables 1 and 2 that are measured; ``"other"`` stands in a sense's own table alone."""

Render = Callable[[int], AnyArray]
"""From a query's number to what is rendered for it: a sound, or a picture of 8 bits."""

ROUNDING = 1.0 / 12.0
"""Squared grey levels: pictures of whole greys are known no better, so that no PSNR is above 58.9 dB."""

PEAK = 255.0


class RenderingBench(Protocol):
    """The queries of one sense with their reference."""

    @property
    def sense(self) -> Sense:
        """Of the queries."""

    @property
    def identity(self) -> str:
        """A digest of the object, the queries and the reference."""

    @property
    def count(self) -> int:
        """Queries."""

    def scores(self, number: int, rendered: AnyArray) -> Mapping[str, float]:
        """The paper's metrics of what was rendered for one query."""


@dataclass(frozen=True, eq=False)
class MadeMethod:
    """A method ready to render."""

    render: Render  #: renders one query.
    seconds: float = 0.0  #: CPU s of fitting or training; 0 where nothing was made here.


@dataclass(frozen=True, eq=False)
class RenderingMethod:
    """One way from a query to an observation."""

    name: str  #: of its row.
    column: Column  #: the row of tables 1 and 2 that it fills.
    identity: tuple[object, ...]  #: of all that it depends on beside the bench; a digest takes it.
    make: Callable[[], MadeMethod]
    """fits, trains or opens it; raises ``TorchMissing`` where it cannot be trained."""
    note: str = ""  #: what a reader has to know of it.


@dataclass(frozen=True)
class RenderingWork:
    """Where results lie and who is informed."""

    store: Store  #: of reference solutions, networks and measured cells.
    report: Report  #: takes what is being done and the share of it that is done.


def picture_scores(rendered: AnyArray, reference: AnyArray) -> dict[str, float]:
    """PSNR in dB and SSIM of two ``(rows, columns, 3)`` pictures of 8 bits, over whole pictures."""
    error = max(mean_square(rendered, reference), ROUNDING)
    return {"psnr_db": float(10.0 * np.log10(PEAK**2 / error)), "ssim": ssim(rendered, reference)}


def grid_points(least: float, shape: tuple[int, int]) -> FloatArray:
    """Return the ``(rows * columns, 2)`` points of a grid by rows, from ``least`` to 1 along each axis."""
    rows, columns = (np.linspace(least, 1.0, size) for size in shape)
    return np.stack(np.meshgrid(rows, columns, indexing="ij"), axis=-1).reshape(-1, 2)


@dataclass(frozen=True)
class FitSpec:
    """A perceptron and its training by Adam."""

    depth: int = 4  #: hidden layers.
    width: int = 256  #: of each.
    octaves: int = 10  #: of the encoding.
    skip: int = 0  #: the layer, counted from 0, that takes the encoded input too; 0 for none.
    steps: int = 300  #: of Adam; its rate falls to zero as half a cosine.
    batch: int = 8192  #: rows in a step.
    rate: float = 2e-3  #: of the first steps.


@dataclass(frozen=True)
class FieldSpec:
    """One network for the look of an object, and its training by Adam."""

    depth: int = 4  #: hidden layers of the trunk.
    width: int = 128  #: of each.
    octaves: int = 7  #: of the place's encoding.
    turns: int = 4  #: octaves of the view's and the light's.
    samples: int = 128  #: of a ray.
    places: int = 1_000_000  #: beside the surface that are learned from.
    steps: int = 800  #: of Adam; its rate falls to zero as half a cosine.
    batch: int = 8192  #: places in a step, and half as many of the whole ball.
    rate: float = 3e-3  #: of the first steps.
    opacity: float = 0.05  #: weight of the density's error beside the colour's.


GRAPH_VERSION = "baseline graph"
"""Of what trainings compute; another text with every change of it, so that stored networks are dropped."""


class TorchMissing(Exception):
    """A baseline has to be trained, and torch is not installed; its row of the table says so."""


def train_network(
    work: RenderingWork,
    name: str,
    what: str,
    bench: "RenderingBench",
    spec: FitSpec | FieldSpec,
    lesson: str,
    *settings: object,
) -> tuple[bytes, float]:
    """Train a network by ``rendering_training.train_NAME``; see ``load_or_train_graph``.

    The queries of the bench must not be in its training data; ``lesson`` is a digest of that data.
    """

    def train() -> bytes:
        trained: bytes = loaded(f"experiments.paper.rendering_training:train_{name}")(
            bench, spec, work.report
        )
        return trained

    return load_or_train_graph(work.store, (name, lesson, astuple(spec), *settings), what, train)


def load_or_train_graph(
    store: Store, identity: tuple[object, ...], what: str, train: Callable[[], bytes], torch: bool = True
) -> tuple[bytes, float]:
    """Load the graph of a network from the store, or train it and store it.

    ``identity`` holds all that the network depends on, ``what`` names it in messages, and ``torch`` states
    whether training needs it. The CPU seconds of the training are returned too.

    Raises:
        TorchMissing: it has to be trained and cannot be.
    """
    key = digest([GRAPH_VERSION, *identity])
    stored = store.get(key)
    if isinstance(stored, Mapping):
        return stored["graph"].tobytes(), float(stored["seconds"])
    if torch and any(find_spec(name) is None for name in ("torch", "onnxscript")):
        raise TorchMissing(f"{what} has to be trained, which needs torch: pip install '.[author]'")
    begun = time.process_time()
    data = train()
    seconds = time.process_time() - begun
    store.put(key, {"graph": np.frombuffer(data, np.uint8), "seconds": np.array(seconds)})
    return data, seconds


VERSION = 1
"""Raised with every change of how cells are measured, so that stored ones are dropped."""

ROUNDS = 15
"""Of timing: in each, every method renders one query."""

_ENOUGH = 8.0
"""CPU s of one method's timing after which it takes no part in further rounds."""

_LEAST_ROUNDS = 2


@dataclass(frozen=True, eq=False)
class MeasuredMethod:
    """A method with its worth."""

    method: RenderingMethod  #: that was measured.
    scores: Mapping[str, FloatArray]  #: ``(n,)`` of each metric; empty where it could not be made.
    seconds: FloatArray  #: ``(k,)`` CPU s of one thread, of one observation each; empty likewise.
    made: float = 0.0  #: CPU s of fitting or training.
    missing: str = ""  #: why it could not be made; empty where it was.


def measure_sense(
    bench: RenderingBench, methods: Sequence[RenderingMethod], work: RenderingWork
) -> Iterator[MeasuredMethod]:
    """Measure every method of a sense, each cell stored as soon as it is measured; names must differ.

    Each method has a cell of quality. One cell has the seconds of all methods, which render in turn, so that
    other load on the machine affects them equally.
    """
    worth: dict[str, Mapping[str, FloatArray]] = {}
    missing: dict[str, str] = {}

    @cache
    def make(method: RenderingMethod) -> MadeMethod:
        return method.make()

    with threadpool_limits(limits=1):
        for number, method in enumerate(methods):
            work.report(f"{bench.sense}: {method.name}", number / len(methods))
            try:
                worth[method.name] = _quality(bench, method, make, work)
            except TorchMissing as reason:
                missing[method.name] = str(reason)
        work.report(f"{bench.sense}: seconds", 1.0)
        rendered = [each for each in methods if each.name in worth]
        identities = [[each.name, list(each.identity)] for each in rendered]
        key = digest(["rendering seconds", VERSION, bench.identity, identities])
        stored = work.store.get(key)
        if isinstance(stored, Mapping):
            timed = {name.removeprefix("of "): seconds for name, seconds in stored.items()}
        else:
            timed = time_in_turn({each.name: make(each) for each in rendered}, bench.count)
            work.store.put(key, {f"of {name}": seconds for name, seconds in timed.items()})
    for method in methods:
        if method.name in missing:
            yield MeasuredMethod(method, {}, np.empty(0), missing=missing[method.name])
        else:
            scores = dict(worth[method.name])
            made = float(scores.pop("made_s"))
            yield MeasuredMethod(method, scores, timed[method.name], made)


def _quality(
    bench: RenderingBench,
    method: RenderingMethod,
    make: Callable[[RenderingMethod], MadeMethod],
    work: RenderingWork,
) -> Mapping[str, FloatArray]:
    """``(n,)`` of each metric, and ``made_s``."""
    key = digest(["rendering quality", VERSION, bench.identity, method.name, list(method.identity)])
    stored = work.store.get(key)
    if isinstance(stored, Mapping):
        return stored
    made = make(method)
    rows = [bench.scores(number, made.render(number)) for number in range(bench.count)]
    found = {name: np.array([row[name] for row in rows]) for name in rows[0]}
    found["made_s"] = np.array(made.seconds)
    work.store.put(key, found)
    return found


def time_in_turn(made: Mapping[str, MadeMethod], count: int, rounds: int = ROUNDS) -> dict[str, FloatArray]:
    """Measure ``(k,)`` CPU seconds of each method; slow methods take part in fewer rounds."""
    taken: dict[str, list[float]] = {name: [] for name in made}
    for name, method in made.items():
        first = _seconds(method, 0)
        # What is slow has warmed up long before its first observation ends.
        taken[name] += [first] if first > 1.0 else []
    for number in range(rounds):
        for name, method in made.items():
            if len(taken[name]) < _LEAST_ROUNDS or sum(taken[name]) < _ENOUGH:
                taken[name].append(_seconds(method, number % count))
    return {name: np.array(seconds) for name, seconds in taken.items()}


def _seconds(made: MadeMethod, number: int) -> float:
    begun = time.process_time()
    made.render(number)
    return time.process_time() - begun
