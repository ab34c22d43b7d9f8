"""The strikes of one run, where its scene asks for sound; a touch-only run computes none of this."""

from typing import TYPE_CHECKING

from harness.basics.errors import MeshRefused, WrongUse
from harness.bench.gap import Gap
from harness.bench.scene import SceneFile
from harness.bench.station_file import Station
from mocks.world.gap_draw import GapDraw
from mocks.world.world import World

if TYPE_CHECKING:
    from mocks.daq.strike_counts import StrikeCounts


def strikes_of(
    world: World, scene: SceneFile, station: Station, gap: Gap, seed: int
) -> "StrikeCounts | None":
    """What the hammer's box reads in this run; None where the scene asks for no sound.

    Args:
        world: of the run.
        scene: what is on the table.
        station: with a hammer, where the scene asks for sound.
        gap: of the world.
        seed: of the run.

    Raises:
        WrongUse: the scene asks for sound and the station has no hammer.
        CalibrationRefused: of the hammer's box.
        MeshRefused: the object cannot be filled with elements, so that a mocked one makes no sound.
    """
    if not scene.sensors.sound:
        return None
    hammer, flange_from_hammer = station.hammer, station.flange_from_hammer
    if hammer is None or flange_from_hammer is None:
        raise WrongUse(f"the scene asks for sound; the station {station.title!r} has no [hammer]: add one")
    # Modes, room and microphone are imported by runs that are to be heard, and by no others.
    from mocks.daq.strike_counts import StrikeCounts
    from mocks.world.instrument import instrument_of
    from mocks.world.sound import WorldSound

    try:
        instrument = instrument_of(world, scene, GapDraw(gap, seed))
    except MeshRefused as refusal:
        raise MeshRefused(
            f"a mocked bench cannot make this object's sound: {refusal}; or press it only (--sense touch)"
        ) from refusal
    sound = WorldSound(world, instrument, gap, seed, flange_from_hammer, hammer.rate)
    return StrikeCounts(sound, hammer.acquisition, hears=station.own_microphone is None)
