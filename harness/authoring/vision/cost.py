"""What pictures cost and err: every knob of ``vision_trades`` turned, on cameras and lights kept back.

Each way is asked for the same pictures in turns, so that what else the machine does falls on all alike.
Errors are against exact pictures, and against many samples of the same networks, which tells what the
renderer leaves out from what the networks do not know.
"""

import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from harness.authoring.training import Report
from harness.authoring.vision.data import HeldOutViews
from harness.authoring.vision.metrics import network_pictures, picture_errors, reference_pictures
from harness.authoring.vision.trades import Networks, Trade, Variation, every_sample, in_bits, kept_bytes
from harness.objectfile.vision.network.graph import vision_graph
from harness.objectfile.vision.network.network import VisionModel
from harness.objectfile.vision.render import VisionRenderer
from harness.objectfile.vision.settings import Rendered, RenderSettings
from harness.picture.linear_image import LinearImage
from harness.sim.light.direct_image import LitObject


@dataclass(frozen=True)
class Spread:
    """Quartiles over repetitions of the seconds that a picture takes in the mean of all views.

    Attributes:
        low: s, first quartile.
        middle: s, median.
        high: s, third quartile.
    """

    low: float
    middle: float
    high: float


@dataclass(frozen=True, eq=False)
class Worth:
    """What one way asks of networks, and what its pictures err by.

    Attributes:
        samples: a picture, in the mean.
        rays: a picture, in the mean.
        networks: in all.
        weight_bytes: of the weights as they are kept.
        exact: errors against exact pictures, by ``picture_errors``'s names.
        many: the same against many samples of the same networks.
    """

    samples: float
    rays: float
    networks: int
    weight_bytes: int
    exact: Mapping[str, float]
    many: Mapping[str, float]


@dataclass(frozen=True, eq=False)
class Cost:
    """What one way costs and is worth.

    Attributes:
        worth: of its pictures.
        wall: s on the clock a picture.
        cpu: s of CPU time a picture, all threads together.
    """

    worth: Worth
    wall: Spread
    cpu: Spread


@dataclass(frozen=True, eq=False)
class Views:
    """What every way is asked for.

    Attributes:
        lit: the object.
        held_out: cameras and lights that no network was shown.
        samples: a side of a pixel of the exact pictures.
    """

    lit: LitObject
    held_out: HeldOutViews
    samples: int = 4

    def of_side(self, side: int) -> HeldOutViews:
        """The same cameras with so many pixels a side."""
        kept = self.held_out
        return HeldOutViews(tuple(each.resized(side, side) for each in kept.cameras), kept.lights, kept.apart)

    def exact(self, side: int) -> list[LinearImage]:
        """Exact pictures of so many pixels a side."""
        return reference_pictures(self.lit, self.of_side(side), self.samples)


@dataclass(frozen=True, eq=False)
class CostRequest:
    """Renderers by their networks, each opened once.

    Attributes:
        models: the trained networks, in float16, for every training that is asked for.
        lit: the object.
        threads: None for as many as the process has cores.
    """

    models: Mapping[Networks, VisionModel]
    lit: LitObject
    threads: int | None = None
    _opened: dict[Networks, VisionRenderer] = field(default_factory=dict)

    def model(self, networks: Networks) -> VisionModel:
        """The networks in their bits."""
        return in_bits(self.models[Networks(networks.spec)], networks.bits)

    def renderer(self, networks: Networks) -> VisionRenderer:
        """That draws them."""
        if networks not in self._opened:
            data = vision_graph(self.model(networks)).SerializeToString()
            self._opened[networks] = VisionRenderer(data, self.lit.appearance.mesh, self.threads)
        return self._opened[networks]

    def picture(self, way: Variation, view: int, held_out: HeldOutViews) -> Rendered:
        """One picture, in the pixels of ``held_out``."""
        renderer = self.renderer(way.networks)
        return renderer.render(held_out.cameras[view], held_out.lights[view], way.settings)


def networks_of(asked: Iterable[Trade]) -> tuple[Networks, ...]:
    """What must be trained for them, each once, in their order."""
    return tuple(dict.fromkeys(Networks(each.way.networks.spec) for each in asked))


def measured(
    ways: Sequence[Variation], asked: CostRequest, views: Views, repeat: int, report: Report
) -> dict[Variation, Cost]:
    """Errors and seconds of each way, each measured once however often it is named.

    Args:
        ways: to a picture.
        asked: renderers of their networks.
        views: that are drawn.
        repeat: times that every picture is drawn for its seconds, one or more.
        report: told of progress.
    """
    each = tuple(dict.fromkeys(ways))
    sight = {side: _Sight(views, side) for side in dict.fromkeys(way.side for way in each)}
    errors: dict[Variation, Worth] = {}
    for number, way in enumerate(each):
        report("comparing pictures", 0.5 * number / len(each))
        errors[way] = _worth(way, asked, sight[way.side])
    taken: dict[Variation, list[tuple[float, float]]] = {way: [] for way in each}
    for turn in range(repeat):
        report("timing", 0.5 + 0.5 * turn / repeat)
        for way in each:
            taken[way].append(_seconds(way, asked, sight[way.side].held_out))
    return {way: Cost(errors[way], *_spreads(taken[way])) for way in each}


@dataclass(frozen=True, eq=False)
class _Sight:
    """Views of one size, with their exact pictures."""

    views: Views
    side: int
    _many: dict[tuple[Networks, RenderSettings], list[LinearImage]] = field(default_factory=dict)

    @cached_property
    def held_out(self) -> HeldOutViews:
        return self.views.of_side(self.side)

    @cached_property
    def exact(self) -> list[LinearImage]:
        return self.views.exact(self.side)

    def many(self, way: Variation, asked: CostRequest) -> list[LinearImage]:
        key = way.networks, every_sample(way.settings)
        if key not in self._many:
            self._many[key] = network_pictures(asked.renderer(way.networks), self.held_out, key[1])
        return self._many[key]


def _worth(way: Variation, asked: CostRequest, sight: _Sight) -> Worth:
    count = len(sight.held_out.cameras)
    drawn = [asked.picture(way, view, sight.held_out) for view in range(count)]
    found, model = [each.image for each in drawn], asked.model(way.networks)
    return Worth(
        samples=float(np.mean([each.samples for each in drawn])),
        rays=float(np.mean([each.rays for each in drawn])),
        networks=len(model.grid),
        weight_bytes=kept_bytes(model, way.networks.bits),
        exact=picture_errors(sight.exact, found),
        many=picture_errors(sight.many(way, asked), found),
    )


def _seconds(way: Variation, asked: CostRequest, held_out: HeldOutViews) -> tuple[float, float]:
    """On the clock and of CPU time, of one picture in the mean of all views."""
    clocks: tuple[Callable[[], float], ...] = (time.perf_counter, time.process_time)
    begun = [clock() for clock in clocks]
    for view in range(len(held_out.cameras)):
        asked.picture(way, view, held_out)
    wall, cpu = (
        (clock() - before) / len(held_out.cameras) for clock, before in zip(clocks, begun, strict=True)
    )
    return wall, cpu


def _spreads(taken: Sequence[tuple[float, float]]) -> tuple[Spread, Spread]:
    """On the clock, and of CPU time."""
    quartiles = np.quantile(np.array(taken), (0.25, 0.5, 0.75), axis=0)
    return Spread(*quartiles[:, 0].tolist()), Spread(*quartiles[:, 1].tolist())
