"""Faults on cue: what goes wrong at the far end of a cable, and until when.

A cue is one JSON object, ``{"instrument": "gel", "kind": "stall", "seconds": 2}``. Without
``seconds`` the fault lasts until the same instrument is cued ``{"kind": "none"}``.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from harness.basics.clock import now
from harness.basics.errors import WrongUse

CAMERA_FAULTS = ("none", "stall", "truncate", "drop", "freeze", "saturate")
"""stall: nothing is sent. truncate: half of each JPEG is sent. drop: connections are reset and
refused. freeze: the last frame again and again. saturate: an overexposed picture."""

HAMMER_FAULTS = ("none", "stall", "overflow", "lost_byte", "lost_word", "unplug")
"""Of the hammer's box. stall: no samples and no answers. overflow: nothing leaves while samples go on.
lost_byte, lost_word: one is missing from the stream. unplug: the cable is pulled, for good."""

_KEYS = ("instrument", "kind", "seconds")


@dataclass(frozen=True)
class Fault:
    """One cue."""

    instrument: str  #: by its name in the station.
    kind: str  #: of those that the instrument's far end takes.
    seconds: float | None = None  #: how long; None until it is cleared.


def parse(cue: Mapping[str, object], kinds: Mapping[str, tuple[str, ...]]) -> Fault:
    """Read a cue.

    Raises:
        WrongUse: an unknown key, instrument or kind, or a duration that is not above zero.
    """
    unknown = sorted(set(cue) - set(_KEYS))
    if unknown:
        raise WrongUse(f"a fault has the keys {', '.join(_KEYS)}; it has no {', '.join(unknown)}")
    instrument, kind, seconds = cue.get("instrument"), cue.get("kind"), cue.get("seconds")
    if not isinstance(instrument, str) or instrument not in kinds:
        raise WrongUse(f"no instrument {instrument!r} to put a fault into; there are {', '.join(kinds)}")
    if not isinstance(kind, str) or kind not in kinds[instrument]:
        raise WrongUse(f"the {instrument} has no fault {kind!r}; it has {', '.join(kinds[instrument])}")
    if seconds is None:
        return Fault(instrument, kind)
    if not isinstance(seconds, int | float) or isinstance(seconds, bool) or not 0.0 < seconds < np.inf:
        raise WrongUse(f"a fault of {seconds!r} s; it lasts a finite number of seconds above zero")
    return Fault(instrument, kind, float(seconds))


class ActiveFault:
    """The fault an instrument has at present."""

    def __init__(self) -> None:
        self._kind = "none"
        self._until = np.inf

    def set(self, fault: Fault) -> None:
        """Begin ``fault``, in place of any other."""
        self._kind = fault.kind
        self._until = np.inf if fault.seconds is None else now() + fault.seconds

    @property
    def kind(self) -> str:
        """Of the fault now, ``"none"`` where all is well."""
        return self._kind if now() < self._until else "none"
