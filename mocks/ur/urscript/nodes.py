"""Nodes of Python's syntax tree, each with its line of the program's text."""

import ast
from typing import TypeVar

_Node = TypeVar("_Node", ast.Call, ast.YieldFrom, ast.Break, ast.Continue)


def function(name: str) -> str:
    """What a function of the program is called in Python."""
    return f"function {name}"


def builtin(name: str) -> str:
    """What a function of the controller is called in Python."""
    return f"built-in {name}"


def call(name: str, line: int, *given: ast.expr) -> ast.Call:
    """``name(given)``."""
    return placed(ast.Call(ast.Name(name, ast.Load()), list(given), []), line)


def of_frame(method: str, line: int, *given: ast.expr) -> ast.Call:
    """A call of a method of the ``CallFrame``."""
    attribute = ast.Attribute(ast.Name("frame", ast.Load()), method, ast.Load())
    return placed(ast.Call(attribute, list(given), []), line)


def steps(call: ast.Call) -> ast.YieldFrom:
    """The result of a call that may take time."""
    return placed(ast.YieldFrom(call), call.lineno)


def placed(node: _Node, line: int) -> _Node:
    """The node, on a line."""
    node.lineno = node.end_lineno = line
    node.col_offset = node.end_col_offset = 0
    return node
