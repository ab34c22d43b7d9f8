"""Ways from a press to its picture: 1.0's, the paper's network, ours at three sizes, the untouched gel."""

import time
from dataclasses import astuple

import numpy as np

from experiments.baselines.bench import Column, MadeMethod, Render, RenderingMethod, RenderingWork
from experiments.baselines.settings import COLOURS, SMALL_CODES, TOUCHNET
from experiments.baselines.stored_graph import stored_graph
from experiments.baselines.touch.bench import TouchBench
from experiments.baselines.touch.colours import COLOURS_FILE, ColourNetwork, colours_pair
from harness.authoring.touch.data import DEPTHS, MOST_TILT
from harness.authoring.touch.profiles import TOUCH_PROFILES, CodesSpec
from harness.authoring.touch.touch import opened_codes, spaced_codes
from harness.basics.arrays import AnyArray
from harness.objectfile.file import ObjectFile
from harness.objectfile.runtime import Network
from harness.objectfile.touch.graph import codes_graph
from harness.objectfile.touch.part import PERCEPTRON, perceptron_tensors
from harness.objectfile.touch.perceptron import pixel_domain
from harness.objectfile.touch.touch import Maps, PerceptronMaps, ReferenceMaps, open_touch
from harness.objectfile.touch_entries import GelEntry

_CODES_SEED = 0
_REACH = 2.0
"""Spacings that a press may be from a code: more than an ObjectFile allows, so that no press is refused."""


def first_touch(bench: TouchBench, work: RenderingWork, suffix: str = "") -> RenderingMethod:
    """1.0's network.

    Args:
        bench: on which it is measured; it learns at the bench's places.
        work: where it is stored.
        suffix: added to its name.
    """
    column: Column = "other" if suffix else "1.0 here"
    note = "one picture a place, whatever the tilt and depth"
    return RenderingMethod(
        f"DIGIT-like TouchNet (1.0){suffix}", column, astuple(COLOURS), lambda: _by_colours(bench, work), note
    )  # fmt: skip


def untouched(bench: TouchBench, suffix: str = "") -> RenderingMethod:
    """The background alone, whatever is pressed."""
    nothing = np.zeros_like(bench.maps[0])
    made = MadeMethod(lambda _: bench.picture(nothing))
    return RenderingMethod(f"untouched gel{suffix}", "other", (), lambda: made, "costs nothing")


def touch_methods(bench: TouchBench, of: ObjectFile, work: RenderingWork) -> list[RenderingMethod]:
    """Every row of touch.

    Args:
        bench: of the presses.
        of: the object; its own codes are a row where it has some.
        work: where networks are stored.
    """
    largest = TOUCH_PROFILES["standard"].codes
    return [
        untouched(bench),
        first_touch(bench, work),
        RenderingMethod(
            "TouchNet (2.0)",
            "2.0 here",
            astuple(TOUCHNET),
            lambda: _by_touchnet(bench, work),
            f"its layers; trained here for {TOUCHNET.epochs * TOUCHNET.steps} steps alone",
        ),
        _codes("codes of 1 MB", SMALL_CODES, "ours, smallest", bench),
        *_own(bench, of),
        _codes("codes of 18 MB, profile standard", largest, "ours, largest", bench),
        RenderingMethod(
            "the mesh itself, rasterised",
            "other",
            (),
            lambda: _reference(bench),
            "the reference: no error by definition",
        ),
    ]  # fmt: skip


def _own(bench: TouchBench, of: ObjectFile) -> list[RenderingMethod]:
    entry = of.description.touch
    if entry is None or entry.codes is None:
        return []
    network = entry.codes.network
    name = f"codes of the ObjectFile, {network.bytes / 1e6:.1f} MB"
    return [RenderingMethod(name, "ours", (network.sha256,), lambda: _opened(bench, of))]


def _opened(bench: TouchBench, of: ObjectFile) -> MadeMethod:
    touch = open_touch(of, "codes")
    return MadeMethod(_drawn(bench, touch.at))


def _codes(name: str, spec: CodesSpec, column: Column, bench: TouchBench) -> RenderingMethod:
    return RenderingMethod(name, column, astuple(spec), lambda: _by_codes(bench, spec))


def _by_codes(bench: TouchBench, spec: CodesSpec) -> MadeMethod:
    places, begun = bench.places, time.process_time()
    coded, spacing = spaced_codes(places.raster, places.sensor, spec, _CODES_SEED)
    graph = codes_graph(coded.patches, places.sensor, places.skirt)
    maps = opened_codes(graph, coded.nodes, _REACH * spacing, places.sensor)
    return MadeMethod(_drawn(bench, maps), time.process_time() - begun)


def _by_touchnet(bench: TouchBench, work: RenderingWork) -> MadeMethod:
    def train() -> bytes:
        from experiments.baselines.training.published import train_touchnet

        return train_touchnet(bench, TOUCHNET, work.report)

    data, seconds = stored_graph(work.store, ("touchnet", bench.lesson, astuple(TOUCHNET)), "TouchNet", train)
    places = bench.places
    low, high = places.mesh.bounds
    least, most = pixel_domain(low, high, DEPTHS, MOST_TILT, places.sensor)
    network = Network(data, PERCEPTRON, *perceptron_tensors(least, most))
    return MadeMethod(_drawn(bench, PerceptronMaps(network, _gel(bench))), seconds)


def _by_colours(bench: TouchBench, work: RenderingWork) -> MadeMethod:
    def train() -> bytes:
        from experiments.baselines.training.colours import train_colours

        return train_colours(bench, COLOURS, work.report)

    places = bench.places
    identity = ("colours", bench.lesson, astuple(COLOURS))
    data, seconds = stored_graph(work.store, identity, "the tactile network of 1.0", train)
    place, colours = colours_pair()
    low, high = places.mesh.bounds
    shape = places.sensor.rows, places.sensor.columns
    network = ColourNetwork(Network(data, COLOURS_FILE, [place], [colours]), low, high, shape)
    return MadeMethod(lambda number: network.picture(bench.presses.points[number]), seconds)


def _reference(bench: TouchBench) -> MadeMethod:
    return MadeMethod(_drawn(bench, ReferenceMaps(bench.places.raster, _gel(bench))))


def _gel(bench: TouchBench) -> GelEntry:
    return GelEntry.of(bench.places.sensor, bench.places.skirt)


def _drawn(bench: TouchBench, maps: Maps) -> Render:
    def observe(number: int) -> AnyArray:
        return bench.picture(maps(bench.presses[number : number + 1])[0])

    return observe
