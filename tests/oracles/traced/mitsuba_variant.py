"""Which of Mitsuba's ways to compute works on this machine: found out without dying of it."""

import functools
import importlib.util
import logging
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

from harness.basics.errors import WrongUse

FAST, ALWAYS = "llvm_ad_rgb", "scalar_rgb"

PATIENCE = 120.0
"""s for the attempt: the first compilation takes one on a quiet machine."""

_LOG = logging.getLogger(__name__)


@dataclass(frozen=True)
class Variant:
    """A way to compute."""

    name: str  #: of Mitsuba's.
    because: str  #: why it was taken, in words.


@functools.cache
def chosen_variant(wanted: str = FAST) -> Variant:
    """``wanted`` where it renders in a process of its own, else the one that always works; logged once.

    Args:
        wanted: a variant of Mitsuba's.

    Raises:
        WrongUse: Mitsuba is not installed, or none of its variants is so called.
    """
    if importlib.util.find_spec("mitsuba") is None:
        raise WrongUse("path tracing needs Mitsuba, which is not installed; install the extra 'oracles'")
    import mitsuba

    if wanted not in mitsuba.variants():
        raise WrongUse(f"Mitsuba has no variant {wanted!r}; it has {', '.join(mitsuba.variants())}")
    trouble = "" if wanted == ALWAYS else _trouble(wanted)
    if trouble:
        chosen = Variant(ALWAYS, f"{wanted} does not render here: {trouble}")
    else:
        chosen = Variant(wanted, "asked for" if wanted == ALWAYS else "it renders here")
    _LOG.info("Mitsuba renders with %s: %s", chosen.name, chosen.because)
    return chosen


def _trouble(variant: str) -> str:
    """What kept a variant from rendering in a child; empty where nothing did."""
    command = [sys.executable, str(Path(__file__).with_name("mitsuba_probe.py")), variant]
    try:
        ended = subprocess.run(command, capture_output=True, text=True, timeout=PATIENCE, check=False)
    except subprocess.TimeoutExpired:
        return f"no picture within {PATIENCE:g} s"
    if ended.returncode == 0:
        return ""
    said = [line for line in ended.stderr.splitlines() if "LLVM" in line or "Error" in line]
    how = f"signal {-ended.returncode}" if ended.returncode < 0 else f"exit code {ended.returncode}"
    return f"{how}, {said[0].strip()[:160]}" if said else how
