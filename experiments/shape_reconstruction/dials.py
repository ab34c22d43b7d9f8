"""The dials of a shape reconstruction: its estimator, and the simulation's."""

from experiments.shape_reconstruction.methods import BEST, METHODS, REMOVED
from harness.effects.accuracy import Knob, Level
from harness.effects.catalogue import EFFECTS
from harness.effects.effect import knobs_of

METHOD = Knob("shape.method", tuple(METHODS), "", "method", BEST, "estimator of the surface", REMOVED)

OWN: tuple[Knob[Level], ...] = (METHOD,)
KNOBS: tuple[Knob[Level], ...] = (*OWN, *knobs_of(EFFECTS))
