"""URScript's expressions, to Python's."""

import ast
import inspect
import itertools
from collections.abc import Callable, Mapping
from typing import Any, Final

from mocks.ur.urscript import nodes
from mocks.ur.urscript.errors import ScriptError
from mocks.ur.urscript.tokens import Token, Tokens

_LEVELS: Final = (
    ("or", "xor"),
    ("and",),
    ("==", "!=", "<", ">", "<=", ">="),
    ("+", "-"),
    ("*", "/", "%"),
)
_POSE_LENGTH: Final = 6


class Expressions:
    """Reads expressions, which may call functions that are defined only later in the text.

    Args:
        words: of the program.
        builtins: what it may call; those that take time are generator functions.
    """

    def __init__(self, words: Tokens, builtins: Mapping[str, Callable[..., Any]]) -> None:
        self._words = words
        self._builtins = builtins
        own = words.words[1:]  # the first word opens the program, which cannot be called
        self._own = {name.text for word, name in itertools.pairwise(own) if word.text in ("def", "thread")}
        self._calls: list[tuple[ast.Tuple, Token, int, list[str]]] = []

    def complete(self, functions: Mapping[str, Mapping[str, bool]]) -> None:
        """Name the arguments of all calls of the program's own functions.

        Args:
            functions: of each, its parameters, and whether a call must give them.

        Raises:
            ScriptError: a call that gives others.
        """
        for given, word, plain, keywords in self._calls:
            parameters = functions[word.text]
            names = [*list(parameters)[:plain], *keywords]
            required = {name for name, needed in parameters.items() if needed}
            if (
                plain > len(parameters)
                or len(set(names)) < len(names)
                or not required <= set(names) <= set(parameters)
            ):
                raise ScriptError(f"'{word.text}' takes ({', '.join(parameters)})", word.line)
            given.elts = [ast.Constant(name) for name in names]

    def value(self, level: int = 0) -> ast.expr:
        """The expression that comes next, of operators that bind at least as tightly as a level."""
        if level == len(_LEVELS):
            return self._unary()
        left = self.value(level + 1)
        while self._words.comes(*_LEVELS[level]):
            word = self._words.take_any()
            right = self.value(level + 1)
            if word.text in ("and", "or"):
                operator = ast.And() if word.text == "and" else ast.Or()
                left = ast.BoolOp(operator, [nodes.call("truth", word.line, side) for side in (left, right)])
            else:
                left = nodes.call(word.text, word.line, left, right)
        return left

    def _unary(self) -> ast.expr:
        word = self._words.next
        if self._words.accept("not"):
            return nodes.call("not", word.line, self.value(2))
        if self._words.accept("-"):
            return nodes.call("negative", word.line, self._unary())
        if self._words.accept("+"):
            return nodes.call("positive", word.line, self._unary())
        found = self._primary()
        while self._words.comes("["):
            line = self._words.take_any().line
            found = nodes.call("item", line, found, *self.items())
        return found

    def _primary(self) -> ast.expr:
        word = self._words.take_any()
        if word.kind == "number":
            return ast.Constant(int(word.text) if word.text.isdigit() else float(word.text))
        if word.kind == "string":
            return ast.Constant(word.text[1:-1])
        if word.text in ("True", "False"):
            return ast.Constant(word.text == "True")
        if word.text == "run":
            return self.run(word)
        if word.kind == "word":
            return self._named(word)
        if word.text == "[":
            return ast.List(self.items(), ast.Load())
        if word.text == "(":
            inside = self.value()
            self._words.take(")")
            return inside
        self._words.at -= 1
        raise self._words.unexpected("a value")

    def _named(self, word: Token) -> ast.expr:
        """A call, a pose, or a variable; ``p[`` is a pose only where six values follow."""
        if self._words.comes("("):
            return self.call(word)
        before = self._words.at
        if word.text == "p" and self._words.accept("["):
            items = self.items()
            if len(items) == _POSE_LENGTH:
                return nodes.call("pose", word.line, *items)
            self._words.at = before
        return nodes.of_frame("read", word.line, ast.Constant(word.text))

    def items(self) -> list[ast.expr]:
        """The rest of ``[a, b]``, after the bracket."""
        items: list[ast.expr] = []
        while not self._words.accept("]"):
            items.append(self.value())
            if not self._words.accept(","):
                self._words.take("]")
                break
        return items

    def call(self, word: Token) -> ast.expr:
        """A call, after the function's name."""
        if word.text in self._own:
            return nodes.steps(nodes.call(nodes.function(word.text), word.line, self._entered("enter", word)))
        function = self._builtins.get(word.text)
        if function is None:
            raise ScriptError(f"there is no function '{word.text}'", word.line)
        given, keywords = self._arguments(word.line)
        try:
            inspect.signature(function).bind(*given, **{str(keyword.arg): None for keyword in keywords})
        except TypeError as error:
            raise ScriptError(f"'{word.text}': {error}", word.line) from error
        call = nodes.call(nodes.builtin(word.text), word.line, *given)
        call.keywords = keywords
        return nodes.steps(call) if inspect.isgeneratorfunction(function) else call

    def run(self, word: Token) -> ast.expr:
        """``run name(arguments)``, after its first word."""
        name = self._words.next
        if self._words.name() not in self._own:
            raise ScriptError(f"there is no thread '{name.text}'", word.line)
        return self._entered("start", name, ast.Name(nodes.function(name.text), ast.Load()))

    def _entered(self, method: str, word: Token, *before: ast.expr) -> ast.expr:
        """``method`` of the frame, given a function's arguments."""
        given, keywords = self._arguments(word.line)
        names = ast.Tuple([], ast.Load())
        named = [str(keyword.arg) for keyword in keywords]
        self._calls.append((names, word, len(given), named))
        named_values = [keyword.value for keyword in keywords]
        return nodes.of_frame(method, word.line, *before, names, *given, *named_values)

    def _arguments(self, line: int) -> tuple[list[ast.expr], list[ast.keyword]]:
        """``(value, name=value)``."""
        self._words.take("(")
        given: list[ast.expr] = []
        keywords: list[ast.keyword] = []
        while not self._words.accept(")"):
            if self._words.next.kind == "word" and self._words.words[self._words.at + 1].text == "=":
                keyword = self._words.name()
                self._words.take("=")
                keywords.append(ast.keyword(keyword, self.value()))
            elif keywords:
                raise ScriptError("a plain argument after a named one", line)
            else:
                given.append(self.value())
            if not self._words.accept(","):
                self._words.take(")")
                break
        return given, keywords
