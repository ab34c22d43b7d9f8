"""A program at work: its threads, each resumed once a cycle, and the variables they share."""

from collections.abc import Callable, Generator
from typing import Any, Final

from mocks.ur.urscript.errors import ScriptError

Steps = Generator[None, None, Any]

BUDGET: Final = 20_000
"""Loop turns and calls of one thread within one cycle; the controller too ends a loop that takes no time."""


class Halted(Exception):
    """The program said ``halt``."""


class Task:
    """One thread.

    Attributes:
        number: its handle, above zero.
    """

    def __init__(self, number: int) -> None:
        self.number = number
        self._left = BUDGET

    def spend(self, line: int) -> None:
        """Count one turn; ``ScriptError`` where a cycle's worth is used up."""
        self._left -= 1
        if self._left < 0:
            raise ScriptError("a loop that takes no time: 'sync()' is missing", line)

    def renew(self) -> None:
        """A new cycle begins."""
        self._left = BUDGET


class CallFrame:
    """One call's variables and result."""

    __slots__ = ("process", "result", "task", "variables")

    def __init__(self, process: "Process", task: Task) -> None:
        self.process = process
        self.task = task
        self.variables: dict[str, Any] = {}
        self.result: Any = None


class Process:
    """All threads of one program.

    Args:
        main: steps of the main thread, given its frame.
        entered: is told the number of each thread that is resumed, and 0 when it pauses.
        released: is told the number of each thread that ends, so that what it held is let go.

    Attributes:
        variables: the globals.
        current: number of the thread that runs now.
    """

    def __init__(
        self,
        main: Callable[[CallFrame], Steps],
        entered: Callable[[int], None],
        released: Callable[[int], None],
    ) -> None:
        self.variables: dict[str, Any] = {}
        self.current = 0
        self._entered = entered
        self._released = released
        self._tasks: dict[int, tuple[Task, Steps]] = {}
        self._started = 0
        self._holder: Task | None = None
        self._killed: set[int] = set()
        self._main = self.start(lambda task: main(self.frame(task)))

    def frame(self, task: Task) -> CallFrame:
        """An empty frame."""
        return CallFrame(self, task)

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

    def halt(self) -> None:
        """End the program."""
        raise Halted

    def hold(self, task: Task | None) -> None:
        """Until ``hold(None)`` only this thread runs."""
        self._holder = task

    def step(self) -> bool:
        """Resume each thread once, those just begun too; whether the program goes on.

        Raises:
            ScriptError: the program cannot go on.
        """
        number = 0
        while number := min((later for later in self._tasks if later > number), default=0):
            if self._holder is not None and self._holder.number != number:
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
            except (TypeError, ValueError, ArithmeticError, RecursionError) as error:
                raise ScriptError(f"{type(error).__name__}: {error}") from error
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
        if self._holder is task:
            self._holder = None
        steps.close()
        self._released(number)
