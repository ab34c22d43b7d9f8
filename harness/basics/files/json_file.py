"""Files that programs write for programs: strict JSON of one model, whole or not at all."""

import json
from collections.abc import Mapping
from hashlib import sha256
from pathlib import Path
from typing import Any, TypeAlias, TypeVar

from pydantic import BaseModel, ValidationError

from harness.basics.errors import CalibrationRefused
from harness.basics.files.foreign_file import MOST_JSON, read_bounded
from harness.basics.whole_file import write_text_whole

M = TypeVar("M", bound=BaseModel)

JsonObject: TypeAlias = Mapping[str, Any]
"""JSON object: the type of a value follows from its key, which no type can state."""

CHECKSUM = "sha256"
"""The key under which a JSON object carries the checksum of its other values."""


def checksum_of(fields: Mapping[str, Any]) -> str:
    """Compute the SHA-256 of JSON values, independent of their layout in a file and of ``CHECKSUM``."""
    summed = {key: value for key, value in fields.items() if key != CHECKSUM}
    return sha256(json.dumps(summed, sort_keys=True).encode()).hexdigest()


def parse_strictly(data: bytes) -> Any:
    """Parse JSON, and refuse NaN and infinities; raises ``ValueError`` or ``RecursionError``."""

    def refuse(name: str) -> float:
        raise ValueError(name)

    return json.loads(data, parse_constant=refuse)


def write_model(model: BaseModel, path: Path) -> None:
    """Write the file, whole or not at all."""
    write_text_whole(path, json.dumps(model.model_dump(by_alias=True), indent=1, allow_nan=False) + "\n")


def read_model(path: Path, kind: type[M], what: str, advice: str) -> M:
    """Read the file, strictly.

    Args:
        path: of the file.
        kind: of model.
        what: such a file is called.
        advice: what to give instead of one that is none.

    Raises:
        WrongUse: missing, or none that may be read.
        CalibrationRefused: not what ``write_model`` writes.
    """
    try:
        return kind.model_validate_json(read_bounded(path, what, MOST_JSON, CalibrationRefused))
    except ValidationError as error:
        raise CalibrationRefused(f"{path} is no {what}: {_first(error)}; {advice}") from error


def _first(error: ValidationError) -> str:
    first = error.errors()[0]
    if first["type"] == "json_invalid":
        return "it is no JSON"
    where = ".".join(str(part) for part in first["loc"]) or "all of it"
    said = first["msg"].removeprefix("Value error, ").replace("Input should", "it should")
    return f"{where}: {said}"
