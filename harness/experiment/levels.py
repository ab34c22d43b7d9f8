"""One choice of every dial of an experiment, from what an operator wrote."""

from collections.abc import Mapping, Sequence

from harness.effects.accuracy import Accuracy, Knob, Level


def chosen_levels(
    knobs: Sequence[Knob[Level]], texts: Sequence[str], start: Mapping[str, Level] | None = None
) -> Accuracy:
    """The default accuracy but for what an operator wrote, for example ``["localization.rounds=1"]``.

    Args:
        knobs: all that there are.
        texts: what was written.
        start: levels to turn from instead of the default ones.

    Raises:
        WrongUse: an unknown dial or level, and the nearest is named.
    """
    return Accuracy.default(knobs).with_(start or {}).with_texts(list(texts))
