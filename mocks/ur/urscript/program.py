"""URScript to Python, by recursive descent: every word that is not of the grammar is an error.

Each function becomes a Python generator that yields once a cycle and works on a ``CallFrame``. A
program's names stay strings in it, so nothing of Python can be reached but the built-ins that are
handed in; its line numbers are the text's, for what is told of an error.
"""

import ast
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Final

from mocks.ur.urscript import nodes, values
from mocks.ur.urscript.errors import PROGRAM, ScriptError
from mocks.ur.urscript.expressions import Expressions
from mocks.ur.urscript.process import CallFrame, Steps
from mocks.ur.urscript.tokens import Token, Tokens

_BLOCK_ENDS: Final = frozenset(("end", "elif", "else"))
_MAIN: Final = "the program itself"
_HELPERS: Final = {"truth": values.truth, "item": values.item, "pose": values.make_pose}


@dataclass(frozen=True)
class Program:
    """A text, ready to run.

    Attributes:
        name: empty for plain statements.
        main: steps of its own statements.
        secondary: whether it runs beside the main program.
    """

    name: str
    main: Callable[[CallFrame], Steps]
    secondary: bool


def translate(text: str, builtins: Mapping[str, Callable[..., Any]]) -> Program:
    """The program of a text: ``def name(): ... end``, ``sec name(): ... end``, or plain statements.

    Args:
        text: URScript.
        builtins: what it may call; those that take time are generator functions.

    Raises:
        ScriptError: it is not URScript, or not of the part that is understood here; a function that
            is not known, or called with other arguments than it takes.
    """
    try:
        return _Translator(Tokens(text), builtins).program()
    except RecursionError as error:
        raise ScriptError("nested too deeply") from error
    except SyntaxError as error:
        raise ScriptError(error.msg, error.lineno or 0) from error


class _Translator:
    def __init__(self, words: Tokens, builtins: Mapping[str, Callable[..., Any]]) -> None:
        self._words = words
        self._builtins = builtins
        self._expressions = Expressions(words, builtins)
        self._parameters: dict[str, dict[str, bool]] = {}
        self._functions: list[ast.stmt] = []

    def program(self) -> Program:
        """The whole text."""
        opener = self._words.next.text
        if opener in ("def", "sec"):
            name = self._heading()[0]
            body = self._block()
            self._words.take("end")
        else:
            opener, name, body = "", "", self._block()
        if self._words.next.kind != "end of text":
            raise self._words.unexpected("the end of the text")
        self._expressions.complete(self._parameters)
        self._define(_MAIN, body)
        module = ast.fix_missing_locations(ast.Module(self._functions, []))
        reached: dict[str, Any] = {"__builtins__": {}, **_HELPERS, **values.OPERATORS}
        reached |= {nodes.builtin(name): function for name, function in self._builtins.items()}
        exec(compile(module, PROGRAM, "exec"), reached)  # noqa: S102 - see the module's docstring
        return Program(name, reached[_MAIN], secondary=opener == "sec")

    # Functions

    def _heading(self) -> tuple[str, dict[str, ast.expr | None]]:
        """``def name(parameter, parameter=default):``."""
        self._words.take_any()
        name = self._words.name()
        self._words.take("(")
        parameters: dict[str, ast.expr | None] = {}
        while not self._words.accept(")"):
            parameter = self._words.name()
            parameters[parameter] = self._expressions.value() if self._words.accept("=") else None
            if not self._words.accept(","):
                self._words.take(")")
                break
        self._words.take(":")
        return name, parameters

    def _function(self) -> None:
        line = self._words.next.line
        name, parameters = self._heading()
        self._parameters[name] = {parameter: default is None for parameter, default in parameters.items()}
        defaults = [
            ast.Expr(nodes.of_frame("default", line, ast.Constant(parameter), value))
            for parameter, value in parameters.items()
            if value is not None
        ]
        body = self._block()
        self._words.take("end")
        self._define(nodes.function(name), [*defaults, *body])

    def _define(self, name: str, body: list[ast.stmt]) -> None:
        """A generator, whether or not anything in it yields."""
        parameters = ast.arguments([], [ast.arg("frame")], kwonlyargs=[], kw_defaults=[], defaults=[])
        generator: list[ast.stmt] = [*body, ast.Return(), ast.Expr(ast.Yield())]
        self._functions.append(ast.FunctionDef(name, parameters, generator, []))

    # Statements

    def _block(self) -> list[ast.stmt]:
        found: list[ast.stmt] = []
        while self._words.next.text not in _BLOCK_ENDS and self._words.next.kind != "end of text":
            if self._words.comes("def", "thread"):
                self._function()
            else:
                found.append(self._statement())
        return found or [ast.Pass()]

    def _statement(self) -> ast.stmt:
        word = self._words.take_any()
        if word.kind == "keyword":
            return self._keyword_statement(word)
        if word.kind == "word" and self._words.comes("("):
            return ast.Expr(self._expressions.call(word))
        if word.kind == "word" and self._words.accept("="):
            return self._store("store", word.text, word.line)
        if word.kind == "word" and self._words.accept("["):
            indices = self._expressions.items()
            self._words.take("=")
            place = (ast.Constant(word.text), self._expressions.value(), *indices)
            return ast.Expr(nodes.of_frame("set_item", word.line, *place))
        raise ScriptError(f"'{word.text}' stands alone; a statement does something", word.line)

    def _keyword_statement(self, word: Token) -> ast.stmt:
        match word.text:
            case "if":
                return self._if()
            case "while":
                condition = self._condition()
                body = [ast.Expr(nodes.of_frame("spend", word.line)), *self._block()]
                self._words.take("end")
                return ast.While(condition, body, [])
            case "return":
                ends = self._words.next.text in _BLOCK_ENDS
                return ast.Return(None if ends else self._expressions.value())
            case "global" | "local":
                name = self._words.name()
                self._words.take("=")
                return self._store(f"store_{word.text}", name, word.line)
            case "run":
                return ast.Expr(self._expressions.run(word))
            case "join":
                return ast.Expr(nodes.steps(nodes.of_frame("join", word.line, self._expressions.value())))
            case "kill":
                return ast.Expr(nodes.of_frame("kill", word.line, self._expressions.value()))
            case "halt" | "enter_critical" | "exit_critical":
                return ast.Expr(nodes.of_frame(word.text, word.line))
            case "break":
                return nodes.placed(ast.Break(), word.line)
            case "continue":
                return nodes.placed(ast.Continue(), word.line)
            case "pass":
                return ast.Pass()
        self._words.at -= 1
        raise self._words.unexpected("a statement")

    def _store(self, method: str, name: str, line: int) -> ast.stmt:
        return ast.Expr(nodes.of_frame(method, line, ast.Constant(name), self._expressions.value()))

    def _if(self) -> ast.If:
        """From the condition of an ``if`` or ``elif`` to the ``end``."""
        condition, body = self._condition(), self._block()
        otherwise: list[ast.stmt] = []
        if self._words.accept("elif"):
            return ast.If(condition, body, [self._if()])
        if self._words.accept("else"):
            self._words.accept(":")
            otherwise = self._block()
        self._words.take("end")
        return ast.If(condition, body, otherwise)

    def _condition(self) -> ast.expr:
        line = self._words.next.line
        condition = nodes.call("truth", line, self._expressions.value())
        self._words.accept(":")
        return condition
