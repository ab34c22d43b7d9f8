"""Variables: a name means the call's own variable, else the program's global of that name."""

from typing import Any, Final

from mocks.ur.urscript import values
from mocks.ur.urscript.code import Leave
from mocks.ur.urscript.errors import ScriptError
from mocks.ur.urscript.process import CallFrame

_MISSING: Final = object()


def read(frame: CallFrame, name: str, line: int) -> Any:
    """The value of a name."""
    value = frame.variables.get(name, _MISSING)
    if value is _MISSING:
        value = frame.process.variables.get(name, _MISSING)
    if value is _MISSING:
        raise ScriptError(f"variable '{name}' has no value yet", line)
    return value


def store(frame: CallFrame, name: str, value: Any) -> None:
    """``name = value``: into a global of that name where there is one and no local."""
    if name not in frame.variables and name in frame.process.variables:
        frame.process.variables[name] = values.copied(value)
    else:
        frame.variables[name] = values.copied(value)


def store_global(frame: CallFrame, name: str, value: Any) -> None:
    """``global name = value``."""
    frame.process.variables[name] = values.copied(value)


def store_local(frame: CallFrame, name: str, value: Any) -> None:
    """``local name = value``."""
    frame.variables[name] = values.copied(value)


def set_result(frame: CallFrame, value: Any) -> Leave:
    """``return value``."""
    frame.result = value
    return Leave.RETURN
