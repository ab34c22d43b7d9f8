"""What the mocked world wrote beside a run; only scoring and the report read it."""

import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from harness.basics.arrays import FloatArray
from harness.basics.mesh import Mesh
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


def truth_paths(recording: Recording) -> tuple[Path, Path]:
    """Of what the world wrote beside a run, whether or not it is there: numbers, and the true surface."""
    return recording.truth_path, recording.truth_path.with_suffix(".npz")


def read_truth(recording: Recording) -> Truth | None:
    """The truth of a run; None at a real bench, and where the file was taken away."""
    path, _ = truth_paths(recording)
    if not path.exists():
        return None
    written = json.loads(path.read_text(encoding="utf-8"))
    points = {c["step"]: np.array(c["point_in_object_m"]) for c in written["contacts"]}
    return Truth(points, written["differences"])


def read_true_surface(recording: Recording) -> Mesh | None:
    """The true object of a mocked run as it stands, in base; None where nothing says it."""
    _, path = truth_paths(recording)
    if not path.exists():
        return None
    with np.load(path, allow_pickle=False) as archive:
        return Mesh(archive["vertices"], archive["faces"])
