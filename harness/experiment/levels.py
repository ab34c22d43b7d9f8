"""One choice of every dial of an experiment, from what an operator wrote."""

from collections.abc import Mapping, Sequence

from harness.basics.errors import WrongUse
from harness.effects.accuracy import Accuracy, Knob, Level
from harness.effects.touch_file_effects import SHAPES as DRAWN


def chosen_levels(
    knobs: Sequence[Knob[Level]], texts: Sequence[str], start: Mapping[str, Level] | None = None
) -> Accuracy:
    """The default accuracy but for what an operator wrote, for example ``["localization.rounds=1"]``.

    Args:
        knobs: all that there are.
        texts: what was written.
        start: levels to turn from instead of the default ones.

    Raises:
        WrongUse: an unknown dial or level, and the nearest is named; a touch that no run carries.
    """
    accuracy = Accuracy.default(knobs).with_(start or {}).with_texts(list(texts))
    if DRAWN.name in accuracy and accuracy[DRAWN.name] != DRAWN.default:
        raise WrongUse(
            f"{DRAWN.name} = {accuracy[DRAWN.name]}: a run is compared with the mesh that it carries, and it "
            f"carries no ObjectFile's touch; take {DRAWN.name} = {DRAWN.default}, or draw a press with "
            "`touchstone object render touch`"
        )
    return accuracy
