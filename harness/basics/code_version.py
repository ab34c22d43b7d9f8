"""Which code a number depends on: a module and all that it imports of ours, hashed."""

import ast
import hashlib
import importlib.util
from collections.abc import Iterator
from functools import cache
from pathlib import Path

OURS = ("harness", "drivers", "mocks", "experiments", "calibration")

_STATEMENTS = (ast.stmt, ast.ExceptHandler, ast.match_case)


def content_hash(module: str) -> str:
    """Of the source of a module and of every module of ours that it imports, at any depth.

    Imports are read from the source, so those inside functions count, and nothing is run.
    """
    state = hashlib.sha256()
    for name in sorted(closure(module)):
        state.update(name.encode() + b"\0" + _source(name) + b"\0")
    return state.hexdigest()


def closure(module: str) -> frozenset[str]:
    """Names of a module and of every module of ours that it imports, at any depth."""
    found: set[str] = set()
    waiting = [module]
    while waiting:
        name = waiting.pop()
        if name not in found:
            found.add(name)
            waiting.extend(_imported(name))
    return frozenset(found)


@cache
def _imported(module: str) -> frozenset[str]:
    names: set[str] = set()
    waiting: list[ast.AST] = [ast.parse(_source(module))]
    while waiting:
        node = waiting.pop()
        names.update(_named(node))
        # Only statements hold imports; expressions are most of the nodes.
        waiting.extend(child for child in ast.iter_child_nodes(node) if isinstance(child, _STATEMENTS))
    return frozenset(name for name in names if name.split(".")[0] in OURS)


def _named(node: ast.AST) -> Iterator[str]:
    if isinstance(node, ast.Import):
        yield from (alias.name for alias in node.names)
    elif isinstance(node, ast.ImportFrom) and node.module is not None and node.level == 0:
        yield node.module
        # ``from package import module`` names a module only by its last part.
        for alias in node.names:
            inner = f"{node.module}.{alias.name}"
            if node.module.split(".")[0] in OURS and _path(inner) is not None:
                yield inner


@cache
def _path(module: str) -> Path | None:
    top, *rest = module.split(".")
    spec = importlib.util.find_spec(top)
    if spec is None or spec.submodule_search_locations is None:
        return None
    base = Path(next(iter(spec.submodule_search_locations))).joinpath(*rest)
    candidates = (base.with_suffix(".py"), base / "__init__.py")
    return next((path for path in candidates if path.is_file()), None)


def _source(module: str) -> bytes:
    path = _path(module)
    if path is None:
        raise ModuleNotFoundError(f"no source of {module} is installed")
    return path.read_bytes()
