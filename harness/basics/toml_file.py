"""Files an operator writes: strict TOML, every mistake named at once, nothing guessed."""

import re
import tomllib
import types
from collections.abc import Sequence
from pathlib import Path
from typing import Any, TypeVar, Union, get_args, get_origin

from pydantic import BaseModel, ConfigDict, ValidationError
from pydantic_core import ErrorDetails

from harness.basics.errors import WrongUse
from harness.basics.files.foreign_file import MOST_TEXT
from harness.basics.files.named_file import nearest
from harness.basics.files.text_file import read_text

M = TypeVar("M", bound=BaseModel)


class StrictModel(BaseModel):
    """A table of a file: unknown keys and wrong types are refused, and what was read stays as it is."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True, serialize_by_alias=True)


def load_toml(path: Path, model: type[M]) -> M:
    """A TOML file as a model.

    Raises:
        WrongUse: the file cannot be read, or says something the model does not know; each
            mistake is named with its key, its value and what was expected.
    """
    return validate(read_toml(path), model, str(path), path.parent)


def read_toml(path: Path) -> dict[str, Any]:
    """Read a TOML file as plain values.

    Raises:
        WrongUse: the file cannot be read, is not TOML, or nests deeper or holds more values than ours do.
    """
    text = read_text(path, "a TOML file", MOST_TEXT, WrongUse)
    # The library takes quadratic time and memory for long dotted keys.
    lines = "\n".join(line for line in text.split("\n") if not line.lstrip().startswith("#"))
    pieces = re.split(r"[,\[\]{}=\n]", re.sub(r"\.{2,}", "", lines))
    if max(piece.count(".") for piece in pieces) > _DEEPEST:
        raise WrongUse(f"{path} {_TOO_DEEP}")
    try:
        tree = tomllib.loads(text)
    # The library lets Python's own errors through, e.g. of a number with 5,000 digits.
    except ValueError as error:
        raise WrongUse(f"{path} is not TOML: {_lower(str(error).partition('; use sys.')[0])}") from error
    except RecursionError as error:
        raise WrongUse(f"{path} {_TOO_DEEP}") from error
    _require_modest(tree, path)
    return tree


def _require_modest(tree: dict[str, Any], path: Path) -> None:
    """Refuse a tree that is too deep for recursion or too large for a list of its mistakes."""
    values = 0
    level: list[Any] = [tree]
    for _ in range(_DEEPEST):
        items: list[Any] = [
            item for table in level for item in (table.values() if isinstance(table, dict) else table)
        ]
        values += len(items)
        if any(isinstance(item, int) and abs(item) >= 2**63 for item in items):
            raise WrongUse(f"{path} holds an integer of more than 64 bits; TOML has none")
        level = [item for item in items if isinstance(item, dict | list)]
        if values > _MOST_VALUES:
            raise WrongUse(f"{path} holds more than {_MOST_VALUES:,} values, and no file of ours does")
        if not level:
            return
    raise WrongUse(f"{path} {_TOO_DEEP}")


_DEEPEST = 32
_MOST_VALUES = 10_000
_TOO_DEEP = f"nests tables or lists more than {_DEEPEST} deep, and no file of ours does"
_MOST_MISTAKES = 20
_MOST_SHOWN = 100
"""Characters of a value that a mistake shows."""


def validate(tree: Any, model: type[M], where: str, folder: Path | None = None) -> M:
    """Plain values (as TOML or JSON give them) as a model.

    Args:
        tree: the values.
        model: of what they say.
        where: names their source in messages.
        folder: that paths among them are relative to, for the model's own checks; None for the one we are in.

    Raises:
        WrongUse: as ``load_toml``.
    """
    try:
        return model.model_validate(_frozen(tree), context={"folder": folder})
    except ValidationError as error:
        details = error.errors(include_url=False)
    problems = [_sentence(detail, model) for detail in details[:_MOST_MISTAKES]]
    if len(problems) == 1:
        raise WrongUse(f"{where}: {problems[0]}")
    listed = "".join(f"\n  - {problem}" for problem in problems)
    more = "\n  - and more" if len(details) > len(problems) else ""
    raise WrongUse(f"{where}: {len(details)} mistakes:{listed}{more}")


def _frozen(value: Any) -> Any:
    """Lists as tuples, at every depth: a model read from a file cannot be changed."""
    if isinstance(value, dict):
        return {key: _frozen(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return tuple(_frozen(item) for item in value)
    return value


def _sentence(detail: ErrorDetails, model: type[BaseModel]) -> str:
    location, kind = detail["loc"], detail["type"]
    key = _dotted(location)
    if kind == "extra_forbidden":
        table = f"[{_dotted(location[:-1])}]" if len(location) > 1 else "the file"
        name = str(location[-1])
        return f"unknown key {key!r}; in {table} {nearest(name, _keys_at(model, location[:-1]))}"
    if kind == "missing":
        return f"{key!r} is missing"
    if kind == "model_type":
        return f"{key!r} must be a table, [{key}], not {_shown(detail['input'])}"
    if kind == "value_error":
        return _with_value(key, detail, str(detail["ctx"]["error"]))
    if kind == "literal_error":
        allowed = str(detail["ctx"]["expected"])
        expected = f"it must be {allowed}"
        if isinstance(detail["input"], str):
            names = [part.strip().strip("'") for part in allowed.replace(" or ", ", ").split(",")]
            expected = f"not known; {nearest(detail['input'], names)}"
        return _with_value(key, detail, expected)
    return _with_value(key, detail, _lower(detail["msg"].replace("Input should", "it should")))


def _with_value(key: str, detail: ErrorDetails, expected: str) -> str:
    value = detail["input"]
    shown = list(value) if isinstance(value, tuple) else value
    quoted = _shown(shown)
    if expected.startswith(repr(shown)[:_MOST_SHOWN]):
        return f"{key!r}: {expected}" if key else expected
    if isinstance(value, dict):
        return f"[{key}]: {expected}" if key else expected
    return f"{key!r} = {quoted}: {expected}"


def _shown(value: Any) -> str:
    text = repr(value)
    return text if len(text) <= _MOST_SHOWN else f"{text[:_MOST_SHOWN]}..."


def _dotted(location: Sequence[str | int]) -> str:
    text = ""
    for part in location:
        text += f"[{part}]" if isinstance(part, int) else f".{part}" if text else part
    return text


def _keys_at(model: type[BaseModel], location: Sequence[str | int]) -> list[str]:
    """The keys of the table at ``location``."""
    here: type[BaseModel] | None = model
    for part in location:
        if isinstance(part, int) or here is None:
            continue
        field = next(f for name, f in here.model_fields.items() if (f.alias or name) == part)
        here = _model_in(field.annotation)
    return [] if here is None else [field.alias or name for name, field in here.model_fields.items()]


def _model_in(annotation: Any) -> type[BaseModel] | None:
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return annotation
    if get_origin(annotation) in (Union, types.UnionType, tuple):
        return next((found for part in get_args(annotation) if (found := _model_in(part))), None)
    return None


def _lower(text: str) -> str:
    return text[:1].lower() + text[1:]
