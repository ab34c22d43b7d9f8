"""The command ``sim touch``, run, and height maps for it."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from harness.basics.arrays import FloatArray
from harness.cli import invoke


def answered(
    capsys: pytest.CaptureFixture[str], folder: Path, *words: str | Path, code: int = 0
) -> dict[str, Any]:
    out = [] if "--out" in words else ["--out", str(folder / "a.png")]
    assert invoke(["sim", "touch", *map(str, words), *out, "--json"]) == code
    answer: dict[str, Any] = json.loads(capsys.readouterr().out)
    return answer


def bump(deepest: float) -> FloatArray:
    y, x = np.mgrid[:120, :160] - np.array([60.0, 80.0])[:, None, None]
    return np.asarray(deepest * np.maximum(0.0, 1.0 - (x * x + y * y) / 500.0))


def saved(folder: Path, heights: Any, name: str = "h.npy") -> Path:
    np.save(folder / name, heights)
    return folder / name
