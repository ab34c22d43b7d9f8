"""Tables of the keys of pydantic models and dataclasses, for the pages of docs/reference."""

import ast
import re
import types
from collections.abc import Iterable, Iterator
from dataclasses import fields
from inspect import cleandoc, getsource
from textwrap import dedent
from typing import Annotated, Any, Literal, Union, cast, get_args, get_origin

from annotated_types import Ge, Gt, Le, Lt, MinLen
from pydantic import AfterValidator, BaseModel
from pydantic.fields import FieldInfo

from harness.basics.quantities import ANGLE, Dimension, nonnegative, ordered, positive

_CHECKS = {positive: "above 0", nonnegative: "0 or more", ordered: "ascending"}
_PLAIN = {str: "text", int: "whole number", float: "number", bool: "true or false", type(None): "null"}


def summary(documented: Any) -> str:
    """The first paragraph of a docstring, on one line."""
    return markdown(cleandoc(documented.__doc__ or "").split("\n\n")[0])


def meanings(documented: type) -> dict[str, str]:
    """Descriptions of a class's own fields: the ``#:`` comment on a field's line, or the string below it."""
    source = dedent(getsource(documented))
    lines, body = source.splitlines(), cast(ast.ClassDef, ast.parse(source).body[0]).body
    found: dict[str, str] = {}
    for statement, below in zip(body, [*body[1:], None], strict=True):
        if not (isinstance(statement, ast.AnnAssign) and isinstance(statement.target, ast.Name)):
            continue
        _, comment, text = lines[(statement.end_lineno or statement.lineno) - 1].partition("  #: ")
        if comment:
            found[statement.target.id] = markdown(text)
        elif isinstance(below, ast.Expr) and isinstance(below.value, ast.Constant):
            found[statement.target.id] = markdown(str(below.value.value))
    return found


def markdown(text: str) -> str:
    """A docstring's text as one line of Markdown, fit for a cell of a table."""
    return " ".join(text.split()).replace("``", "`").replace("|", "\\|")


def row(*cells: str) -> str:
    """A line of a table."""
    return f"| {' | '.join(cells)} |"


def table(headings: tuple[str, ...], rows: Iterable[tuple[str, ...]]) -> list[str]:
    """The lines of a table."""
    return [row(*headings), "|---" * len(headings) + "|", *(row(*cells) for cells in rows)]


def nested(model: type[BaseModel], name: str, seen: dict[type[BaseModel], str]) -> dict[type[BaseModel], str]:
    """Every model inside a model, each once, by the dotted name of the key that holds it first."""
    for key, field in model.model_fields.items():
        for inner in _models_in(field.annotation):
            if inner not in seen:
                at = field.alias or key
                seen[inner] = f"{name}.{at}" if name else at
                nested(inner, seen[inner], seen)
    return seen


def keys(model: type[BaseModel], names: dict[type[BaseModel], str]) -> list[tuple[str, ...]]:
    """A model's rows: key, what is written, default, meaning."""
    said = inherited_meanings(model)
    found: list[tuple[str, ...]] = []
    for name, field in model.model_fields.items():
        meaning = said.get(name, "")
        if not meaning:
            meaning = next((summary(inner) for inner in _models_in(field.annotation)), "")
        kind = _kind(field.annotation, field.metadata, names)
        found.append((f"`{field.alias or name}`", kind, _default(field), meaning))
    return found


def inherited_meanings(model: type) -> dict[str, str]:
    """Descriptions of the fields of a class and of its bases."""
    found: dict[str, str] = {}
    for base in reversed(model.__mro__):
        if base.__module__.partition(".")[0] not in ("builtins", "pydantic", "abc", "typing"):
            found.update(meanings(base))
    return found


def dataclass_keys(model: type) -> list[tuple[str, ...]]:
    """A dataclass's rows: key and meaning."""
    said = meanings(model)
    return [(f"`{field.name}`", said.get(field.name, "")) for field in fields(model)]


def anchor(heading: str) -> str:
    """The anchor that GitHub gives a heading."""
    return re.sub(r"[^\w\- ]", "", heading.lower().replace("`", "")).replace(" ", "-")


def _models_in(annotation: Any) -> list[type[BaseModel]]:
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return [annotation]
    return [found for part in get_args(annotation) for found in _models_in(part)]


def _kind(annotation: Any, metadata: list[Any], names: dict[type[BaseModel], str]) -> str:
    origin, parts = get_origin(annotation), get_args(annotation)
    if origin is Annotated:
        return _kind(parts[0], [*_flat(parts[1:]), *metadata], names)
    if origin is Literal:
        kind = " or ".join(f'`"{part}"`' if isinstance(part, str) else f"`{part}`" for part in parts)
    elif origin in (Union, types.UnionType):
        kind = " or ".join(_kind(part, [], names) for part in parts if part is not type(None))
    elif origin is tuple:
        kind = _of_tuple(parts, names)
    elif origin is dict:
        kind = f"table of {_kind(parts[1], [], names)}"
    elif isinstance(annotation, type) and issubclass(annotation, BaseModel):
        kind = f"table [{names[annotation]}](#{anchor(names[annotation])})"
    else:
        dimension = next((item for item in metadata if isinstance(item, Dimension)), None)
        kind = _PLAIN[annotation] if dimension is None else dimension.name
    limits = [said for item in metadata if (said := _limit(item))]
    return ", ".join((kind, *limits))


def _of_tuple(parts: tuple[Any, ...], names: dict[type[BaseModel], str]) -> str:
    if parts[-1] is Ellipsis:
        return f"list of {_kind(parts[0], [], names)}"
    kinds = list(dict.fromkeys(_kind(part, [], names) for part in parts))
    return f"list of {len(parts)}: {', '.join(kinds)}"


def _flat(metadata: tuple[Any, ...]) -> Iterator[Any]:
    for item in metadata:
        yield from item.metadata if isinstance(item, FieldInfo) else (item,)


def _limit(item: Any) -> str:
    if isinstance(item, AfterValidator):
        return _CHECKS.get(item.func, "")
    for kind, word in ((Gt, "above"), (Ge, "at least"), (Lt, "below"), (Le, "at most")):
        if isinstance(item, kind):
            return f"{word} {getattr(item, kind.__name__.lower()):.12g}"
    return "not empty" if isinstance(item, MinLen) else ""


def _default(field: FieldInfo) -> str:
    if field.is_required():
        return "required"
    value = field.get_default(call_default_factory=True)
    if value is None or value in ("", (), {}) or isinstance(value, BaseModel):
        return "its own defaults" if isinstance(value, BaseModel) else "none"
    dimensions = list(_dimensions(field.annotation, field.metadata))
    return f"`{_written(value, dimensions[0] if dimensions else None)}`"


def _dimensions(annotation: Any, metadata: Any) -> Iterator[Dimension]:
    yield from (item for item in metadata if isinstance(item, Dimension))
    for part in get_args(annotation):
        inner = get_args(part)[1:] if get_origin(part) is Annotated else ()
        yield from _dimensions(part, inner)


def _written(value: Any, dimension: Dimension | None) -> str:
    if isinstance(value, tuple):
        return f"[{', '.join(_written(one, dimension) for one in value)}]"
    if isinstance(value, bool):
        return str(value).lower()
    if dimension is None or isinstance(value, str):
        return f'"{value}"' if isinstance(value, str) else f"{value:g}"
    unit = "deg" if dimension is ANGLE else dimension.si
    return f'"{value / float(dimension.factors[unit]):.6g} {unit}"'
