"""Every dial of a localization run: the estimator's own and the simulation's, as one accuracy."""

from collections.abc import Iterator, Mapping, Sequence

from experiments.contact_localization.levels import Levels, Senses
from harness.accuracy import Accuracy, Knob, Level
from harness.effects import knobs_of
from harness.sim.catalogue import EFFECTS

METHOD = Knob(
    "localization.method", ("particle", "grid"), "", "method", "grid", "the paper's filter, or ours"
)
SENSES = Knob(
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
ROUNDS = Knob("localization.rounds", (0, 1, 2, 3), "rounds", "number", 3, "refinements after the grid")
SAMPLES = Knob("localization.samples", (300, 600, 1200), "", "number", 600, "hypotheses a refinement draws")
PARTICLES = Knob(
    "localization.particles", (300, 1000, 3000, 10_000), "", "number", 1000, "of the paper's filter"
)
BLOCK = Knob("localization.block", (16, 8), "pixels", "number", 8, "tactile pixels averaged, each way")

KNOBS = (SENSES, METHOD, SPACING, ROUNDS, SAMPLES, PARTICLES, BLOCK, *knobs_of(EFFECTS))

TURNED: Mapping[str, tuple[Knob, ...]] = {
    "grid": (SPACING, ROUNDS, SAMPLES, BLOCK),
    "particle": (SPACING, PARTICLES, BLOCK),
}
"""Which dials change what each method answers. The simulation's dials are not among them: an
estimate has its own terms, and only the comparison draws simulated readings."""

FINEST = {
    METHOD.name: "grid",
    **{knob.name: knob.levels[-1] for knob in TURNED["grid"]},
}
"""What is asked after an answer, to say what more time would have given."""


def chosen(texts: list[str]) -> Accuracy:
    """The default accuracy but for what an operator wrote, for example ``["localization.rounds=1"]``.

    Raises:
        WrongUse: an unknown dial or level; the nearest is named.
    """
    return Accuracy.default(KNOBS).with_texts(texts)


def levels_of(accuracy: Accuracy) -> Levels:
    """What the estimator takes."""
    senses: dict[Level, Senses] = {"touch": "touch", "audio": "audio", "both": "both"}
    return Levels(
        senses=senses[accuracy[SENSES.name]],
        method="particle" if accuracy[METHOD.name] == "particle" else "grid",
        spacing=float(accuracy[SPACING.name]),
        particles=int(accuracy[PARTICLES.name]),
        block=int(accuracy[BLOCK.name]),
        rounds=int(accuracy[ROUNDS.name]),
        samples=int(accuracy[SAMPLES.name]),
    )


def settings(thorough: bool = False) -> list[dict[str, Level]]:
    """Choices of levels to measure: of each method its cheapest, default and finest, and the way between.

    Args:
        thorough: also every single dial turned from each of the three.
    """
    found: list[dict[str, Level]] = []
    for method, knobs in TURNED.items():
        for setting in _sweep(method, knobs, thorough):
            if setting not in found:
                found.append(setting)
    return found


def setting_name(setting: Mapping[str, Level]) -> str:
    """For people: ``"grid, spacing 2 mm, rounds 3, samples 600, block 8"``."""
    knobs = {knob.name: knob for knob in KNOBS}
    said = [str(setting[METHOD.name])]
    for name, level in setting.items():
        if name != METHOD.name:
            value = f"{1e3 * float(level):g} mm" if knobs[name].unit == "m" else f"{level}"
            said.append(f"{name.removeprefix('localization.')} {value}")
    return ", ".join(said)


def _sweep(method: str, knobs: Sequence[Knob], thorough: bool) -> Iterator[dict[str, Level]]:
    bases = [
        {knob.name: knob.levels[0] for knob in knobs},
        {knob.name: knob.default for knob in knobs},
        {knob.name: knob.levels[-1] for knob in knobs},
    ]
    for base in bases:
        yield _plain(method, base)
    # From the cheapest to the finest, one dial after the other: where the front is likely to lie.
    way = dict(bases[0])
    for knob in reversed(knobs):
        for level in knob.levels:
            way[knob.name] = level
            yield _plain(method, way)
    for base in bases if thorough else bases[1:2]:
        for knob in knobs:
            for level in knob.levels:
                yield _plain(method, {**base, knob.name: level})


def _plain(method: str, setting: Mapping[str, Level]) -> dict[str, Level]:
    """The setting with its method; a dial that another leaves without effect is put to its default."""
    plain = {METHOD.name: method, **setting}
    if plain.get(ROUNDS.name) == 0:
        plain[SAMPLES.name] = SAMPLES.default
    return plain
