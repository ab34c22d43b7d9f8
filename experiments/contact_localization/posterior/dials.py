"""The estimator's dials: what the accuracy of an estimate costs."""

from typing import Literal

from harness.effects.accuracy import Knob, Setting

Method = Literal["grid", "particle"]
"""The exact posterior refined, or the paper's filter."""

Senses = Literal["touch", "audio", "both"]
"""``"both"``: whatever was recorded."""

METHOD: Knob[Method] = Knob(
    "localization.method", ("particle", "grid"), "", "method", "grid", "the paper's filter, or ours"
)
SENSES: Knob[Senses] = Knob(
    "localization.senses",
    ("touch", "audio", "both"),
    "",
    "method",
    "both",
    "what is used of what was recorded",
)
SPACING = Knob(
    "localization.spacing", (4e-3, 3e-3, 2e-3, 1.5e-3), "m", "number", 2e-3, "between surface samples"
)
ROUNDS = Knob(
    "localization.rounds", (0, 1, 2, 3, 5), "rounds", "number", 5, "most refinements after the grid"
)
SAMPLES = Knob(
    "localization.samples", (600, 1500, 3000, 6000), "", "number", 3000, "hypotheses a refinement draws"
)
PARTICLES = Knob(
    "localization.particles", (300, 1000, 3000, 10_000), "", "number", 1000, "of the paper's filter"
)
BLOCK = Knob("localization.block", (16, 8), "pixels", "number", 8, "tactile pixels averaged, each way")

DIALS = (SENSES, METHOD, SPACING, ROUNDS, SAMPLES, PARTICLES, BLOCK)


def needs_images(setting: Setting) -> bool:
    """Return whether a setting uses the tactile images."""
    return setting.get(SENSES.name, SENSES.default) != "audio"
