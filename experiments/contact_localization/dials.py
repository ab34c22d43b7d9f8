"""Every dial of a localization run: the estimator's own and the simulation's, as one accuracy."""

from experiments.contact_localization.levels import Levels
from harness.accuracy import Accuracy, Knob
from harness.effects import knobs_of
from harness.sim.catalogue import EFFECTS

METHOD = Knob(
    "localization.method", ("particle", "grid"), "", "method", "grid", "the paper's filter, or ours"
)
SPACING = Knob(
    "localization.spacing", (4e-3, 3e-3, 2e-3, 1.5e-3), "m", "number", 2e-3, "between surface samples"
)
ROUNDS = Knob("localization.rounds", (0, 1, 2, 3), "rounds", "number", 3, "refinements after the grid")
SAMPLES = Knob("localization.samples", (300, 600, 1200), "", "number", 600, "hypotheses a refinement draws")
PARTICLES = Knob(
    "localization.particles", (300, 1000, 3000, 10_000), "", "number", 1000, "of the paper's filter"
)
BLOCK = Knob("localization.block", (16, 8, 4), "pixels", "number", 8, "tactile pixels averaged, each way")

KNOBS = (METHOD, SPACING, ROUNDS, SAMPLES, PARTICLES, BLOCK, *knobs_of(EFFECTS))


def chosen(texts: list[str]) -> Accuracy:
    """The default accuracy but for what an operator wrote, for example ``["localization.rounds=1"]``.

    Raises:
        WrongUse: an unknown dial or level; the nearest is named.
    """
    return Accuracy.default(KNOBS).with_texts(texts)


def levels_of(accuracy: Accuracy) -> Levels:
    """What the estimator takes."""
    return Levels(
        method="particle" if accuracy[METHOD.name] == "particle" else "grid",
        spacing=float(accuracy[SPACING.name]),
        particles=int(accuracy[PARTICLES.name]),
        block=int(accuracy[BLOCK.name]),
        rounds=int(accuracy[ROUNDS.name]),
        samples=int(accuracy[SAMPLES.name]),
    )
