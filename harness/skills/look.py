"""A look: the scene camera's picture of the bench without the object, and with it."""

from dataclasses import replace

from harness.basics.errors import WrongUse
from harness.bench.reading import Reading
from harness.bench.station import BARE, LOOK, Bench
from harness.recording.observation import BARE_IMAGE, IMAGE
from harness.skills.strike import Ask

FRAMES = 3
"""Of each: their median has less of the camera's noise."""

_PATIENCE = 5.0


def look(step: int, bench: Bench, ask: Ask | None) -> tuple[Reading, ...]:
    """Both pictures; a person takes the object away and puts it back, a mocked world does so by itself.

    Args:
        step: of the run.
        bench: with a scene camera.
        ask: shows a person what to do; None where nobody is there.

    Raises:
        WrongUse: the bench has no scene camera, or nobody is there to clear a real one.
        BenchFault: the camera sends nothing.
    """
    if bench.camera is None:
        raise WrongUse("a look needs the scene camera: set sensors.camera = true, or leave vision out")
    if ask is None and bench.lab is None and bench.station.mock is None:
        raise WrongUse(
            "the camera must see the bench without the object first, and nobody can be asked to clear it; "
            "run without --json at a terminal"
        )
    readings = []
    for sample, name, request in (
        (BARE, BARE_IMAGE, "take the object off the bench"),
        (LOOK, IMAGE, "put the object where it stood"),
    ):
        if ask is not None and bench.station.mock is None:
            ask(f"{request}, then go on")
        bench.mark(step, sample)
        reading = bench.camera.read(FRAMES, _PATIENCE)
        readings.append(replace(reading, channel=replace(reading.channel, name=name)))
    return tuple(readings)
