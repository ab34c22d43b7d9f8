"""What a source states of its own error: a network, on its model card."""

import numpy as np
from scipy.special import ndtri

from harness.agreement.agreement import Source
from harness.agreement.subject import Subject
from harness.basics.arrays import FloatArray
from harness.basics.errors import WrongUse
from harness.objectfile.entries import Modality
from harness.objectfile.touch_entries import WORST_OF_TEN, rms_at

_MAPS = "unseen_places_psnr_db_median", WORST_OF_TEN
"""Of half, and of nine in ten, of presses at places that were never coded the map is at least as good."""

_SLICES = (np.arange(10) + 0.5) / 10.0
"""Probabilities in the middle of ten equal slices."""

_GROSS = 0.05
"""Share of presses at which a touch network's map is none of the object's: beside a rim or a handle it may
show a surface where there is none. No model card states it: it is what development runs have."""

_GAINS = "gain_error_p95"
"""At 95 of 100 vertices that were held out, relative, a mode's gains are no farther off."""


def map_errors(subject: Subject, source: Source) -> FloatArray:
    """``(s,)`` m, root mean square over a whole map: by how much a source's surface of the gel is off.

    Most presses are off by a tenth of what the worst are, so that one number does not say it: the decibels of
    the model card are normal, with its median and its tenth percentile, and each of ten slices counts alike.

    Raises:
        WrongUse: the network's model card states none.
    """
    if source != "network":
        return np.zeros(1)
    median, tenth = (_stated(subject, "touch", name) for name in _MAPS)
    decibels = median + max(0.0, median - tenth) / -ndtri(0.1) * ndtri(_SLICES)
    return rms_at(decibels)


def gross_share(source: Source) -> float:
    """Probability of a press that a source's surface of the gel is wrong altogether."""
    return _GROSS if source == "network" else 0.0


def gain_error(subject: Subject, source: Source) -> float:
    """Relative: by how much the gains of modes that a source gives are off.

    Raises:
        WrongUse: the network's model card states none.
    """
    return _stated(subject, "audio", _GAINS) if source == "network" else 0.0


def _stated(subject: Subject, sense: Modality, name: str) -> float:
    of = subject.objectfile
    entry = None if of is None else of.description.networks.get(sense)
    measured = {} if entry is None else entry.measured
    if name not in measured:
        raise WrongUse(
            f"the model card of the {sense} network of {subject.scene.object.name} states no {name}, and "
            "without its own error nothing can be compared with it; build it again"
        )
    return measured[name]
