"""URScript to Python, by recursive descent: every word that is not of the grammar is an error.

Each function becomes a Python generator that yields once a cycle and works on a ``CallFrame``. A
program's names stay strings in it, so nothing of Python can be reached but the built-ins that are
handed in; its line numbers are the text's, for what is told of an error.
"""

import ast
import inspect
import itertools
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Final, TypeVar

from mocks.ur.urscript import values
from mocks.ur.urscript.process import CallFrame, Steps
from mocks.ur.urscript.values import PROGRAM, ScriptError

KEYWORDS: Final = frozenset(
    (
        *("def", "sec", "thread", "end", "if", "elif", "else", "while", "return", "break", "continue"),
        *("global", "local", "halt", "pass", "run", "kill", "join", "enter_critical", "exit_critical"),
        *("and", "or", "not", "xor", "True", "False"),
    )
)

_TOKEN: Final = re.compile(
    r"""(?P<space>[ \t\r\n]+|\#[^\n]*)
      | (?P<number>(?:\d+\.\d*|\.\d+|\d+)(?:[eE][+-]?\d+)?)
      | (?P<word>[A-Za-z_][A-Za-z_0-9]*)
      | (?P<string>"[^"\n]*"|'[^'\n]*')
      | (?P<symbol>==|!=|<=|>=|[-+*/%<>=()\[\],:.])""",
    re.VERBOSE,
)


@dataclass(frozen=True, slots=True)
class Token:
    """One word."""

    kind: str  #: ``"number"``, ``"word"``, ``"keyword"``, ``"string"``, ``"symbol"`` or ``"end of text"``.
    text: str  #: as written.
    line: int  #: counted from 1.


class Tokens:
    """All words of a text, taken one after the other.

    Raises:
        ScriptError: a character that begins no word; a method: another word than the one that must come.
    """

    def __init__(self, text: str) -> None:
        found: list[Token] = []
        position, line = 0, 1
        while position < len(text):
            match = _TOKEN.match(text, position)
            if match is None:
                raise ScriptError(f"unexpected character {text[position]!r}", line)
            kind, word = str(match.lastgroup), match.group()
            if kind == "word" and word in KEYWORDS:
                kind = "keyword"
            if kind != "space":
                found.append(Token(kind, word, line))
            line += word.count("\n")
            position = match.end()
        found.append(Token("end of text", "", line))
        self.words = found
        self.at = 0

    @property
    def next(self) -> Token:
        """The word that comes next."""
        return self.words[self.at]

    def take_any(self) -> Token:
        """Step over the next word."""
        word = self.next
        if word.kind == "end of text":
            raise self.unexpected("more text")
        self.at += 1
        return word

    def comes(self, *texts: str) -> bool:
        """Return whether the next token is one of these symbols or keywords."""
        return self.next.text in texts and self.next.kind in ("symbol", "keyword")

    def accept(self, text: str) -> bool:
        """Step over a word if it comes next."""
        comes = self.comes(text)
        self.at += comes
        return comes

    def take(self, text: str) -> None:
        """Step over a word, which must come next."""
        if not self.accept(text):
            raise self.unexpected(f"'{text}'")

    def name(self) -> str:
        """Step over a name, which must come next."""
        if self.next.kind != "word":
            raise self.unexpected("a name")
        return self.take_any().text

    def unexpected(self, wanted: str) -> ScriptError:
        """Create the error of an unexpected token."""
        return ScriptError(
            f"expected {wanted}, found '{self.next.text or 'the end of the text'}'", self.next.line
        )


_SKIPPED: Final = re.compile(r"""\#[^\n]*|"[^"\n]*"|'[^'\n]*'|\b(def|sec|thread|if|while|end)\b""")


_LEVELS: Final = (
    ("or", "xor"),
    ("and",),
    ("==", "!=", "<", ">", "<=", ">="),
    ("+", "-"),
    ("*", "/", "%"),
)
_POSE_LENGTH: Final = 6


_BLOCK_ENDS: Final = frozenset(("end", "elif", "else"))
_MAIN: Final = "the program itself"
_HELPERS: Final[dict[str, Callable[..., Any]]] = {
    "truth": values.truth,
    "item": values.item,
    "pose": lambda *items: values.PoseValue(values.number(item) for item in items),
}


@dataclass(frozen=True)
class Program:
    """A text, ready to run."""

    name: str  #: empty for plain statements.
    main: Callable[[CallFrame], Steps]  #: steps of its own statements.
    secondary: bool  #: whether it runs beside the main program.


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
        own = words.words[1:]  # the first word opens the program, which cannot be called
        self._own = {name.text for word, name in itertools.pairwise(own) if word.text in ("def", "thread")}
        # Functions may be called before the text defines them: their arguments are named at the end.
        self._calls: list[tuple[ast.Tuple, Token, int, list[str]]] = []
        # Of each of the program's functions its parameters, and whether a call must give them.
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
        self._complete_calls()
        self._define(_MAIN, body)
        module = ast.fix_missing_locations(ast.Module(self._functions, []))
        reached: dict[str, Any] = {"__builtins__": {}, **_HELPERS, **values.OPERATORS}
        reached |= {f"built-in {name}": function for name, function in self._builtins.items()}
        exec(compile(module, PROGRAM, "exec"), reached)  # noqa: S102 - see the module's docstring
        return Program(name, reached[_MAIN], secondary=opener == "sec")

    def _complete_calls(self) -> None:
        """Name the arguments of all calls of the program's own functions."""
        for given, word, plain, keywords in self._calls:
            parameters = self._parameters[word.text]
            names = [*list(parameters)[:plain], *keywords]
            required = {name for name, needed in parameters.items() if needed}
            if (
                plain > len(parameters)
                or len(set(names)) < len(names)
                or not required <= set(names) <= set(parameters)
            ):
                raise ScriptError(f"'{word.text}' takes ({', '.join(parameters)})", word.line)
            given.elts = [ast.Constant(name) for name in names]

    # Functions

    def _heading(self) -> tuple[str, dict[str, ast.expr | None]]:
        """``def name(parameter, parameter=default):``."""
        self._words.take_any()
        name = self._words.name()
        self._words.take("(")
        parameters: dict[str, ast.expr | None] = {}
        while not self._words.accept(")"):
            parameter = self._words.name()
            parameters[parameter] = self._value() if self._words.accept("=") else None
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
            ast.Expr(_of_frame("default", line, ast.Constant(parameter), value))
            for parameter, value in parameters.items()
            if value is not None
        ]
        body = self._block()
        self._words.take("end")
        self._define(f"function {name}", [*defaults, *body])

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
            return ast.Expr(self._call(word))
        if word.kind == "word" and self._words.accept("="):
            return self._store("store", word.text, word.line)
        if word.kind == "word" and self._words.accept("["):
            indices = self._items()
            self._words.take("=")
            place = (ast.Constant(word.text), self._value(), *indices)
            return ast.Expr(_of_frame("set_item", word.line, *place))
        raise ScriptError(f"'{word.text}' stands alone; a statement does something", word.line)

    def _keyword_statement(self, word: Token) -> ast.stmt:
        match word.text:
            case "if":
                return self._if()
            case "while":
                condition = self._condition()
                body = [ast.Expr(_of_frame("spend", word.line)), *self._block()]
                self._words.take("end")
                return ast.While(condition, body, [])
            case "return":
                ends = self._words.next.text in _BLOCK_ENDS
                return ast.Return(None if ends else self._value())
            case "global" | "local":
                name = self._words.name()
                self._words.take("=")
                return self._store(f"store_{word.text}", name, word.line)
            case "run":
                return ast.Expr(self._run(word))
            case "join":
                return ast.Expr(_steps(_of_frame("join", word.line, self._value())))
            case "kill":
                return ast.Expr(_of_frame("kill", word.line, self._value()))
            case "halt" | "enter_critical" | "exit_critical":
                return ast.Expr(_of_frame(word.text, word.line))
            case "break":
                return _placed(ast.Break(), word.line)
            case "continue":
                return _placed(ast.Continue(), word.line)
            case "pass":
                return ast.Pass()
        self._words.at -= 1
        raise self._words.unexpected("a statement")

    def _store(self, method: str, name: str, line: int) -> ast.stmt:
        return ast.Expr(_of_frame(method, line, ast.Constant(name), self._value()))

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
        condition = _call("truth", line, self._value())
        self._words.accept(":")
        return condition

    # Expressions

    def _value(self, level: int = 0) -> ast.expr:
        """The expression that comes next, of operators that bind at least as tightly as a level."""
        if level == len(_LEVELS):
            return self._unary()
        left = self._value(level + 1)
        while self._words.comes(*_LEVELS[level]):
            word = self._words.take_any()
            right = self._value(level + 1)
            if word.text in ("and", "or"):
                operator = ast.And() if word.text == "and" else ast.Or()
                left = ast.BoolOp(operator, [_call("truth", word.line, side) for side in (left, right)])
            else:
                left = _call(word.text, word.line, left, right)
        return left

    def _unary(self) -> ast.expr:
        word = self._words.next
        if self._words.accept("not"):
            return _call("not", word.line, self._value(2))
        if self._words.accept("-"):
            return _call("negative", word.line, self._unary())
        if self._words.accept("+"):
            return _call("positive", word.line, self._unary())
        found = self._primary()
        while self._words.comes("["):
            line = self._words.take_any().line
            found = _call("item", line, found, *self._items())
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
            return self._run(word)
        if word.kind == "word":
            # A call, a pose, or a variable; ``p[`` is a pose only where six values follow.
            if self._words.comes("("):
                return self._call(word)
            before = self._words.at
            if word.text == "p" and self._words.accept("["):
                items = self._items()
                if len(items) == _POSE_LENGTH:
                    return _call("pose", word.line, *items)
                self._words.at = before
            return _of_frame("read", word.line, ast.Constant(word.text))
        if word.text == "[":
            return ast.List(self._items(), ast.Load())
        if word.text == "(":
            inside = self._value()
            self._words.take(")")
            return inside
        self._words.at -= 1
        raise self._words.unexpected("a value")

    def _items(self) -> list[ast.expr]:
        """The rest of ``[a, b]``, after the bracket."""
        items: list[ast.expr] = []
        while not self._words.accept("]"):
            items.append(self._value())
            if not self._words.accept(","):
                self._words.take("]")
                break
        return items

    def _call(self, word: Token) -> ast.expr:
        if word.text in self._own:
            return _steps(_call(f"function {word.text}", word.line, self._entered("enter", word)))
        function = self._builtins.get(word.text)
        if function is None:
            raise ScriptError(f"there is no function '{word.text}'", word.line)
        given, keywords = self._arguments(word.line)
        try:
            inspect.signature(function).bind(*given, **{str(keyword.arg): None for keyword in keywords})
        except TypeError as error:
            raise ScriptError(f"'{word.text}': {error}", word.line) from error
        call = _call(f"built-in {word.text}", word.line, *given)
        call.keywords = keywords
        return _steps(call) if inspect.isgeneratorfunction(function) else call

    def _run(self, word: Token) -> ast.expr:
        name = self._words.next
        if self._words.name() not in self._own:
            raise ScriptError(f"there is no thread '{name.text}'", word.line)
        return self._entered("start", name, ast.Name(f"function {name.text}", ast.Load()))

    def _entered(self, method: str, word: Token, *before: ast.expr) -> ast.expr:
        """``method`` of the frame, given a function's arguments."""
        given, keywords = self._arguments(word.line)
        names = ast.Tuple([], ast.Load())
        named = [str(keyword.arg) for keyword in keywords]
        self._calls.append((names, word, len(given), named))
        named_values = [keyword.value for keyword in keywords]
        return _of_frame(method, word.line, *before, names, *given, *named_values)

    def _arguments(self, line: int) -> tuple[list[ast.expr], list[ast.keyword]]:
        """``(value, name=value)``."""
        self._words.take("(")
        given: list[ast.expr] = []
        keywords: list[ast.keyword] = []
        while not self._words.accept(")"):
            if self._words.next.kind == "word" and self._words.words[self._words.at + 1].text == "=":
                keyword = self._words.name()
                self._words.take("=")
                keywords.append(ast.keyword(keyword, self._value()))
            elif keywords:
                raise ScriptError("a plain argument after a named one", line)
            else:
                given.append(self._value())
            if not self._words.accept(","):
                self._words.take(")")
                break
        return given, keywords


_Node = TypeVar("_Node", ast.Call, ast.YieldFrom, ast.Break, ast.Continue)


def _call(name: str, line: int, *given: ast.expr) -> ast.Call:
    return _placed(ast.Call(ast.Name(name, ast.Load()), list(given), []), line)


def _of_frame(method: str, line: int, *given: ast.expr) -> ast.Call:
    attribute = ast.Attribute(ast.Name("frame", ast.Load()), method, ast.Load())
    return _placed(ast.Call(attribute, list(given), []), line)


def _steps(call: ast.Call) -> ast.YieldFrom:
    return _placed(ast.YieldFrom(call), call.lineno)


def _placed(node: _Node, line: int) -> _Node:
    node.lineno = node.end_lineno = line
    node.col_offset = node.end_col_offset = 0
    return node


def whole_length(text: str) -> int:
    """Length of the whole program at the start of a stream; 0 while its last ``end`` has not arrived.

    Text that does not begin with a program is whole at each line's end.
    """
    start = len(text) - len(text.lstrip())
    if not re.match(r"(def|sec)\b", text[start:]):
        return text.find("\n", start) + 1
    depth = 0
    for match in _SKIPPED.finditer(text, start):
        word = match.group(1)
        if word is None:
            continue
        depth += -1 if word == "end" else 1
        if depth == 0:
            return match.end() if match.end() < len(text) else 0
    return 0
