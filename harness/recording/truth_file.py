"""The truth of a mocked run as a file: the mocked world writes it, and only scores are computed from it."""

import json
from collections.abc import Mapping
from math import isfinite
from pathlib import Path
from typing import Annotated, Any

from pydantic import BaseModel, Field, ValidationError

from harness.basics.errors import RecordingDamaged
from harness.basics.files.foreign_file import MOST_JSON, read_bounded
from harness.basics.files.json_file import CHECKSUM, checksum_of, parse_strictly
from harness.basics.whole_file import write_text_whole

SCHEMA = 2
UNSUMMED = 1
"""The schema of files without checksum and run identity."""

_UNSUMMED_KEYS = {"schema", "seed", "base_from_object", "differences", "contacts"}

_Finite = Annotated[float, Field(allow_inf_nan=False)]


class _Contact(BaseModel):
    step: int = Field(ge=0, strict=True)
    point_in_object_m: tuple[_Finite, _Finite, _Finite] | None = None


class _Truth(BaseModel):
    seed: int = Field(strict=True)
    run_id: str = ""
    surface_sha256: str | None = None
    differences: dict[str, Any]
    contacts: list[_Contact]


def surface_path(path: Path) -> Path:
    """The file of the true surface, beside the truth file ``path``."""
    return path.with_suffix(".npz")


def write_truth_file(path: Path, fields: Mapping[str, Any]) -> None:
    """Write the fields and their checksum, atomically."""
    text = json.dumps({**fields, CHECKSUM: checksum_of(fields)}, indent=1, allow_nan=False)
    write_text_whole(path, text + "\n")


def read_truth_file(path: Path) -> dict[str, Any]:
    """Read and check the fields of a truth file.

    Raises:
        WrongUse: no file, or one that may not be read.
        RecordingDamaged: longer than any such file, or not what the mocked world wrote.
    """
    data = read_bounded(path, "the truth of a run", MOST_JSON, RecordingDamaged)
    try:
        fields = parse_strictly(data)
    except (ValueError, RecursionError) as error:
        raise RecordingDamaged(f"{path} is damaged: it is not JSON") from error
    schema = fields.get("schema") if isinstance(fields, dict) else None
    if isinstance(schema, bool) or schema not in (UNSUMMED, SCHEMA):
        raise RecordingDamaged(f"{path}: schema {schema!r}; this version reads {UNSUMMED} and {SCHEMA}")
    if schema == SCHEMA and fields.get(CHECKSUM) != checksum_of(fields):
        raise RecordingDamaged(f"{path} is damaged: its values do not agree with its checksum")
    if schema == UNSUMMED and set(fields) != _UNSUMMED_KEYS:
        raise RecordingDamaged(f"{path} is damaged: it has not the keys of schema {UNSUMMED}")
    try:
        _Truth.model_validate(fields)
    except ValidationError as error:
        key = ".".join(str(part) for part in error.errors()[0]["loc"])
        raise RecordingDamaged(f"{path} is damaged: {key!r}: {error.errors()[0]['msg'].lower()}") from error
    size = fields["differences"].get("longest_side_m", 1.0)
    if isinstance(size, bool) or not isinstance(size, int | float) or not isfinite(size) or size <= 0.0:
        raise RecordingDamaged(f"{path} is damaged: the object's longest side is {size!r} m")
    return dict(fields)
