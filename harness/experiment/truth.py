"""The truth that the mocked world wrote beside a run; only scores and the report use it."""

from collections.abc import Mapping
from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path

import numpy as np

from harness.basics.arrays import FloatArray
from harness.basics.errors import RecordingDamaged, TouchstoneError
from harness.basics.files.foreign_file import MOST_DATA, read_bounded
from harness.basics.files.json_file import JsonObject
from harness.basics.mesh import Mesh
from harness.basics.npz_file import read_arrays
from harness.recording.recording import Recording
from harness.recording.truth_file import UNSUMMED, read_truth_file, surface_path


@dataclass(frozen=True, eq=False)
class Truth:
    """The true values of a mocked run."""

    points: Mapping[int, FloatArray]
    """By step, ``(3,)`` m: the contact on the nominal object."""

    differences: JsonObject
    """Differences of the mocked world from its model, by name."""

    surface: Mesh | None = None
    """The true object in its true pose, m in base; None where its file is missing."""

    note: str | None = None
    """One sentence for the operator, where the file has no checksum."""


def truth_paths(recording: Recording) -> tuple[Path, Path]:
    """The two files that the world may have written beside a run: numbers, and the true surface."""
    return recording.truth_path, surface_path(recording.truth_path)


def read_truth(recording: Recording) -> Truth | None:
    """Read the truth of a run; None at a real bench, and where the file was taken away.

    Raises:
        RecordingDamaged: a file that is damaged, or was written for another run.
        WrongUse: a file that may not be read.
    """
    path, surface = truth_paths(recording)
    if not path.exists():
        return None
    fields = read_truth_file(path)
    header, is_unsummed = recording.header, fields["schema"] == UNSUMMED
    if fields.get("run_id", "") != header.run_id or fields["seed"] != header.seed:
        raise RecordingDamaged(f"{path} was written for another run than {recording.folder}")
    return Truth(
        points={
            contact["step"]: np.array(contact["point_in_object_m"], dtype=np.float64)
            for contact in fields["contacts"]
            if contact.get("point_in_object_m") is not None
        },
        differences=fields["differences"],
        surface=_read_surface(surface, None if is_unsummed else fields["surface_sha256"]),
        note=f"{path} has no checksum, as an earlier version wrote it: damage of it would change the scores"
        if is_unsummed
        else None,
    )


def truth_or_notes(recording: Recording) -> tuple[Truth | None, tuple[str, ...]]:
    """Read the truth of a run for its scores; what is wrong with it becomes a sentence, never a failure."""
    try:
        truth = read_truth(recording)
    except TouchstoneError as error:
        return None, (f"{error}; the answer is given without scores",)
    return truth, () if truth is None or truth.note is None else (truth.note,)


def read_true_surface(recording: Recording) -> Mesh | None:
    """Read the true object of a mocked run in its true pose, m in base; None where no file has it."""
    truth = read_truth(recording)
    return None if truth is None else truth.surface


def _read_surface(path: Path, wanted_sum: str | None) -> Mesh | None:
    """Read the true surface; ``wanted_sum`` is the SHA-256 of its file, None where none is known."""
    if not path.exists():
        return None
    data = read_bounded(path, "the true surface of a run", MOST_DATA, RecordingDamaged)
    if wanted_sum is not None and sha256(data).hexdigest() != wanted_sum:
        raise RecordingDamaged(f"{path} is damaged: its bytes do not agree with their checksum")
    arrays = read_arrays(path, "the true surface of a run", ("vertices", "faces"), refused=RecordingDamaged)
    vertices, faces = arrays["vertices"], arrays["faces"]
    if not (
        vertices.ndim == faces.ndim == 2
        and vertices.shape[1] == faces.shape[1] == 3
        and vertices.dtype.kind == "f"
        and faces.dtype.kind in "iu"
        and faces.size
        and np.isfinite(vertices).all()
        and faces.min() >= 0
        and faces.max() < len(vertices)
    ):
        raise RecordingDamaged(f"{path} is damaged: it holds no surface")
    return Mesh(vertices, faces)
