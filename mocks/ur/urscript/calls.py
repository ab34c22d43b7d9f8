"""Calls: of a program's own functions, each with variables of its own, and of the controller's."""

import inspect
from collections.abc import Sequence
from typing import Any

from mocks.ur.urscript import syntax, values
from mocks.ur.urscript.code import Builtin, Code, at_line, combined, located, value_of
from mocks.ur.urscript.errors import ScriptError
from mocks.ur.urscript.process import CallFrame, Steps


class Function:
    """A ``def`` or ``thread``; its code is filled in after all functions are known.

    Attributes:
        source: as written.
        takes_time: whether a call may yield cycles.
        names: of the parameters.
        code: of the body.
        defaults: of the parameters that have one.
    """

    def __init__(self, source: syntax.FunctionDefinition, takes_time: bool) -> None:
        self.source = source
        self.takes_time = takes_time
        self.names = [name for name, _ in source.parameters]
        self.code = Code()
        self.defaults: dict[str, Code] = {}


def builtin_call(builtin: Builtin, arguments: list[Code], keywords: list[str], call: syntax.Call) -> Code:
    """A call of the controller; ``ScriptError`` where it takes other arguments."""
    plain = len(arguments) - len(keywords)
    try:
        inspect.signature(builtin.function).bind(*[None] * plain, **dict.fromkeys(keywords))
    except TypeError as error:
        raise ScriptError(f"'{call.name}': {error}", call.line) from error

    def invoke(*given: Any) -> Any:
        return builtin.function(*given[:plain], **dict(zip(keywords, given[plain:], strict=True)))

    if not builtin.takes_time:
        return combined(located(builtin.function if not keywords else invoke, call.line), arguments)

    def steps(frame: CallFrame) -> Steps:
        given = []
        for argument in arguments:
            given.append((yield from value_of(argument, frame)))
        try:
            return (yield from invoke(*given))
        except ScriptError as error:
            raise at_line(error, call.line) from error

    return Code(steps=steps)


def call_now(function: Function, frame: CallFrame, names: list[str], given: Sequence[Any], line: int) -> Any:
    """The result of a function that takes no time."""
    frame.task.spend(line)
    inner = frame.process.frame(frame.task)
    _fill(function, inner, names, given)
    assert function.code.now is not None, "functions that take time are stepped"
    function.code.now(inner)
    return inner.result


def call_steps(function: Function, inner: CallFrame, names: list[str], given: Sequence[Any]) -> Steps:
    """The result of a function, in a frame that is still empty."""
    _fill(function, inner, names, given)
    yield from value_of(function.code, inner)
    return inner.result


def _fill(function: Function, inner: CallFrame, names: list[str], given: Sequence[Any]) -> None:
    for name, value in zip(names, given, strict=True):
        inner.variables[name] = values.copied(value)
    for name, default in function.defaults.items():
        if name not in inner.variables and default.now is not None:
            inner.variables[name] = default.now(inner)
