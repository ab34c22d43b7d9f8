"""Networks that say how large an object is whose shape nobody knows: by sound, touch, imprints alone."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from importlib.resources import files

import numpy as np

from experiments.scale_estimation.size import Belief, SizeRange
from experiments.scale_estimation.unseen import contact_set, spectrogram
from harness.basics.arrays import FloatArray, read_only
from harness.objectfile.entries import Domain, Input, Tensor
from harness.objectfile.runtime import Network

BINS = 49
MIDDLES = read_only(np.linspace(np.log(0.025), np.log(1.2), BINS))
"""Logarithms of sizes in m that a network gives a number for each."""

MEMBERS = 3
"""Networks that are asked, trained alike from other beginnings; their densities are averaged."""

CODE = 32
"""Numbers of a network's last hidden layer, by which an input unlike all that was learnt is known."""

UNKNOWN_SHARE = 0.02
"""Of the density that is even whatever is said."""

TURNS = 12
"""Rotations about the vertical over which touch is averaged."""

_GREATEST = 30.0
"""Of any number that a network is given."""


@dataclass(frozen=True, eq=False)
class Family:
    """What codes of a network's training inputs look like."""

    middle: FloatArray  #: ``(MEMBERS, CODE)``.
    whitening: FloatArray  #: ``(MEMBERS, CODE, CODE)``: takes their covariance to one.
    usual: float  #: distance from the middle within which 99 of 100 inputs of shapes held out are.

    def distance(self, codes: FloatArray) -> float:
        """Of ``(MEMBERS, CODE)`` codes, the mean over the members."""
        apart = np.einsum("mij,mj->mi", self.whitening, codes - self.middle)
        return float(np.linalg.norm(apart, axis=1).mean())


@dataclass(frozen=True, eq=False)
class SizeNetwork:
    """A trained network and how wide its answers are."""

    network: Network  #: that runs it.
    temperature: float
    """by which its logits are divided, so that nine tenths of shapes held out are within the intervals."""
    family: Family  #: of its inputs.
    card: Mapping[str, object]  #: where it comes from and what it reaches.

    def belief(self, inputs: Sequence[Mapping[str, FloatArray]], sizes: SizeRange) -> tuple[Belief, float]:
        """The mean of what is said of several views of one reading, and how far it is from the family.

        The distance is in units of the usual one. Beyond 1 an even density takes the greater a share the
        farther it is: what lies outside of all that was learnt is not known.
        """
        shares, distances = [], []
        for one in inputs:
            outputs = self.network({name: value[None].astype(np.float32) for name, value in one.items()})
            logits = outputs["logits"][0].astype(np.float64) / self.temperature
            logits = logits - logits.max(axis=1, keepdims=True)
            shares.append((np.exp(logits) / np.exp(logits).sum(axis=1, keepdims=True)).mean(axis=0))
            distances.append(self.family.distance(outputs["codes"][0].astype(np.float64)))
        distance = float(np.mean(distances)) / self.family.usual
        strange = max(UNKNOWN_SHARE, 1.0 - 1.0 / distance**2 if distance > 1.0 else 0.0)
        log_density = np.interp(sizes.logs, MIDDLES, np.log(np.mean(shares, axis=0) + 1e-12))
        density = np.exp(Belief.of(sizes, log_density).log_density)
        # The even share is spread over the range alone: beyond it nothing was learnt.
        even = np.where(sizes.possible.astype(bool), 1.0, 0.0)
        mixed = (1.0 - strange) * density / density.sum() + strange * even / even.sum()
        return Belief.of(sizes, np.log(np.maximum(mixed, 1e-300))), distance


def by_ways(ways: Sequence[contact_set.GelWay], sizes: SizeRange, turns: int = TURNS) -> tuple[Belief, float]:
    """What the ways of the gel say, and how far they are from the family.

    Args:
        ways: of one exploration.
        sizes: asked about.
        turns: about the vertical, over which the answer is averaged: no bearing is special.
    """
    views = []
    for yaw in np.arange(turns) * 2.0 * np.pi / turns:
        rows, kinds, whole = contact_set.features([way.turned(float(yaw)) for way in ways])
        views.append({"ways": rows, "kinds": kinds, "whole": whole})
    return shipped("touch").belief(views, sizes)


INPUTS: Mapping[str, tuple[tuple[str, tuple[int, ...]], ...]] = {
    "sound": (
        ("bands", (spectrogram.CHANNELS, spectrogram.BANDS)),
        ("extras", (spectrogram.EXTRAS,)),
    ),
    "touch": (
        ("ways", (contact_set.MOST, contact_set.NUMBERS)),
        ("kinds", (contact_set.MOST, 2)),
        ("whole", (contact_set.WHOLE,)),
    ),
    "imprints": (
        ("ways", (contact_set.MOST, contact_set.IMPRINT)),
        ("kinds", (contact_set.MOST, 2)),
        ("whole", (1,)),
    ),
}
"""Names and shapes that each network takes."""


@cache
def shipped(sense: str) -> SizeNetwork:
    """The network that came with the program."""
    folder = files(__package__) / "data"
    return opened((folder / f"{sense}.onnx").read_bytes(), (folder / f"{sense}.json").read_text(), sense)


def opened(data: bytes, card: str, sense: str) -> SizeNetwork:
    """A network from its file's bytes and its card.

    Raises:
        DataRefused: the graph must not be run, or is not of this sense.
    """
    stated = json.loads(card)
    inputs = [reading_input(name, shape, _GREATEST) for name, shape in INPUTS[sense]]
    outputs = [_output("logits", BINS), _output("codes", CODE)]
    family = Family(
        np.array(stated["family"]["middle"]),
        np.array(stated["family"]["whitening"]),
        stated["family"]["usual"],
    )
    return SizeNetwork(Network(data, f"{sense}.onnx", inputs, outputs), stated["temperature"], family, stated)


def reading_input(name: str, shape: tuple[int, ...], greatest: float) -> Input:
    """An input of a network that takes readings: ``(n, *shape)``, none beyond +-``greatest``."""
    return Input(
        name=name,
        dtype="float32",
        shape=("n", *shape),
        unit="1",
        meaning="numbers of the reading",
        domain=Domain(low=(-greatest,), high=(greatest,)),
        normaliser="in the graph",
    )


def _output(name: str, numbers: int) -> Tensor:
    return Tensor(
        name=name,
        dtype="float32",
        shape=("n", MEMBERS, numbers),
        unit="1",
        meaning=f"{name} of every member",
    )
