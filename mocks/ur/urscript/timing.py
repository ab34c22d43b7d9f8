"""Which functions of a program may take time: those that reach a built-in that does, or join a thread."""

from collections.abc import Mapping
from typing import Any

from mocks.ur.urscript import syntax
from mocks.ur.urscript.code import Builtin


def slow_functions(program: syntax.Program, builtins: Mapping[str, Builtin]) -> set[str]:
    """Their names, with those of the built-ins themselves."""
    calls = {name: _called(function.body) for name, function in program.functions.items()}
    slow = {name for name, builtin in builtins.items() if builtin.takes_time} | {"join"}
    while True:
        more = {name for name, called in calls.items() if called & slow} - slow
        if not more:
            return slow
        slow |= more


def _called(node: Any) -> set[str]:
    """Names of all functions called anywhere below, and ``join`` where it is used."""
    if isinstance(node, tuple):
        return set().union(*(_called(part) for part in node)) if node else set()
    found: set[str] = set()
    match node:
        case syntax.Call(name, arguments, keywords, _, run):
            found = _called(arguments) | _called(tuple(argument for _, argument in keywords))
            return found if run else found | {name}
        case syntax.Threading("join", _):
            return {"join"}
        case syntax.Assign(_, value, _, _) | syntax.Return(value) | syntax.Evaluate(value):
            return _called(value)
        case syntax.SetItem(_, indices, value, _):
            return _called(indices) | _called(value)
        case syntax.If(branches, otherwise):
            return _called(branches) | _called(otherwise)
        case syntax.While(condition, body, _):
            return _called(condition) | _called(body)
        case syntax.Sequence(items, _):
            return _called(items)
        case syntax.Operation(_, operands, _):
            return _called(operands)
        case syntax.Index(target, indices, _):
            return _called(target) | _called(indices)
    return found
