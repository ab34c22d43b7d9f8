"""Syntax tree to closures. What may take time becomes a generator that yields once a cycle.

Only the built-ins that are handed in can be reached; nothing of Python can.
"""

import inspect
from collections.abc import Callable, Generator, Mapping, Sequence
from dataclasses import dataclass
from enum import Enum
from typing import Any, Final

from mocks.ur.urscript import syntax, values
from mocks.ur.urscript.errors import ScriptError
from mocks.ur.urscript.process import Frame, Steps

_MISSING: Final = object()


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

    now: Callable[[Frame], Any] | None = None
    steps: Callable[[Frame], Steps] | None = None


@dataclass(frozen=True)
class Compiled:
    """A program, ready to run.

    Attributes:
        name: empty for plain statements.
        main: its own statements.
        secondary: whether it runs beside the main program.
    """

    name: str
    main: Code
    secondary: bool

    def steps(self, frame: Frame) -> Steps:
        """Run it."""
        yield from _value(self.main, frame)


class _Function:
    """A ``def`` or ``thread``; its code is filled in after all functions are known."""

    def __init__(self, source: syntax.Function, takes_time: bool) -> None:
        self.source = source
        self.takes_time = takes_time
        self.names = [name for name, _ in source.parameters]
        self.code = Code()
        self.defaults: dict[str, Code] = {}


def compile_program(program: syntax.Program, builtins: Mapping[str, Builtin]) -> Compiled:
    """Closures of a program.

    Raises:
        ScriptError: a function that is not known, or called with other arguments than it takes.
    """
    return _Compiler(program, builtins).compiled()


class _Compiler:
    def __init__(self, program: syntax.Program, builtins: Mapping[str, Builtin]) -> None:
        self._program = program
        self._builtins = builtins
        slow = _slow_functions(program, builtins)
        self._functions = {
            name: _Function(function, name in slow) for name, function in program.functions.items()
        }

    def compiled(self) -> Compiled:
        """Everything."""
        for function in self._functions.values():
            function.code = self._block(function.source.body)
            for name, default in function.source.parameters:
                if default is not None:
                    function.defaults[name] = self._expression(default)
        return Compiled(self._program.name, self._block(self._program.body), self._program.secondary)

    # Statements

    def _block(self, block: syntax.Block) -> Code:
        parts = [self._statement(statement) for statement in block]
        quick = [part.now for part in parts if part.now is not None]
        if len(quick) == len(parts):
            return Code(now=lambda frame: _run_block(quick, frame))
        return Code(steps=lambda frame: _step_block(parts, frame))

    def _statement(self, statement: syntax.Statement) -> Code:
        match statement:
            case syntax.Assign(name, value, scope, _):
                store = _store_global if scope == "global" else _store_local if scope == "local" else _store
                return _combined(
                    lambda frame, result: store(frame, name, result), [self._expression(value)], frame=True
                )
            case syntax.SetItem(name, indices, value, line):
                return self._set_item(name, indices, value, line)
            case syntax.Evaluate(expression):
                return _combined(lambda _: None, [self._expression(expression)])
            case syntax.If(branches, otherwise):
                return self._if(branches, otherwise)
            case syntax.While(condition, body, line):
                return self._while(condition, body, line)
            case syntax.Return(value):
                returned = self._expression(value) if value is not None else Code(now=lambda _: None)
                return _combined(_return, [returned], frame=True)
            case syntax.Threading(word, thread):
                return self._threading(word, thread)
            case syntax.Word(word):
                return _word(word)

    def _set_item(
        self,
        name: str,
        indices: tuple[syntax.Expression, ...],
        value: syntax.Expression,
        line: int,
    ) -> Code:
        parts = [self._expression(value), *(self._expression(index) for index in indices)]

        def apply(frame: Frame, result: Any, *where: Any) -> None:
            values.set_item(_read(frame, name, line), where, result)

        return _combined(apply, parts, frame=True)

    def _if(
        self, branches: tuple[tuple[syntax.Expression, syntax.Block], ...], otherwise: syntax.Block
    ) -> Code:
        tried = [(self._expression(condition), self._block(block)) for condition, block in branches]
        last = self._block(otherwise)
        tests = [(condition.now, block.now) for condition, block in tried]
        quick = [(test, block) for test, block in tests if test is not None and block is not None]
        if len(quick) == len(tests) and last.now is not None:
            otherwise_now = last.now

            def now(frame: Frame) -> Any:
                for test, block in quick:
                    if values.truth(test(frame)):
                        return block(frame)
                return otherwise_now(frame)

            return Code(now=now)

        def steps(frame: Frame) -> Steps:
            for condition, block in tried:
                if values.truth((yield from _value(condition, frame))):
                    return (yield from _value(block, frame))
            return (yield from _value(last, frame))

        return Code(steps=steps)

    def _while(self, condition: syntax.Expression, body: syntax.Block, line: int) -> Code:
        test, block = self._expression(condition), self._block(body)

        def steps(frame: Frame) -> Steps:
            while values.truth((yield from _value(test, frame))):
                frame.task.spend(line)
                left = yield from _value(block, frame)
                if left is Leave.BREAK:
                    return None
                if left is Leave.RETURN:
                    return left
            return None

        if test.now is None or block.now is None:
            return Code(steps=steps)
        return Code(now=lambda frame: _exhaust(steps(frame)))

    def _threading(self, word: str, thread: syntax.Expression) -> Code:
        handle = self._expression(thread)
        if word == "kill":
            return _combined(lambda frame, number: frame.process.kill(number), [handle], frame=True)

        def steps(frame: Frame) -> Steps:
            number = yield from _value(handle, frame)
            while frame.process.alive(number):
                yield

        return Code(steps=steps)

    # Expressions

    def _expression(self, expression: syntax.Expression) -> Code:
        match expression:
            case syntax.Literal(value):
                return Code(now=lambda _: value)
            case syntax.Name(name, line):
                return Code(now=lambda frame: _read(frame, name, line))
            case syntax.Sequence(items, pose):
                make = values.make_pose if pose else values.make_list
                return _combined(make, [self._expression(item) for item in items])
            case syntax.Operation(symbol, operands, line):
                return self._operation(symbol, [self._expression(operand) for operand in operands], line)
            case syntax.Index(target, indices, line):
                parts = [self._expression(part) for part in (target, *indices)]
                return _combined(_located(values.item, line), parts)
            case syntax.Call():
                return self._call(expression)

    def _operation(self, symbol: str, operands: list[Code], line: int) -> Code:
        if symbol not in ("and", "or"):
            return _combined(_located(values.OPERATORS[symbol], line), operands)
        left, right = operands
        decided = symbol == "or"
        first, second = left.now, right.now
        if first is not None and second is not None:
            return Code(
                now=lambda frame: (
                    decided if values.truth(first(frame)) is decided else values.truth(second(frame))
                )
            )

        def steps(frame: Frame) -> Steps:
            if values.truth((yield from _value(left, frame))) is decided:
                return decided
            return values.truth((yield from _value(right, frame)))

        return Code(steps=steps)

    def _call(self, call: syntax.Call) -> Code:
        arguments = [self._expression(argument) for argument in call.arguments]
        arguments += [self._expression(argument) for _, argument in call.keywords]
        keywords = [name for name, _ in call.keywords]
        if call.name in self._functions:
            return self._user_call(self._functions[call.name], arguments, keywords, call)
        if call.name not in self._builtins or call.run:
            raise ScriptError(f"there is no {'thread' if call.run else 'function'} '{call.name}'", call.line)
        return _builtin_call(self._builtins[call.name], arguments, keywords, call)

    def _user_call(
        self, function: _Function, arguments: list[Code], keywords: list[str], call: syntax.Call
    ) -> Code:
        plain = len(arguments) - len(keywords)
        names = [*function.names[:plain], *keywords]
        required = {name for name, default in function.source.parameters if default is None}
        if (
            plain > len(function.names)
            or len(set(names)) < len(names)
            or not required <= set(names) <= set(function.names)
        ):
            raise ScriptError(f"'{call.name}' takes ({', '.join(function.names)})", call.line)
        if call.run:
            return _combined(
                lambda frame, *given: frame.process.start(
                    lambda task: _function_steps(function, frame.process.frame(task), names, given)
                ),
                arguments,
                frame=True,
            )
        if not function.takes_time:
            return _combined(
                lambda frame, *given: _function_now(function, frame, names, given, call.line),
                arguments,
                frame=True,
            )

        def steps(frame: Frame) -> Steps:
            frame.task.spend(call.line)
            given = []
            for argument in arguments:
                given.append((yield from _value(argument, frame)))
            inner = frame.process.frame(frame.task)
            return (yield from _function_steps(function, inner, names, given))

        return Code(steps=steps)


def _builtin_call(builtin: Builtin, arguments: list[Code], keywords: list[str], call: syntax.Call) -> Code:
    plain = len(arguments) - len(keywords)
    try:
        inspect.signature(builtin.function).bind(*[None] * plain, **dict.fromkeys(keywords))
    except TypeError as error:
        raise ScriptError(f"'{call.name}': {error}", call.line) from error

    def invoke(*given: Any) -> Any:
        return builtin.function(*given[:plain], **dict(zip(keywords, given[plain:], strict=True)))

    if not builtin.takes_time:
        return _combined(_located(builtin.function if not keywords else invoke, call.line), arguments)

    def steps(frame: Frame) -> Steps:
        given = []
        for argument in arguments:
            given.append((yield from _value(argument, frame)))
        try:
            return (yield from invoke(*given))
        except ScriptError as error:
            raise _at(error, call.line) from error

    return Code(steps=steps)


def _function_now(
    function: _Function, frame: Frame, names: list[str], given: Sequence[Any], line: int
) -> Any:
    frame.task.spend(line)
    inner = frame.process.frame(frame.task)
    _fill(function, inner, names, given)
    assert function.code.now is not None, "functions that take time are stepped"
    function.code.now(inner)
    return inner.result


def _function_steps(function: _Function, inner: Frame, names: list[str], given: Sequence[Any]) -> Steps:
    _fill(function, inner, names, given)
    yield from _value(function.code, inner)
    return inner.result


def _fill(function: _Function, inner: Frame, names: list[str], given: Sequence[Any]) -> None:
    for name, value in zip(names, given, strict=True):
        inner.variables[name] = values.copied(value)
    for name, default in function.defaults.items():
        if name not in inner.variables and default.now is not None:
            inner.variables[name] = default.now(inner)


def _combined(apply: Callable[..., Any], parts: list[Code], *, frame: bool = False) -> Code:
    """``apply`` to the parts' values; after the frame itself where ``frame``."""
    quick = [part.now for part in parts if part.now is not None]
    if len(quick) == len(parts):
        if frame:
            return Code(now=lambda here: apply(here, *[part(here) for part in quick]))
        if len(quick) == 2:
            first, second = quick
            return Code(now=lambda here: apply(first(here), second(here)))
        return Code(now=lambda here: apply(*[part(here) for part in quick]))

    def steps(here: Frame) -> Steps:
        given = [here] if frame else []
        for part in parts:
            given.append((yield from _value(part, here)))
        return apply(*given)

    return Code(steps=steps)


def _value(code: Code, frame: Frame) -> Steps:
    if code.now is not None:
        return code.now(frame)
    assert code.steps is not None, "code is one or the other"
    return (yield from code.steps(frame))


def _run_block(parts: list[Callable[[Frame], Any]], frame: Frame) -> Any:
    for part in parts:
        left = part(frame)
        if left is not None:
            return left
    return None


def _step_block(parts: list[Code], frame: Frame) -> Steps:
    for part in parts:
        left = part.now(frame) if part.now is not None else (yield from _value(part, frame))
        if left is not None:
            return left
    return None


def _exhaust(steps: Generator[None, None, Any]) -> Any:
    """The result of steps that never yield."""
    try:
        next(steps)
    except StopIteration as end:
        return end.value
    raise AssertionError("code without time yielded")


def _read(frame: Frame, name: str, line: int) -> Any:
    value = frame.variables.get(name, _MISSING)
    if value is _MISSING:
        value = frame.process.variables.get(name, _MISSING)
    if value is _MISSING:
        raise ScriptError(f"variable '{name}' has no value yet", line)
    return value


def _store(frame: Frame, name: str, value: Any) -> None:
    """Into a global of that name where there is one and no local."""
    if name not in frame.variables and name in frame.process.variables:
        frame.process.variables[name] = values.copied(value)
    else:
        frame.variables[name] = values.copied(value)


def _store_global(frame: Frame, name: str, value: Any) -> None:
    frame.process.variables[name] = values.copied(value)


def _store_local(frame: Frame, name: str, value: Any) -> None:
    frame.variables[name] = values.copied(value)


def _return(frame: Frame, value: Any) -> Leave:
    frame.result = value
    return Leave.RETURN


def _word(word: str) -> Code:
    if word in ("break", "continue"):
        leave = Leave(word)
        return Code(now=lambda _: leave)
    if word == "halt":
        return Code(now=lambda frame: frame.process.halt())
    if word == "pass":
        return Code(now=lambda _: None)
    return Code(now=lambda frame: frame.process.hold(frame.task if word == "enter_critical" else None))


def _located(apply: Callable[..., Any], line: int) -> Callable[..., Any]:
    """The same, its errors told with the line."""

    def located(*given: Any) -> Any:
        try:
            return apply(*given)
        except ScriptError as error:
            raise _at(error, line) from error

    return located


def _at(error: ScriptError, line: int) -> ScriptError:
    return error if error.line else ScriptError(str(error), line)


def _slow_functions(program: syntax.Program, builtins: Mapping[str, Builtin]) -> set[str]:
    """The functions that may take time: they call what does, or join a thread."""
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
