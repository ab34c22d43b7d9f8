"""Parse product code into names, docstrings and texts that a user can see, each with its place."""

import ast
import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final, TypeAlias

PRODUCT: Final = ("calibration", "drivers", "experiments", "harness", "mocks", "touchstone")
PAGES: Final = ("*.md", "docs/**/*.md", "examples/*", "harness/**/*.toml")

Function: TypeAlias = ast.FunctionDef | ast.AsyncFunctionDef
Documented: TypeAlias = Function | ast.ClassDef | ast.Module


@dataclass(frozen=True)
class Text:
    """A name, docstring, message or line of a page."""

    place: str  #: path and line, as ``harness/api.py:12``.
    package: str  #: package of a module, as ``harness/sim``; top folder of a page.
    text: str


@dataclass
class Sources:
    """All texts of a checkout, by kind."""

    names: list[Text] = field(default_factory=list)
    """Identifiers that a module defines, each once: functions, classes, arguments, variables, fields."""
    functions: list[Text] = field(default_factory=list)  #: names of functions; properties are not among them.
    docstrings: list[Text] = field(default_factory=list)  #: of modules, classes and functions.
    fields: list[Text] = field(default_factory=list)  #: documentation of constants and fields.
    messages: list[Text] = field(
        default_factory=list
    )  #: strings with more than one word: messages, help, titles.
    pages: list[Text] = field(default_factory=list)  #: lines of pages, examples and shipped configuration.


def read_sources(root: Path) -> Sources:
    """Read all product modules and pages under a checkout's root."""
    sources = Sources()
    for top in PRODUCT:
        for path in sorted((root / top).rglob("*.py")):
            _add_module(sources, path.read_text(encoding="utf-8"), path.relative_to(root).as_posix())
    for path in sorted({path for pattern in PAGES for path in root.glob(pattern) if path.is_file()}):
        inside = path.relative_to(root).as_posix()
        for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), 1):
            if line.strip():
                sources.pages.append(Text(f"{inside}:{number}", inside.partition("/")[0], line))
    return sources


def package_of(path: str) -> str:
    """Package that a module's counts belong to: two folders deep in ``harness`` and ``experiments``."""
    parts = path.split("/")
    return "/".join(parts[:2]) if parts[0] in ("harness", "experiments") and len(parts) > 2 else parts[0]


def _add_module(sources: Sources, source: str, path: str) -> None:
    package, tree = package_of(path), ast.parse(source)

    def text(line: int, content: str) -> Text:
        return Text(f"{path}:{line}", package, content)

    documentation = set[int]()
    for node in ast.walk(tree):
        if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef):
            for kind, constant in _documentation(node):
                documentation.add(id(constant))
                (sources.docstrings if kind == "docstring" else sources.fields).append(
                    text(constant.lineno, str(constant.value).strip())
                )
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef) and _is_named_freely(node):
            sources.functions.append(text(node.lineno, node.name))
    for number, content in enumerate(source.splitlines(), 1):
        comment = re.search(r"#: (.+)", content)
        if comment:
            sources.fields.append(text(number, comment[1]))
    named = dict[str, int]()
    for line, name in _defined(tree):
        named.setdefault(name, line)
    named.setdefault(Path(path).stem, 1)
    sources.names += [text(first, name) for name, first in named.items()]
    for node, content in _strings(tree, documentation):
        if re.search(r"[A-Za-z]{2,}[^A-Za-z]* [^A-Za-z]*[a-z]{2,}", content):
            sources.messages.append(text(node.lineno, content))


def _documentation(node: Documented) -> Iterator[tuple[str, ast.Constant]]:
    for index, statement in enumerate(node.body):
        value = statement.value if isinstance(statement, ast.Expr) else None
        if isinstance(value, ast.Constant) and isinstance(value.value, str):
            yield ("docstring" if index == 0 else "field"), value


def _is_named_freely(node: Function) -> bool:
    """Tell functions from properties, which are named as attributes, and from methods that Python names."""
    decorators = {part for d in node.decorator_list for part in ast.unparse(d).split(".")}
    return not node.name.startswith("__") and not decorators & {"property", "cached_property", "setter"}


def _defined(tree: ast.Module) -> Iterator[tuple[int, str]]:
    for node in ast.walk(tree):
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef):
            if not node.name.startswith("__"):
                yield node.lineno, node.name
        elif isinstance(node, ast.arg):
            yield node.lineno, node.arg
        elif isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store):
            yield node.lineno, node.id
        elif isinstance(node, ast.Attribute) and isinstance(node.ctx, ast.Store):
            yield node.lineno, node.attr


def _strings(tree: ast.Module, documentation: set[int]) -> Iterator[tuple[ast.expr, str]]:
    seen = set(documentation)
    for node in ast.walk(tree):
        if isinstance(node, ast.JoinedStr):
            parts = [part.value if isinstance(part, ast.Constant) else "{}" for part in node.values]
            seen |= {id(part) for part in node.values}
            yield node, "".join(str(part) for part in parts)
        elif isinstance(node, ast.Constant) and isinstance(node.value, str) and id(node) not in seen:
            yield node, node.value
