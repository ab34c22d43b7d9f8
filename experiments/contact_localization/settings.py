"""Every dial of a localization run: the estimator's own and the simulation's, as one accuracy."""

from collections.abc import Collection, Iterator, Mapping, Sequence

from experiments.contact_localization.posterior.estimate import (
    BLOCK,
    DIALS,
    METHOD,
    PARTICLES,
    ROUNDS,
    SAMPLES,
    SENSES,
    SPACING,
)
from harness.effects.accuracy import Accuracy, Knob, Level, Setting
from harness.effects.catalogue import EFFECTS, NETWORK
from harness.effects.effect import knobs_of
from harness.effects.sound import EDGE, MODES, SHAPES
from harness.effects.touch import SHAPES as TOUCH
from harness.objectfile.entries import Modality

KNOBS = (*DIALS, *knobs_of(EFFECTS))


HEARD: tuple[Knob[Level], ...] = (MODES, EDGE, SHAPES)
"""Dials of the modes that an estimate compares sounds with."""


SIMULATED: tuple[Knob[Level], ...] = (*HEARD, TOUCH)
"""Dials of the simulation that an estimate depends on: its modes, and what candidates' tactile images are
crops of. Its other terms are its own, and only the comparison of a report draws simulated readings."""


def grid(senses: str, spacing: float, rounds: int, samples: int, block: int) -> dict[str, Level]:
    """The posterior over a grid, refined: by senses, spacing in m, most rounds, draws, pixels averaged."""
    dials = {SPACING.name: spacing, ROUNDS.name: rounds, SAMPLES.name: samples, BLOCK.name: block}
    return {SENSES.name: senses, METHOD.name: "grid", **dials}


def particles(number: int, spacing: float, block: int) -> dict[str, Level]:
    """The paper's filter, by touch."""
    dials = {SPACING.name: spacing, PARTICLES.name: number, BLOCK.name: block}
    return {SENSES.name: "touch", METHOD.name: "particle", **dials}


def by_sound(spacing: float) -> dict[str, Level]:
    """The grid by sound alone, which no other dial of it changes."""
    return {SENSES.name: "audio", METHOD.name: "grid", SPACING.name: spacing}


_DIALS: Mapping[Modality, Knob[Level]] = {"touch": TOUCH, "audio": SHAPES}
"""By the sense whose network is a level of them."""


_COARSEST = (4e-3, 0, 3000, 16)


_DEFAULT = (2e-3, 5, 3000, 8)


_GRIDS = (
    _COARSEST,
    (3e-3, 0, 3000, 16),
    (2e-3, 0, 3000, 16),
    (2e-3, 0, 3000, 8),
    (3e-3, 1, 1500, 16),
    (2e-3, 1, 1500, 16),
    (2e-3, 5, 1500, 8),
    _DEFAULT,
    (1.5e-3, 5, 6000, 8),
)
"""Spacing, rounds, samples and block: from the cheapest to the finest, where the front is likely to lie."""


FINEST = grid("both", 1.5e-3, 5, 6000, 8)
"""What is asked after an answer, to say what more time would have given."""


def accuracy_at(setting: Setting) -> Accuracy:
    """Every dial at a setting; what that leaves open is at its default."""
    return Accuracy.default(KNOBS).with_(setting)


def settings(
    thorough: bool = False, sound: bool = True, networks: Collection[Modality] = ()
) -> list[dict[str, Level]]:
    """Choices of levels to measure, each once: by every sense, from the cheapest to the finest.

    Args:
        thorough: also every single dial turned from the default, by each sense.
        sound: whether the runs were heard; touch alone where not.
        networks: senses of which the ObjectFile of every scene has one, which can stand for the simulation.
    """
    found = [
        *(grid("touch", *dials) for dials in _GRIDS),
        *(particles(*dials) for dials in ((300, 4e-3, 16), (1000, 2e-3, 8), (3000, 2e-3, 8))),
    ]
    if sound:
        found += [grid("both", *dials) for dials in _GRIDS]
        found += [by_sound(float(spacing)) for spacing in SPACING.levels]
        # Fewer modes, and modes of coarser elements, than the default ones.
        few: tuple[dict[str, Level], ...] = ({MODES.name: 16}, {MODES.name: 32}, {EDGE.name: 0.7})
        full, quick = grid("both", *_DEFAULT), grid("both", *_COARSEST)
        found += [{**full, **level} for level in few]
        found += [{**quick, **few[0]}, {**by_sound(2e-3), **few[1]}]
    for turned in _turned(sound) if thorough else ():
        if turned not in found:
            found.append(turned)
    dials = [dial for sense, dial in _DIALS.items() if sense in networks and (sound or sense == "touch")]
    # Where an object has networks, what is left open is theirs.
    simulated = {dial.name: dial.default for dial in dials}
    return [*({**setting, **simulated} for setting in found), *_by_networks(dials)]


def settings_by_count(sound: bool = True) -> list[dict[str, Level]]:
    """The few settings that are measured with fewer contacts too."""
    cheapest = grid("touch", *_COARSEST)
    dials = ((2e-3, 0, 3000, 16), _DEFAULT)
    touch = [cheapest, *(grid("touch", *each) for each in dials)]
    both = [grid("both", *each) for each in dials]
    return [*touch, *both, by_sound(4e-3), by_sound(2e-3)] if sound else touch


def _by_networks(dials: Sequence[Knob[Level]]) -> list[dict[str, Level]]:
    """The ObjectFile's networks, and its table of modes, in place of what is simulated."""
    by_touch: dict[str, Level] = {TOUCH.name: NETWORK} if TOUCH in dials else {}
    found = [{**grid("touch", *each), **by_touch} for each in (_COARSEST, _DEFAULT) if by_touch]
    for shapes in SHAPES.levels if SHAPES in dials else ():
        if shapes != SHAPES.default:
            networks = {**by_touch, SHAPES.name: shapes}
            found += [{**grid("both", *each), **networks} for each in (_COARSEST, _DEFAULT)]
            found.append({**by_sound(2e-3), **networks})
    return found


def _turned(sound: bool) -> Iterator[dict[str, Level]]:
    """Every dial of the grid turned from its default, one at a time."""
    for senses in ("touch", "both") if sound else ("touch",):
        default = grid(senses, *_DEFAULT)
        for knob in (SPACING, ROUNDS, SAMPLES, BLOCK, *((MODES, EDGE) if senses == "both" else ())):
            for level in knob.levels:
                if level == knob.default:
                    continue
                yield {**default, knob.name: level}


def setting_name(setting: Mapping[str, Level]) -> str:
    """For people: ``"both, grid, spacing 2 mm, rounds 5, samples 3000, block 8"``."""
    knobs = {knob.name: knob for knob in KNOBS}
    said = [str(setting[name]) for name in (SENSES.name, METHOD.name) if name in setting]
    for name, level in setting.items():
        if name not in (SENSES.name, METHOD.name):
            value = f"{1e3 * float(level):g} mm" if knobs[name].unit == "m" else f"{level}"
            said.append(f"{name.removeprefix('localization.')} {value}")
    return ", ".join(said)


def needs_sound(setting: Mapping[str, Level]) -> bool:
    """Whether a setting was measured on runs that were heard; one that names no sense was not."""
    return setting.get(SENSES.name, "touch") != "touch"
