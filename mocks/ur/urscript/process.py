"""A program at work: its threads, each resumed once a cycle, and the variables they share."""

import time
import traceback
from collections.abc import Callable, Generator
from typing import Any, Final

from mocks.ur.urscript import values
from mocks.ur.urscript.values import PROGRAM, ScriptError

Steps = Generator[None, None, Any]

BUDGET: Final = 20_000
"""Loop turns and calls of one thread within one cycle; the controller too ends a loop that takes no time."""

LONGEST_TURN: Final = 0.05
"""s of computing of one thread within one cycle: turns may be few and each of them long. Of this thread's own
time, so that a busy machine ends no program."""


class Halted(Exception):
    """The program said ``halt``."""


class Task:
    """One thread."""

    def __init__(self, number: int) -> None:
        self.number = number  #: its handle, above zero.
        self.renew()

    def spend(self) -> None:
        """Count one turn; ``ScriptError`` where a cycle's worth is used up."""
        self._left -= 1
        if self._left < 0 or time.thread_time() > self._until:
            raise ScriptError("a loop that takes no time: 'sync()' is missing")

    def renew(self) -> None:
        """A new cycle begins."""
        self._left = BUDGET
        self._until = time.thread_time() + LONGEST_TURN


class CallFrame:
    """One call's variables; a name means one of these, else the program's global of that name."""

    __slots__ = ("_process", "_task", "_variables")

    def __init__(self, process: "Process", task: Task) -> None:
        self._process = process
        self._task = task
        self._variables: dict[str, Any] = {}

    def spend(self) -> None:
        """Count one turn of a loop."""
        self._task.spend()

    # Variables

    def read(self, name: str) -> Any:
        """The value of a name."""
        if name in self._variables:
            return self._variables[name]
        if name in self._process.variables:
            return self._process.variables[name]
        raise ScriptError(f"variable '{name}' has no value yet")

    def store(self, name: str, value: Any) -> None:
        """``name = value``: into a global of that name where there is one and no local."""
        own = name in self._variables or name not in self._process.variables
        (self._variables if own else self._process.variables)[name] = values.copied(value)

    def store_global(self, name: str, value: Any) -> None:
        """``global name = value``."""
        self._process.variables[name] = values.copied(value)

    def store_local(self, name: str, value: Any) -> None:
        """``local name = value``."""
        self._variables[name] = values.copied(value)

    def default(self, name: str, value: Any) -> None:
        """The value of a parameter that the call does not give."""
        self._variables.setdefault(name, values.copied(value))

    def set_item(self, name: str, value: Any, *indices: Any) -> None:
        """``name[indices] = value``."""
        values.set_item(self.read(name), indices, value)

    # Calls and threads

    def enter(self, names: tuple[str, ...], *given: Any) -> "CallFrame":
        """The frame of a call of one of the program's functions, given some of its parameters."""
        self._task.spend()
        return self._process.frame(self._task, names, given)

    def start(self, function: Callable[["CallFrame"], Steps], names: tuple[str, ...], *given: Any) -> int:
        """``run name(...)``: begin a thread; its handle."""
        return self._process.start(lambda task: function(self._process.frame(task, names, given)))

    def kill(self, handle: Any) -> None:
        """``kill handle``."""
        self._process.kill(handle)

    def join(self, handle: Any) -> Steps:
        """``join handle``: until the thread has ended."""
        while self._process.alive(handle):
            yield

    def halt(self) -> None:
        """End the program."""
        raise Halted

    def enter_critical(self) -> None:
        """Until ``exit_critical`` only this thread runs."""
        self._process.holder = self._task

    def exit_critical(self) -> None:
        """Let the other threads run again."""
        self._process.holder = None


class Process:
    """All threads of one program.

    Args:
        main: steps of the main thread, given its frame.
        entered: is told the number of each thread that is resumed, and 0 when it pauses.
        released: is told the number of each thread that ends, so that what it held is let go.
    """

    def __init__(
        self,
        main: Callable[[CallFrame], Steps],
        entered: Callable[[int], None],
        released: Callable[[int], None],
    ) -> None:
        self.variables: dict[str, Any] = {}  #: the globals.
        self.current = 0  #: number of the thread that runs now.
        self._entered = entered
        self._released = released
        self._tasks: dict[int, tuple[Task, Steps]] = {}
        self._started = 0
        self.holder: Task | None = None  #: the only thread that runs, in its critical section.
        self._killed: set[int] = set()
        self._main = self.start(lambda task: main(self.frame(task)))

    def frame(self, task: Task, names: tuple[str, ...] = (), given: tuple[Any, ...] = ()) -> CallFrame:
        """A new call's frame, given some parameters."""
        frame = CallFrame(self, task)
        for name, value in zip(names, given, strict=True):
            frame.store_local(name, value)
        return frame

    def start(self, steps: Callable[[Task], Steps]) -> int:
        """Begin a thread; its handle."""
        self._started += 1
        task = Task(self._started)
        self._tasks[task.number] = (task, steps(task))
        return task.number

    def kill(self, handle: Any) -> None:
        """End a thread; a handle of 0, or of one that ended, is left alone."""
        if not isinstance(handle, int):
            raise ScriptError(f"'kill' needs a thread, not {handle!r}")
        if handle == self.current:
            self._killed.add(handle)  # a generator cannot close itself
        elif handle in self._tasks:
            self._end(handle)

    def alive(self, handle: Any) -> bool:
        """Whether a thread still runs."""
        return handle in self._tasks

    def step(self) -> bool:
        """Resume each thread once, those just begun too; whether the program goes on.

        Raises:
            ScriptError: the program cannot go on.
        """
        number = 0
        while number := min((later for later in self._tasks if later > number), default=0):
            if self.holder is not None and self.holder.number != number:
                continue
            task, steps = self._tasks[number]
            task.renew()
            self.current = number
            self._entered(number)
            try:
                next(steps)
            except StopIteration:
                self._end(number)
            except Halted:
                self._end(self._main)
            except ScriptError as error:
                raise ScriptError(str(error), _line_of(error)) from error
            except (TypeError, ValueError, ArithmeticError, RecursionError) as error:
                raise ScriptError(f"{type(error).__name__}: {error}", _line_of(error)) from error
            finally:
                self.current = 0
                self._entered(0)
            if number in self._killed:
                self._end(number)
            if self._main not in self._tasks:
                self.close()
                return False
        return True

    def close(self) -> None:
        """End every thread."""
        for number in list(self._tasks):
            self._end(number)

    def _end(self, number: int) -> None:
        if number not in self._tasks:
            return
        task, steps = self._tasks.pop(number)
        self._killed.discard(number)
        if self.holder is task:
            self.holder = None
        steps.close()
        self._released(number)


def _line_of(error: Exception) -> int:
    """The last of the program's lines that an error came through."""
    frames = traceback.walk_tb(error.__traceback__)
    return next((line for frame, line in reversed([*frames]) if frame.f_code.co_filename == PROGRAM), 0)
