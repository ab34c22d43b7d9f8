"""The syntax tree of a program."""

from dataclasses import dataclass, field

Value = object


@dataclass(frozen=True, slots=True)
class Literal:
    """A number, string, True or False."""

    value: Value


@dataclass(frozen=True, slots=True)
class Name:
    """A variable read."""

    name: str
    line: int


@dataclass(frozen=True, slots=True)
class Sequence:
    """``[...]``, or ``p[...]`` where ``pose``."""

    items: "tuple[Expression, ...]"
    pose: bool


@dataclass(frozen=True, slots=True)
class Operation:
    """An operator and its one or two operands."""

    symbol: str
    operands: "tuple[Expression, ...]"
    line: int


@dataclass(frozen=True, slots=True)
class Index:
    """``target[i]`` or ``target[i, j]``."""

    target: "Expression"
    indices: "tuple[Expression, ...]"
    line: int


@dataclass(frozen=True, slots=True)
class Call:
    """``name(arguments, keyword=argument)``; begun as a thread where ``run``."""

    name: str
    arguments: "tuple[Expression, ...]"
    keywords: "tuple[tuple[str, Expression], ...]"
    line: int
    run: bool = False


Expression = Literal | Name | Sequence | Operation | Index | Call


@dataclass(frozen=True, slots=True)
class Assign:
    """``name = value``; ``scope`` is ``"global"``, ``"local"`` or nothing."""

    name: str
    value: Expression
    scope: str
    line: int


@dataclass(frozen=True, slots=True)
class SetItem:
    """``name[indices] = value``."""

    name: str
    indices: tuple[Expression, ...]
    value: Expression
    line: int


@dataclass(frozen=True, slots=True)
class Evaluate:
    """A call for its effect."""

    expression: Expression


@dataclass(frozen=True, slots=True)
class If:
    """Conditions with their blocks, tried in turn."""

    branches: "tuple[tuple[Expression, Block], ...]"
    otherwise: "Block"


@dataclass(frozen=True, slots=True)
class While:
    """A loop."""

    condition: Expression
    body: "Block"
    line: int


@dataclass(frozen=True, slots=True)
class Return:
    """The end of a function."""

    value: Expression | None


@dataclass(frozen=True, slots=True)
class Word:
    """``break``, ``continue``, ``halt``, ``pass``, ``enter_critical`` or ``exit_critical``."""

    word: str


@dataclass(frozen=True, slots=True)
class Threading:
    """``kill thread`` or ``join thread``."""

    word: str
    thread: Expression


Statement = Assign | SetItem | Evaluate | If | While | Return | Word | Threading
Block = tuple[Statement, ...]


@dataclass(frozen=True, slots=True)
class FunctionDefinition:
    """``def`` or ``thread``; parameters with their defaults."""

    name: str
    parameters: tuple[tuple[str, Expression | None], ...]
    body: Block
    is_thread: bool
    line: int


@dataclass(frozen=True)
class Program:
    """A whole text.

    Attributes:
        name: of the program; empty for a single line.
        body: of the program itself.
        functions: all functions and threads, by name.
        secondary: whether it runs beside the main program.
    """

    name: str
    body: Block
    functions: dict[str, FunctionDefinition] = field(default_factory=dict)
    secondary: bool = False
