"""Words of URScript. Line ends mean nothing: a statement may break anywhere, even after ``=``."""

import re
from dataclasses import dataclass
from typing import Final

from mocks.ur.urscript.values import ScriptError

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
        self.words = _tokens(text)
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
        """Whether one of these comes next, as a word of the grammar."""
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
        """What to raise where something else was wanted."""
        return ScriptError(
            f"expected {wanted}, found '{self.next.text or 'the end of the text'}'", self.next.line
        )


def _tokens(text: str) -> list[Token]:
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
    return found


_SKIPPED: Final = re.compile(r"""\#[^\n]*|"[^"\n]*"|'[^'\n]*'|\b(def|sec|thread|if|while|end)\b""")


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
