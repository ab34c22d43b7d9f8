"""Text to syntax tree, by recursive descent; every word that is not of the grammar is an error."""

from typing import Final

from mocks.ur.urscript.errors import ScriptError
from mocks.ur.urscript.syntax import (
    Assign,
    Block,
    Call,
    Evaluate,
    Expression,
    FunctionDefinition,
    If,
    Index,
    Literal,
    Name,
    Operation,
    Program,
    Return,
    Sequence,
    SetItem,
    Statement,
    Threading,
    While,
    Word,
)
from mocks.ur.urscript.tokens import Token, tokens

_LEVELS: Final = (
    ("or", "xor"),
    ("and",),
    ("==", "!=", "<", ">", "<=", ">="),
    ("+", "-"),
    ("*", "/", "%"),
)
_BLOCK_ENDS: Final = frozenset(("end", "elif", "else"))
_WORDS: Final = frozenset(("break", "continue", "halt", "pass", "enter_critical", "exit_critical"))
_POSE_LENGTH: Final = 6


def parse(text: str) -> Program:
    """The program of a text: ``def name(): ... end``, ``sec name(): ... end``, or plain statements.

    Raises:
        ScriptError: it is not URScript, or not of the part that is understood here.
    """
    try:
        return _Parser(tokens(text)).program()
    except RecursionError as error:
        raise ScriptError("nested too deeply") from error


class _Parser:
    def __init__(self, words: list[Token]) -> None:
        self._words = words
        self._at = 0
        self._functions: dict[str, FunctionDefinition] = {}

    def program(self) -> Program:
        """The whole text."""
        opener = self._next.text
        if opener in ("def", "sec"):
            name = self._heading()[0]
            body = self._block()
            self._take("end")
        else:
            opener, name, body = "", "", self._block()
        if self._next.kind != "end of text":
            raise self._unexpected("the end of the text")
        return Program(name, body, self._functions, secondary=opener == "sec")

    # Statements

    def _heading(self) -> tuple[str, tuple[tuple[str, Expression | None], ...]]:
        """``def name(parameter, parameter=default):``."""
        self._at += 1
        name = self._word()
        self._take("(")
        parameters: list[tuple[str, Expression | None]] = []
        while not self._accept(")"):
            parameter = self._word()
            parameters.append((parameter, self._expression() if self._accept("=") else None))
            if not self._accept(","):
                self._take(")")
                break
        self._take(":")
        return name, tuple(parameters)

    def _function(self) -> None:
        word = self._next
        name, parameters = self._heading()
        body = self._block()
        self._take("end")
        self._functions[name] = FunctionDefinition(name, parameters, body, word.text == "thread", word.line)

    def _block(self) -> Block:
        found: list[Statement] = []
        while self._next.text not in _BLOCK_ENDS and self._next.kind != "end of text":
            if self._next.kind == "keyword" and self._next.text in ("def", "thread"):
                self._function()
            else:
                found.append(self._statement())
        return tuple(found)

    def _statement(self) -> Statement:
        word = self._next
        if word.kind == "keyword":
            return self._keyword_statement(word)
        expression = self._expression()
        if not self._accept("="):
            if not isinstance(expression, Call):
                raise ScriptError(f"'{word.text}' stands alone; a statement does something", word.line)
            return Evaluate(expression)
        if isinstance(expression, Name):
            return Assign(expression.name, self._expression(), "", word.line)
        if isinstance(expression, Index) and isinstance(expression.target, Name):
            return SetItem(expression.target.name, expression.indices, self._expression(), word.line)
        raise ScriptError("only a variable or an element of one can be assigned", word.line)

    def _keyword_statement(self, word: Token) -> Statement:
        self._at += 1
        if word.text in _WORDS:
            return Word(word.text)
        if word.text == "if":
            return self._if()
        if word.text == "while":
            condition = self._condition()
            body = self._block()
            self._take("end")
            return While(condition, body, word.line)
        if word.text == "return":
            return Return(None if self._next.text in _BLOCK_ENDS else self._expression())
        if word.text in ("kill", "join"):
            return Threading(word.text, self._expression())
        if word.text in ("global", "local"):
            name = self._word()
            self._take("=")
            return Assign(name, self._expression(), word.text, word.line)
        self._at -= 1
        if word.text == "run":
            return Evaluate(self._expression())
        raise self._unexpected("a statement")

    def _if(self) -> If:
        branches = []
        while True:
            condition = self._condition()
            branches.append((condition, self._block()))
            if not self._accept("elif"):
                break
        otherwise: Block = ()
        if self._accept("else"):
            self._accept(":")
            otherwise = self._block()
        self._take("end")
        return If(tuple(branches), otherwise)

    def _condition(self) -> Expression:
        condition = self._expression()
        self._accept(":")
        return condition

    # Expressions

    def _expression(self, level: int = 0) -> Expression:
        if level == len(_LEVELS):
            return self._unary()
        left = self._expression(level + 1)
        while self._next.text in _LEVELS[level] and self._next.kind in ("symbol", "keyword"):
            word = self._take_any()
            left = Operation(word.text, (left, self._expression(level + 1)), word.line)
        return left

    def _unary(self) -> Expression:
        word = self._next
        if word.kind == "keyword" and word.text == "not":
            self._at += 1
            return Operation("not", (self._expression(2),), word.line)
        if word.kind == "symbol" and word.text in ("-", "+"):
            self._at += 1
            return Operation("negative" if word.text == "-" else "positive", (self._unary(),), word.line)
        return self._postfix()

    def _postfix(self) -> Expression:
        found = self._primary()
        while self._next.text == "[" and self._next.kind == "symbol":
            line = self._take_any().line
            found = Index(found, self._items("]"), line)
        return found

    def _primary(self) -> Expression:
        word = self._take_any()
        if word.kind == "number":
            return Literal(int(word.text) if word.text.isdigit() else float(word.text))
        if word.kind == "string":
            return Literal(word.text[1:-1])
        if word.kind == "keyword" and word.text in ("True", "False"):
            return Literal(word.text == "True")
        if word.kind == "keyword" and word.text == "run":
            return self._call(self._word(), word.line, run=True)
        if word.kind == "word":
            return self._named(word)
        if word.text == "[":
            return Sequence(self._items("]"), pose=False)
        if word.text == "(":
            inside = self._expression()
            self._take(")")
            return inside
        self._at -= 1
        raise self._unexpected("a value")

    def _named(self, word: Token) -> Expression:
        """A call, a pose, or a variable; ``p[`` is a pose only where six values follow."""
        if self._next.text == "(":
            return self._call(word.text, word.line)
        if word.text == "p" and self._next.text == "[":
            before = self._at
            self._at += 1
            items = self._items("]")
            if len(items) == _POSE_LENGTH:
                return Sequence(items, pose=True)
            self._at = before
        return Name(word.text, word.line)

    def _call(self, name: str, line: int, *, run: bool = False) -> Call:
        self._take("(")
        arguments: list[Expression] = []
        keywords: list[tuple[str, Expression]] = []
        while not self._accept(")"):
            following = self._words[self._at + 1] if self._next.kind == "word" else self._next
            if self._next.kind == "word" and following.text == "=":
                keyword = self._word()
                self._at += 1
                keywords.append((keyword, self._expression()))
            elif keywords:
                raise ScriptError("a plain argument after a named one", line)
            else:
                arguments.append(self._expression())
            if not self._accept(","):
                self._take(")")
                break
        return Call(name, tuple(arguments), tuple(keywords), line, run)

    def _items(self, closing: str) -> tuple[Expression, ...]:
        items: list[Expression] = []
        while not self._accept(closing):
            items.append(self._expression())
            if not self._accept(","):
                self._take(closing)
                break
        return tuple(items)

    # Words

    @property
    def _next(self) -> Token:
        return self._words[self._at]

    def _take_any(self) -> Token:
        word = self._words[self._at]
        if word.kind == "end of text":
            raise self._unexpected("more text")
        self._at += 1
        return word

    def _accept(self, text: str) -> bool:
        """Step over a word if it comes next."""
        if self._next.text == text and self._next.kind in ("symbol", "keyword"):
            self._at += 1
            return True
        return False

    def _take(self, text: str) -> None:
        if not self._accept(text):
            raise self._unexpected(f"'{text}'")

    def _word(self) -> str:
        if self._next.kind != "word":
            raise self._unexpected("a name")
        return self._take_any().text

    def _unexpected(self, wanted: str) -> ScriptError:
        found = self._next.text or "the end of the text"
        return ScriptError(f"expected {wanted}, found '{found}'", self._next.line)
