"""Where and with what a curve was measured, and whether that is still so."""

import importlib.metadata
import os
import platform
from collections.abc import Mapping
from pathlib import Path

from harness.basics.code_version import content_hash
from harness.basics.cores import own_cores
from harness.cost.curve import Curve
from harness.recording.run_folder import git_commit

_VERSIONS = ("numpy", "scipy", "numba")


_THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS")


def machine() -> dict[str, str]:
    """What decides how long a computation takes here: processor, cores, thread limits, versions."""
    limits = ", ".join(f"{name}={os.environ[name]}" for name in _THREADS if name in os.environ)
    found = {
        "cpu": _cpu_model(),
        "cores": str(own_cores()),
        "threads": limits or "not limited",
        "system": f"{platform.system()} {platform.machine()}",
        "python": platform.python_version(),
    }
    return {**found, **{name: importlib.metadata.version(name) for name in _VERSIONS}}


def code(module: str) -> dict[str, str]:
    """The version of a computation: its sources' hash, and the commit they were near to.

    The hash decides whether a curve still holds: a commit that touches nothing of it changes no
    number, and a change that is not committed does.
    """
    return {"module": module, "sha256": content_hash(module), "git": git_commit()}


def stale(curve: Curve, here: Mapping[str, str], now: Mapping[str, str]) -> tuple[str, ...]:
    """Return reasons why a curve does not hold for the machine ``here`` and the code ``now``."""
    reasons = [
        f"{name} was {curve.machine.get(name, 'not noted')}, is {here.get(name, 'not noted')}"
        for name in dict.fromkeys((*curve.machine, *here))
        if curve.machine.get(name) != here.get(name)
    ]
    if curve.code.get("sha256") != now.get("sha256"):
        reasons.append(f"the estimate's code has changed since {curve.code.get('git', 'an unknown commit')}")
    return tuple(reasons)


def _cpu_model() -> str:
    info = Path("/proc/cpuinfo")
    if info.is_file():
        for line in info.read_text(encoding="utf-8", errors="replace").splitlines():
            if line.startswith(("model name", "Model")):
                return line.partition(":")[2].strip()
    return platform.processor() or "unknown"
