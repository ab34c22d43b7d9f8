"""Trains the tactile network of ObjectFolder 1.0 on one picture of each place."""

import numpy as np

from experiments.baselines.settings import FitSpec
from experiments.baselines.touch.bench import MIDDLE, SEED, TouchBench
from experiments.baselines.touch.colours import CHANNELS, INPUTS, colours_pair, pixel_places
from experiments.baselines.training.fit import fitted
from harness.authoring.published.modules import exported_graph
from harness.authoring.touch.data import reference_maps, smooth_normals
from harness.authoring.training import Report
from harness.basics.arrays import AnyArray, FloatArray
from harness.sim.gel.presses import Presses


class ColourRows:
    """Pixels of pictures of upright presses at the places to learn from, drawn at random."""

    def __init__(self, bench: TouchBench, batch: int) -> None:
        self._batch, places = batch, bench.places
        normals, nothing = smooth_normals(places.mesh, places.nodes.points), np.zeros(len(places.nodes))
        presses = Presses(places.nodes.points, normals, nothing + MIDDLE, nothing, nothing, nothing)
        reference = reference_maps(places.raster, presses, places.sensor, places.skirt)
        chosen = np.flatnonzero(reference.possible)
        low, high = places.mesh.bounds
        self._places = (places.nodes.points[chosen] - low) / (high - low)
        pictures = np.stack([bench.picture(each) for each in reference.maps[chosen]])
        self._colours = pictures.reshape(len(chosen), -1, CHANNELS)
        self._pixels = pixel_places((places.sensor.rows, places.sensor.columns))

    def __call__(self, random: np.random.Generator) -> tuple[FloatArray, AnyArray, AnyArray]:
        """``(batch, 5)`` inputs, ``(batch, 3)`` colours of -1 .. 1, and even weights."""
        place = random.integers(len(self._places), size=self._batch)
        pixel = random.integers(len(self._pixels), size=self._batch)
        rows = np.concatenate([self._places[place], self._pixels[pixel]], axis=1)
        return rows, self._colours[place, pixel] / 127.5 - 1.0, np.ones(self._batch)


def train_colours(bench: TouchBench, spec: FitSpec, report: Report) -> bytes:
    """The graph of the trained network."""
    rows = ColourRows(bench, spec.batch)
    network = fitted(
        spec, (INPUTS, CHANNELS), rows, SEED, lambda share: report("touch: training 1.0's network", share)
    )
    taken, given = colours_pair()
    doc = "A pixel of a press, as in 1.0."
    return exported_graph(network, (taken,), (given,), doc).SerializeToString()
