"""Strikes at nodes that no network has learned from, and what they sound like by the reference's modes."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from experiments.baselines.bench import RenderingWork, Sense
from harness.authoring.audio.data import Split, canonical, split_nodes
from harness.authoring.audio.metrics import DURATION, RATE, sound_distances
from harness.authoring.audio.object_audio import MODES
from harness.basics.arrays import AnyArray, FloatArray
from harness.basics.errors import MeshRefused
from harness.basics.materials import Material
from harness.basics.mesh import Mesh
from harness.basics.store import digest
from harness.sim.modal.modal import HEARING, default_edge, solved_once
from harness.sim.modal.modes import Modes, dampings
from harness.sim.sound.synthesis import SynthesisLevel, synthesize

SEED = 0
"""Of the split, and of first weights."""


@dataclass(frozen=True, eq=False)
class StrikeBench:
    """Unit impulses along the normal at held-out nodes.

    Attributes:
        mesh: of the object.
        material: of all of it.
        modes: of the reference, quadratic tetrahedra, canonical.
        split: of its surface's nodes.
        nodes: ``(n,)`` held-out nodes that are struck.
    """

    mesh: Mesh
    material: Material
    modes: Modes
    split: Split
    nodes: AnyArray

    sense: Sense = "audio"

    @property
    def count(self) -> int:
        """Strikes."""
        return len(self.nodes)

    @cached_property
    def identity(self) -> str:
        """Of the reference and of the strikes."""
        return digest([self.lesson, self.rates, self.nodes])

    @cached_property
    def lesson(self) -> str:
        """Of all that networks learn from."""
        modes = self.modes
        return digest([modes.points, modes.shapes, modes.frequencies, self.rates, self.split.trained])

    @cached_property
    def rates(self) -> FloatArray:
        """``(m,)`` 1/s: dampings of the reference's modes."""
        return dampings(self.modes.frequencies, self.material)

    def strike(self, number: int) -> tuple[FloatArray, FloatArray]:
        """``(3,)`` m and ``(3,)`` unit: place and normal of a strike."""
        node = self.nodes[number]
        return self.modes.points[node], self.modes.normals[node]

    def reference(self, number: int) -> FloatArray:
        """``(t,)`` the exact sum of the reference's modes."""
        node = self.nodes[number]
        gains = self.modes.shapes[node] @ self.modes.normals[node]
        return summed(self.modes.frequencies, self.rates, gains, "double")

    def scores(self, number: int, rendered: AnyArray) -> Mapping[str, float]:
        """STFT distance and envelope distance."""
        found = sound_distances(rendered, self.reference(number))
        return {"stft_distance": found.stft, "envelope_distance": found.envelope}


def summed(
    frequencies: FloatArray, rates: FloatArray, gains: AnyArray, level: SynthesisLevel = "fast"
) -> FloatArray:
    """``(t,)``: the sound of ``(m,)`` gains, as long and at the rate that distances are defined for."""
    made = synthesize(frequencies, rates, np.asarray(gains)[None], DURATION, RATE, level)
    sound: FloatArray = made.sound[0]
    return sound


def strike_bench(mesh: Mesh, material: Material, strikes: int, work: RenderingWork) -> StrikeBench:
    """The strikes of an object; its modes are solved once.

    Raises:
        MeshRefused: a surface that cannot be filled or solved, or without a mode in hearing.
    """
    work.report("audio: solving the reference's elements", 0.0)
    edge = default_edge(mesh, material, HEARING, MODES)
    modes = canonical(solved_once(mesh, material, HEARING, edge, MODES, work.store)[0])
    if len(modes.frequencies) == 0:
        raise MeshRefused(
            f"the object has no mode up to {HEARING:g} Hz, so it has no sound; take another object"
        )
    split = split_nodes(len(modes.points), seed=SEED)
    chosen = np.linspace(0, len(split.held_out) - 1, min(strikes, len(split.held_out))).astype(np.int64)
    return StrikeBench(mesh, material, modes, split, split.held_out[chosen])
