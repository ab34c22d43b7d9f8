"""URScript's values and operators: numbers, truth, strings, lists, poses."""

import math
import operator
from collections.abc import Callable, Iterable
from typing import Any, Final

PROGRAM: Final = "<URScript>"
"""The file name of a translated program, in tracebacks."""


class ScriptError(Exception):
    """A program that cannot be read or cannot go on; it stops, as on the pendant.

    Args:
        message: in words.
        line: of the text, counted from 1; 0 where it is not known.
    """

    def __init__(self, message: str, line: int = 0) -> None:
        super().__init__(f"line {line}: {message}" if line else message)


INT32: Final = 2**31
"""Whole numbers from here on become floating-point ones, as whole numbers are 32 bits wide."""

LONGEST_STRING: Final = 10_000
LARGEST_LIST: Final = 10_000
"""Values in a list, those in the lists within it included."""


class PoseValue(list[float]):
    """Six numbers that name a place rather than joint angles."""


def copied(value: Any) -> Any:
    """Lists are values: a second name for one is a copy.

    Raises:
        ScriptError: it holds more than ``LARGEST_LIST`` values.
    """
    if not isinstance(value, list):
        return value
    _count(value, 0)
    return _copy(value)


def _count(value: list[Any], before: int) -> int:
    """Values in a list and before it; a list that doubles is given up before it fills the memory."""
    total = before + len(value)
    if total > LARGEST_LIST:
        raise ScriptError(f"a list of more than {LARGEST_LIST} values")
    for part in value:
        if isinstance(part, list):
            total = _count(part, total)
    return total


def _copy(value: Any) -> Any:
    return type(value)(_copy(part) for part in value) if isinstance(value, list) else value


def number(value: Any) -> float:
    """A number, and nothing else."""
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise ScriptError(f"a number is needed, not {show(value)}")
    return value


def six(value: Any, what: str) -> list[float]:
    """Six numbers, all finite."""
    if not isinstance(value, list) or len(value) != 6:
        raise ScriptError(f"{what} needs six numbers, not {show(value)}")
    numbers = [float(number(item)) for item in value]
    if not all(map(math.isfinite, numbers)):
        raise ScriptError(f"{what} needs finite numbers, not {show(value)}")
    return numbers


def truth(value: Any) -> bool:
    """A condition: True or False."""
    if not isinstance(value, bool):
        raise ScriptError(f"a condition is True or False, not {show(value)}")
    return value


def show(value: Any) -> str:
    """As the log shows it, cut short."""
    if isinstance(value, PoseValue):
        return "p" + show(list(value))
    if isinstance(value, list):
        return "[" + ", ".join(show(item) for item in value[:8]) + "]"
    return f"{value:.6g}" if isinstance(value, float) else str(value)[:80]


def item(target: Any, *indices: Any) -> Any:
    """``target[i]`` or ``target[i, j]``."""
    for index in indices:
        target = _list(target)[_position(target, index)]
    return target


def set_item(target: Any, indices: Iterable[Any], value: Any) -> None:
    """Replace one element in place."""
    *outer, last = indices
    row = _list(item(target, *outer))
    row[_position(row, last)] = copied(value)


def _list(value: Any) -> list[Any]:
    if not isinstance(value, list):
        raise ScriptError(f"{show(value)} has no elements")
    return value


def _position(target: list[Any], index: Any) -> int:
    if isinstance(index, bool) or not isinstance(index, int | float) or index != int(index):
        raise ScriptError(f"an index is a whole number, not {show(index)}")
    if not 0 <= index < len(target):
        raise ScriptError(f"index {int(index)} is outside the list of {len(target)}")
    return int(index)


def _arithmetic(apply: Callable[[Any, Any], Any]) -> Callable[[Any, Any], Any]:
    def checked(a: Any, b: Any) -> Any:
        if type(a) is str and type(b) is str and apply is operator.add:
            if len(a) + len(b) > LONGEST_STRING:
                raise ScriptError(f"a string of {len(a) + len(b)} letters; {LONGEST_STRING} is the limit")
            return a + b
        result = apply(number(a), number(b))
        return result if type(result) is not int or -INT32 <= result < INT32 else float(result)

    return checked


def _divide(a: Any, b: Any) -> float:
    if b == 0:
        raise ScriptError("division by zero")
    return float(number(a) / number(b))


def _remainder(a: Any, b: Any) -> float:
    if b == 0:
        raise ScriptError("division by zero")
    return math.fmod(number(a), number(b)) if isinstance(a, float) or isinstance(b, float) else a % b


OPERATORS: Final[dict[str, Callable[..., Any]]] = {
    "+": _arithmetic(operator.add),
    "-": _arithmetic(operator.sub),
    "*": _arithmetic(operator.mul),
    "/": _divide,
    "%": _remainder,
    "<": _arithmetic(operator.lt),
    ">": _arithmetic(operator.gt),
    "<=": _arithmetic(operator.le),
    ">=": _arithmetic(operator.ge),
    "==": operator.eq,
    "!=": operator.ne,
    "xor": lambda a, b: truth(a) != truth(b),
    "not": lambda a: not truth(a),
    "negative": lambda a: -number(a),
    "positive": number,
}
