"""What the mocked world wrote beside a run; only scoring and the report read it."""

import json
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from harness.basics.arrays import FloatArray
from harness.recording.recording import Recording


@dataclass(frozen=True, eq=False)
class Truth:
    """What is true of a mocked run.

    Attributes:
        points: by step, ``(3,)`` metres: the contact on the nominal object.
        differences: what the world did differently, by name.
    """

    points: Mapping[int, FloatArray]
    differences: Mapping[str, Any]


def read_truth(recording: Recording) -> Truth | None:
    """The truth of a run; None at a real bench, and where the file was taken away."""
    path = recording.truth_path
    if not path.exists():
        return None
    written = json.loads(path.read_text(encoding="utf-8"))
    points = {c["step"]: np.array(c["point_in_object_m"]) for c in written["contacts"]}
    return Truth(points, written["differences"])
