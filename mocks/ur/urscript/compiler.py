"""Syntax tree to closures. What may take time becomes a generator that yields once a cycle.

Only the built-ins that are handed in can be reached; nothing of Python can.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from mocks.ur.urscript import syntax, values, variables
from mocks.ur.urscript.calls import Function, builtin_call, call_now, call_steps
from mocks.ur.urscript.code import (
    Builtin,
    Code,
    Leave,
    combined,
    exhaust,
    located,
    run_block,
    step_block,
    value_of,
)
from mocks.ur.urscript.errors import ScriptError
from mocks.ur.urscript.process import CallFrame, Steps
from mocks.ur.urscript.timing import slow_functions


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

    def steps(self, frame: CallFrame) -> Steps:
        """Run it."""
        yield from value_of(self.main, frame)


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
        slow = slow_functions(program, builtins)
        self._functions = {
            name: Function(function, name in slow) for name, function in program.functions.items()
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
            return Code(now=lambda frame: run_block(quick, frame))
        return Code(steps=lambda frame: step_block(parts, frame))

    def _statement(self, statement: syntax.Statement) -> Code:
        match statement:
            case syntax.Assign(name, value, scope, _):
                store = (
                    variables.store_global
                    if scope == "global"
                    else variables.store_local
                    if scope == "local"
                    else variables.store
                )
                return combined(
                    lambda frame, result: store(frame, name, result), [self._expression(value)], frame=True
                )
            case syntax.SetItem(name, indices, value, line):
                return self._set_item(name, indices, value, line)
            case syntax.Evaluate(expression):
                return combined(lambda _: None, [self._expression(expression)])
            case syntax.If(branches, otherwise):
                return self._if(branches, otherwise)
            case syntax.While(condition, body, line):
                return self._while(condition, body, line)
            case syntax.Return(value):
                returned = self._expression(value) if value is not None else Code(now=lambda _: None)
                return combined(variables.set_result, [returned], frame=True)
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

        def apply(frame: CallFrame, result: Any, *where: Any) -> None:
            values.set_item(variables.read(frame, name, line), where, result)

        return combined(apply, parts, frame=True)

    def _if(
        self, branches: tuple[tuple[syntax.Expression, syntax.Block], ...], otherwise: syntax.Block
    ) -> Code:
        tried = [(self._expression(condition), self._block(block)) for condition, block in branches]
        last = self._block(otherwise)
        tests = [(condition.now, block.now) for condition, block in tried]
        quick = [(test, block) for test, block in tests if test is not None and block is not None]
        if len(quick) == len(tests) and last.now is not None:
            otherwise_now = last.now

            def now(frame: CallFrame) -> Any:
                for test, block in quick:
                    if values.truth(test(frame)):
                        return block(frame)
                return otherwise_now(frame)

            return Code(now=now)

        def steps(frame: CallFrame) -> Steps:
            for condition, block in tried:
                if values.truth((yield from value_of(condition, frame))):
                    return (yield from value_of(block, frame))
            return (yield from value_of(last, frame))

        return Code(steps=steps)

    def _while(self, condition: syntax.Expression, body: syntax.Block, line: int) -> Code:
        test, block = self._expression(condition), self._block(body)

        def steps(frame: CallFrame) -> Steps:
            while values.truth((yield from value_of(test, frame))):
                frame.task.spend(line)
                left = yield from value_of(block, frame)
                if left is Leave.BREAK:
                    return None
                if left is Leave.RETURN:
                    return left
            return None

        if test.now is None or block.now is None:
            return Code(steps=steps)
        return Code(now=lambda frame: exhaust(steps(frame)))

    def _threading(self, word: str, thread: syntax.Expression) -> Code:
        handle = self._expression(thread)
        if word == "kill":
            return combined(lambda frame, number: frame.process.kill(number), [handle], frame=True)

        def steps(frame: CallFrame) -> Steps:
            number = yield from value_of(handle, frame)
            while frame.process.alive(number):
                yield

        return Code(steps=steps)

    # Expressions

    def _expression(self, expression: syntax.Expression) -> Code:
        match expression:
            case syntax.Literal(value):
                return Code(now=lambda _: value)
            case syntax.Name(name, line):
                return Code(now=lambda frame: variables.read(frame, name, line))
            case syntax.Sequence(items, pose):
                make = values.make_pose if pose else values.make_list
                return combined(make, [self._expression(item) for item in items])
            case syntax.Operation(symbol, operands, line):
                return self._operation(symbol, [self._expression(operand) for operand in operands], line)
            case syntax.Index(target, indices, line):
                parts = [self._expression(part) for part in (target, *indices)]
                return combined(located(values.item, line), parts)
            case syntax.Call():
                return self._call(expression)

    def _operation(self, symbol: str, operands: list[Code], line: int) -> Code:
        if symbol not in ("and", "or"):
            return combined(located(values.OPERATORS[symbol], line), operands)
        left, right = operands
        decided = symbol == "or"
        first, second = left.now, right.now
        if first is not None and second is not None:
            return Code(
                now=lambda frame: (
                    decided if values.truth(first(frame)) is decided else values.truth(second(frame))
                )
            )

        def steps(frame: CallFrame) -> Steps:
            if values.truth((yield from value_of(left, frame))) is decided:
                return decided
            return values.truth((yield from value_of(right, frame)))

        return Code(steps=steps)

    def _call(self, call: syntax.Call) -> Code:
        arguments = [self._expression(argument) for argument in call.arguments]
        arguments += [self._expression(argument) for _, argument in call.keywords]
        keywords = [name for name, _ in call.keywords]
        if call.name in self._functions:
            return self._user_call(self._functions[call.name], arguments, keywords, call)
        if call.name not in self._builtins or call.run:
            raise ScriptError(f"there is no {'thread' if call.run else 'function'} '{call.name}'", call.line)
        return builtin_call(self._builtins[call.name], arguments, keywords, call)

    def _user_call(
        self, function: Function, arguments: list[Code], keywords: list[str], call: syntax.Call
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
            return combined(
                lambda frame, *given: frame.process.start(
                    lambda task: call_steps(function, frame.process.frame(task), names, given)
                ),
                arguments,
                frame=True,
            )
        if not function.takes_time:
            return combined(
                lambda frame, *given: call_now(function, frame, names, given, call.line),
                arguments,
                frame=True,
            )

        def steps(frame: CallFrame) -> Steps:
            frame.task.spend(call.line)
            given = []
            for argument in arguments:
                given.append((yield from value_of(argument, frame)))
            inner = frame.process.frame(frame.task)
            return (yield from call_steps(function, inner, names, given))

        return Code(steps=steps)


def _word(word: str) -> Code:
    if word in ("break", "continue"):
        leave = Leave(word)
        return Code(now=lambda _: leave)
    if word == "halt":
        return Code(now=lambda frame: frame.process.halt())
    if word == "pass":
        return Code(now=lambda _: None)
    return Code(now=lambda frame: frame.process.hold(frame.task if word == "enter_critical" else None))
