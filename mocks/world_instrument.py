"""The true object of a run as something that sounds: its modes, how they decay, how loud each is."""

from harness.gap import SoundGap
from harness.materials import material
from harness.scene import SceneFile
from harness.sim.modal import default_edge, modes_of
from harness.sim.modal_radiation import radiation
from harness.sim.modes import dampings
from harness.store import Store, default_folder
from mocks.world import World
from mocks.world_sound import Instrument

LIMIT = 12e3
"""Hz: a blow of 0.2 ms has little left beyond."""

FINER = 0.8
"""Of the edge that an estimator's elements have where nobody asks for another."""

DISTANCE = 0.5
"""m from the object to the microphone."""


def instrument_of(world: World, scene: SceneFile, gap: SoundGap, seed: int) -> Instrument:
    """The true object's modes and how loud each is at the microphone.

    Args:
        world: of the run.
        scene: names the material.
        gap: how the true object differs.
        seed: of the run.

    Raises:
        MeshRefused: an object that cannot be filled with elements.
    """
    if any((*gap.wall, gap.poisson, gap.elastic_field)):
        raise NotImplementedError(
            f"mocks.world_instrument: another wall, Poisson's ratio and elasticity (seed {seed})"
        )
    made_of = material(scene.object.material)
    edge = FINER * default_edge(world.mesh, made_of, LIMIT)
    modes = modes_of(world.mesh, made_of, LIMIT, edge, store=Store(default_folder()))
    return Instrument(modes, dampings(modes.frequencies, made_of), radiation(modes, DISTANCE))
