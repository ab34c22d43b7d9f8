"""Signatures of ``harness.experiment`` are typed."""

import ast
from collections.abc import Iterator
from pathlib import Path

import harness.experiment

FOLDER = Path(harness.experiment.__file__).parent


def annotations(tree: ast.Module) -> Iterator[ast.expr]:
    """Yield the annotations of arguments, results and fields."""
    for node in ast.walk(tree):
        if isinstance(node, ast.FunctionDef):
            arguments = (*node.args.posonlyargs, *node.args.args, *node.args.kwonlyargs)
            stated = [one.annotation for one in (*arguments, node.args.vararg, node.args.kwarg) if one]
            yield from (one for one in (*stated, node.returns) if one is not None)
        if isinstance(node, ast.ClassDef):
            yield from (one.annotation for one in node.body if isinstance(one, ast.AnnAssign))


def test_no_signature_of_an_experiment_takes_or_gives_anything() -> None:
    loose = [
        f"{path.name}:{one.lineno}"
        for path in sorted(FOLDER.glob("*.py"))
        for one in annotations(ast.parse(path.read_text(encoding="utf-8")))
        if any(isinstance(name, ast.Name) and name.id == "Any" for name in ast.walk(one))
    ]
    assert loose == []
