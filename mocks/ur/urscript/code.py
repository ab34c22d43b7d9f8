"""What a program is made of once translated: closures for now, generators for what takes time."""

from collections.abc import Callable, Generator
from dataclasses import dataclass
from enum import Enum
from typing import Any

from mocks.ur.urscript.errors import ScriptError
from mocks.ur.urscript.process import CallFrame, Steps


class Leave(Enum):
    """How a block is left before its end."""

    BREAK = "break"
    CONTINUE = "continue"
    RETURN = "return"


@dataclass(frozen=True)
class Builtin:
    """A function of the controller.

    Attributes:
        function: takes the call's arguments; a generator function where ``takes_time``.
        takes_time: whether it may yield cycles before its result.
    """

    function: Callable[..., Any]
    takes_time: bool = False


@dataclass(frozen=True)
class Code:
    """An expression or statement: ``now`` where it takes no time, ``steps`` where it may."""

    now: Callable[[CallFrame], Any] | None = None
    steps: Callable[[CallFrame], Steps] | None = None


def combined(apply: Callable[..., Any], parts: list[Code], *, frame: bool = False) -> Code:
    """``apply`` to the parts' values; after the frame itself where ``frame``."""
    quick = [part.now for part in parts if part.now is not None]
    if len(quick) == len(parts):
        if frame:
            return Code(now=lambda here: apply(here, *[part(here) for part in quick]))
        if len(quick) == 2:
            first, second = quick
            return Code(now=lambda here: apply(first(here), second(here)))
        return Code(now=lambda here: apply(*[part(here) for part in quick]))

    def steps(here: CallFrame) -> Steps:
        given = [here] if frame else []
        for part in parts:
            given.append((yield from value_of(part, here)))
        return apply(*given)

    return Code(steps=steps)


def value_of(code: Code, frame: CallFrame) -> Steps:
    """The result, after as many cycles as it takes."""
    if code.now is not None:
        return code.now(frame)
    assert code.steps is not None, "code is one or the other"
    return (yield from code.steps(frame))


def run_block(parts: list[Callable[[CallFrame], Any]], frame: CallFrame) -> Any:
    """All parts in order; how the block was left, None at its end."""
    for part in parts:
        left = part(frame)
        if left is not None:
            return left
    return None


def step_block(parts: list[Code], frame: CallFrame) -> Steps:
    """The same where some parts take time."""
    for part in parts:
        left = part.now(frame) if part.now is not None else (yield from value_of(part, frame))
        if left is not None:
            return left
    return None


def exhaust(steps: Generator[None, None, Any]) -> Any:
    """The result of steps that never yield."""
    try:
        next(steps)
    except StopIteration as end:
        return end.value
    raise AssertionError("code without time yielded")


def located(apply: Callable[..., Any], line: int) -> Callable[..., Any]:
    """The same, its errors told with the line."""

    def located(*given: Any) -> Any:
        try:
            return apply(*given)
        except ScriptError as error:
            raise at_line(error, line) from error

    return located


def at_line(error: ScriptError, line: int) -> ScriptError:
    """The error, told with a line unless it has one."""
    return error if error.line else ScriptError(str(error), line)
