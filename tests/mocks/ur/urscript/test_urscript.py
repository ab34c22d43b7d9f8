"""URScript: its grammar, its values, its threads."""

import time
from collections.abc import Callable
from typing import Any

import pytest

from mocks.ur.urscript.process import LONGEST_TURN, Process
from mocks.ur.urscript.program import translate, whole_length
from mocks.ur.urscript.values import PoseValue, ScriptError


class Bench:
    """Runs a program; ``say(x)`` records a value and the cycle, ``sync()`` ends a cycle."""

    def __init__(self, text: str) -> None:
        self.said: list[Any] = []
        self.cycle = 0
        self.released: list[int] = []

        def sync() -> Any:
            yield

        builtins: dict[str, Callable[..., Any]] = {"say": self.say, "sync": sync}
        program = translate(text, builtins)
        self.process = Process(program.main, lambda _: None, self.released.append)

    def say(self, x: Any, at: Any = None) -> None:
        self.said.append(x if at is None else (x, self.cycle))

    def run(self, cycles: int = 100) -> list[Any]:
        for _ in range(cycles):
            if not self.process.step():
                break
            self.cycle += 1
        return self.said


def values_of(*lines: str) -> list[Any]:
    return Bench("def f():\n" + "\n".join(lines) + "\nend\n").run()


@pytest.mark.parametrize(
    ("expression", "value"),
    [
        ("1 + 2 * 3", 7),
        ("(1 + 2) * 3", 9),
        ("7 / 2", 3.5),
        ("7 % 4", 3),
        ("-2 - -3", 1),
        ("not 1 == 2", True),
        ("True and not False or False", True),
        ("True xor True", False),
        ("1 < 2", True),
        ("2 >= 3", False),
        ("1.5e-3", 0.0015),
        ("\"a\" + 'b'", "ab"),
        ("[1, 2, 3][1]", 2),
        ("[[1, 2], [3, 4]][1, 0]", 3),
        ("p[1, 2, 3, 4, 5, 6][5]", 6),
    ],
)
def test_expressions(expression: str, value: object) -> None:
    assert values_of(f"say({expression})") == [value]


def test_lines_mean_nothing() -> None:
    assert values_of("x = # the value comes\n\n\n 4 y = 5", "say(x", "+ y)") == [9]


def test_six_values_after_p_are_a_pose_and_one_is_an_index() -> None:
    said = values_of("p = p[1, 2, 3, 4, 5, 6]", "p[0] = p[1] * 10", "say(p)")
    assert said == [[20, 2, 3, 4, 5, 6]]
    assert isinstance(said[0], PoseValue)


def test_lists_are_copied_where_they_are_assigned_or_passed() -> None:
    assert values_of(
        "def change(a): a[0] = 9 return a end",
        "x = [1, 2]",
        "y = x",
        "y[1] = 7",
        "z = change(x)",
        "say(x) say(y) say(z)",
    ) == [[1, 2], [1, 7], [9, 2]]


def test_names_are_global_only_where_said_so() -> None:
    assert values_of(
        "global g = 1",
        "l = 2",
        "def set(): g = 10 l = 20 say(l) end",
        "set()",
        "say(g) say(l)",
    ) == [20, 10, 2]


def test_a_name_without_a_value_stops_the_program() -> None:
    bench = Bench("def f():\n l = 1\n def g(): say(l) end\n g()\nend\n")
    with pytest.raises(ScriptError, match=r"line 3: .*'l'"):
        bench.run()


def test_control_flow() -> None:
    assert values_of(
        "i = 0",
        "while True:",
        " i = i + 1",
        " if i == 2: continue elif i > 4: break else: say(i) end",
        "end",
        "say(100)",
    ) == [1, 3, 4, 100]


def test_defaults_and_named_arguments() -> None:
    assert values_of("def f2(a, b=2, c=3): say([a, b, c]) end", "f2(1) f2(1, c=5) f2(b=7, a=8)") == [
        [1, 2, 3],
        [1, 2, 5],
        [8, 7, 3],
    ]


def test_and_does_not_evaluate_what_it_need_not() -> None:
    assert values_of("def shout(): say(1) return True end", "x = False and shout() y = True or shout()") == []


def test_functions_that_take_time_within_expressions() -> None:
    assert values_of("def slow(x): sync() say(x) return x end", "say(slow(1) + slow(2) * [slow(3)][0])") == [
        1,
        2,
        3,
        7,
    ]


def test_threads_take_turns_and_begin_within_the_cycle() -> None:
    said = values_of(
        "thread t(): while True: say(1, 1) sync() end end",
        "h = run t()",
        "sync() sync()",
        "kill h",
        "sync() sync()",
    )
    assert said == [(1, 0), (1, 1)]


def test_join_waits_for_a_thread() -> None:
    assert values_of("thread t(): sync() sync() say(1) end", "h = run t()", "join h", "say(2)") == [1, 2]


def test_killing_nobody_is_allowed() -> None:
    assert values_of("kill 0", "say(1)") == [1]


def test_a_thread_may_kill_itself() -> None:
    assert values_of(
        "global h = 0", "thread t(): kill h say(1) sync() say(2) end", "h = run t() sync() sync()"
    ) == [1]


def test_in_a_critical_section_nobody_else_runs() -> None:
    said = values_of(
        "thread t(): while True: say(2) sync() end end",
        "enter_critical",
        "h = run t()",
        "sync() say(1) sync() say(1)",
        "exit_critical",
        "sync()",
    )
    assert said[:3] == [1, 1, 2]


def test_the_end_of_the_program_ends_its_threads_and_lets_go() -> None:
    bench = Bench("def f():\n thread t(): while True: sync() end end\n run t()\n sync()\nend\n")
    bench.run()
    assert sorted(bench.released) == [1, 2]


def test_halt_ends_it_at_once() -> None:
    assert values_of("say(1)", "halt", "say(2)") == [1]


@pytest.mark.parametrize(
    ("text", "complaint"),
    [
        ("def f():\n while True: end\nend", r"'sync\(\)'"),
        ("def f():\n f2() end", "'f2'"),
        ("def f():\n say() end", "missing a required argument"),
        ("def f():\n say(1, 2, 3) end", "too many positional"),
        ("def f():\n say(x=1, y=2) end", "missing a required argument|unexpected keyword"),
        ("def f():\n def g(a): end g(1, 2) end", "'g' takes \\(a\\)"),
        ("def f():\n if 1: end end", "True or False"),
        ("def f():\n x = 1 / 0 end", "line 2: division by zero"),
        ("def f():\n x = [1][1] end", "outside the list"),
        ("def f():\n x = 1 + True end", "number"),
        ("def f():\n x = end", "'end'"),
        ("def f():\n x = 1", "'end'"),
        ("def f():\n 5 end", "stands alone"),
        ("def f():\n x = 1 ? 2 end", r"'\?'"),
        ("def f() x = 1 end", "':'"),
        ("def f():\n break end", "line 2: 'break' outside loop"),
        ("def f():\n def g(x): sync() say(1 / x) end\n g(0) end", "line 2: division by zero"),
        ("def f():\n x = 1 end y", "expected the end of the text"),
        ("def f():\n __class__.x() end", "line 2"),
        ("def f():\n x = " + "(" * 5000 + " end", "nested"),
        ("def f():\n def g(): g() end g() end", r"RecursionError|'sync\(\)'"),
    ],
)
def test_bad_programs_say_what_and_where(text: str, complaint: str) -> None:
    with pytest.raises(ScriptError, match=complaint):
        Bench(text).run()


@pytest.mark.parametrize(
    "body",
    [
        "x = [1, 2] while True: x = [x, x] sync() end",
        "x = [0] while True: x[0] = [x, x] sync() end",
        "def twice(y): return [y, y] end x = [1] while True: x = twice(x) sync() end",
        "x = [1, 2] while True: x = [[x, x], [x, x], [x, x], [x, x], [x, x]] end",
    ],
)
def test_lists_do_not_grow_without_end(body: str) -> None:
    with pytest.raises(ScriptError, match="10000"):
        Bench(f"def f():\n {body}\nend").run()


def test_a_list_may_hold_thousands() -> None:
    thousand = "[" + ", ".join(["7"] * 1000) + "]"
    assert values_of(f"x = [{', '.join([thousand] * 9)}] y = x say(y[8, 999])") == [7]


def test_few_turns_that_take_long_end_the_program_within_its_cycle() -> None:
    thousand = "[" + ", ".join(["7"] * 1000) + "]"
    bench = Bench(f"def f():\n x = [{', '.join([thousand] * 9)}]\n while True: y = x end\nend")
    began = time.thread_time()
    with pytest.raises(ScriptError, match=r"'sync\(\)'"):
        bench.run()
    assert time.thread_time() - began < 20 * LONGEST_TURN, "20,000 turns take some twenty seconds"


def test_whole_numbers_do_not_grow_without_end() -> None:
    with pytest.raises(ScriptError):
        Bench("def f():\n x = 2 while True: x = x * x end end").run()


@pytest.mark.parametrize(
    ("text", "length"),
    [
        ("def f(): if True: x = 1 end end\nrest", 31),
        ("  sec s(): end ", 14),
        ('def f(): textmsg("end") # end\nend ', 33),
        ("def f(): weekend = 1", 0),
        ("stopj(2)\nstopl(1)\n", 9),
        ("stopj(2)", 0),
        ("", 0),
    ],
)
def test_programs_are_cut_out_of_the_stream(text: str, length: int) -> None:
    assert whole_length(text) == length
