"""Words of URScript. Line ends mean nothing: a statement may break anywhere, even after ``=``."""

import re
from dataclasses import dataclass
from typing import Final

from mocks.ur.urscript.errors import ScriptError

KEYWORDS: Final = frozenset(
    (
        "def",
        "sec",
        "thread",
        "end",
        "if",
        "elif",
        "else",
        "while",
        "return",
        "break",
        "continue",
        "global",
        "local",
        "halt",
        "pass",
        "run",
        "kill",
        "join",
        "enter_critical",
        "exit_critical",
        "and",
        "or",
        "not",
        "xor",
        "True",
        "False",
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
    """One word.

    Attributes:
        kind: ``"number"``, ``"word"``, ``"keyword"``, ``"string"``, ``"symbol"`` or ``"end of text"``.
        text: as written.
        line: counted from 1.
    """

    kind: str
    text: str
    line: int


def tokens(text: str) -> list[Token]:
    """All words, and an end of text.

    Raises:
        ScriptError: a character that begins no word.
    """
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
